//! Use of flash and RAM by the firmware, beside what the chip has and what was recorded.

use std::fmt;

use crate::image::{Image, Sizes};

/// Largest growth of a size since its record, as a divisor: 2 %.
const GROWTH: u32 = 50;

/// Returns the sizes of the firmware of `chip` in a record. A line of it is `CHIP FLASH RAM`.
pub fn recorded(record: &str, chip: &str) -> Option<Sizes> {
    let mut lines = record.lines().map(str::split_whitespace);
    let mut words = lines.find_map(|mut words| (words.next() == Some(chip)).then_some(words))?;
    let mut size = || words.next()?.parse().ok();
    Some(Sizes { flash: size()?, ram: size()? })
}

/// Sizes of a firmware with those in the record.
#[derive(Debug)]
pub struct Usage<'a> {
    image: &'a Image,
    recorded: Sizes,
}

impl<'a> Usage<'a> {
    /// Returns the sizes of `image`, to be compared with the `recorded` ones.
    pub fn new(image: &'a Image, recorded: Sizes) -> Self {
        Self { image, recorded }
    }

    /// Returns whether a size is more than 2 % above its record.
    pub fn has_grown(&self) -> bool {
        let has_grown = |used: u32, recorded: u32| used > recorded + recorded / GROWTH;
        let used = self.image.used();
        has_grown(used.flash, self.recorded.flash) || has_grown(used.ram, self.recorded.ram)
    }
}

impl fmt::Display for Usage<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (used, room, recorded) = (self.image.used(), self.image.room, self.recorded);
        for (name, used, room, recorded) in [
            ("flash     ", used.flash, room.flash, recorded.flash),
            ("static RAM", used.ram, room.ram, recorded.ram),
        ] {
            writeln!(f, "{name} {used:>7} of {room:>7} bytes, recorded {recorded:>7}")?;
        }
        write!(f, "stack      {:>7} bytes", self.image.stack)
    }
}

//! Places in the source where a firmware may panic.

use plumb_protocol::panic_place;

use crate::image::Image;

/// First address of the flash, on every chip.
const START: u32 = 0x1000_0000;

/// Longest path of a source file, bytes.
const MAX_PATH: usize = 255;

/// Place in the source where a firmware may panic.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PanicPlace {
    /// Address of its `core::panic::Location` in flash.
    pub address: u32,
    /// Path of the file, as the compiler gives it.
    pub file: String,
    /// Line, from 1.
    pub line: u32,
}

impl PanicPlace {
    /// Returns the number by which the board reports the place.
    pub fn number(&self) -> u32 {
        panic_place(&self.file, self.line)
    }
}

/// Returns every place in `image`: four words, the address and length of a path that ends in ".rs",
/// a line and a column. The layout is that of `Location` in Rust 1.95.
pub fn panic_places(image: &Image) -> Vec<PanicPlace> {
    let word = |at: usize| {
        let bytes = image.flash.get(at..at + 4)?;
        Some(u32::from_le_bytes(bytes.try_into().ok()?))
    };
    let place = |at: usize| {
        let [path, length, line] = [word(at)?, word(at + 4)?, word(at + 8)?];
        let (start, length) = (path.checked_sub(START)? as usize, length as usize);
        let bytes = image.flash.get(start..start.checked_add(length)?)?;
        let file = str::from_utf8(bytes).ok().filter(|file| file.ends_with(".rs"))?;
        let fits = length <= MAX_PATH && line > 0;
        let address = START + at as u32;
        fits.then(|| PanicPlace { address, file: file.to_owned(), line })
    };
    (0..image.flash.len()).step_by(4).filter_map(place).collect()
}

//! Where the motors were: a picture that arrives late is of a ball that hung on the cables of then.

use crate::clock::TICK_US;

/// Ticks between two entries: 8 ms.
const TICKS: u32 = 40;

/// Entries: half a second, 0.8 kilobytes.
const ENTRIES: usize = 64;

/// From one entry to the next, µs.
const SPACING_US: u32 = TICKS * TICK_US;

/// The motors' positions of the last half second.
#[derive(Debug, Clone, Copy)]
pub(super) struct History {
    entries: [[i32; 3]; ENTRIES],
    /// The newest one.
    newest: usize,
    /// Ticks since it.
    ticks: u32,
}

impl History {
    pub(super) const EMPTY: Self = Self { entries: [[0; 3]; ENTRIES], newest: 0, ticks: 0 };

    /// A tick has passed.
    #[inline(always)]
    pub(super) fn tick(&mut self) {
        self.ticks = self.ticks.wrapping_add(1);
    }

    /// Whether the motors' positions are to be [entered](Self::enter) now.
    #[inline(always)]
    pub(super) fn is_due(&self) -> bool {
        self.ticks >= TICKS
    }

    /// The motors are at `positions` now (1/16 steps).
    #[inline(never)]
    pub(super) fn enter(&mut self, positions: [i32; 3]) {
        self.ticks = 0;
        self.newest = (self.newest + 1) % ENTRIES;
        self.entries[self.newest] = positions;
    }

    /// Where the motors were `age_us` before `now`, when they are at `positions`; the oldest that
    /// is known where it is longer ago than that.
    pub(super) fn ago(&self, age_us: u32, positions: [i32; 3]) -> [i32; 3] {
        let since_newest = self.ticks * TICK_US;
        if age_us <= since_newest {
            return between(
                self.entries[self.newest],
                positions,
                since_newest - age_us,
                since_newest.max(1),
            );
        }
        let beyond = age_us - since_newest;
        let entry = |k: usize| self.entries[(self.newest + ENTRIES - k) % ENTRIES];
        let k = (beyond / SPACING_US) as usize;
        if k + 1 >= ENTRIES {
            return entry(ENTRIES - 1);
        }
        between(entry(k + 1), entry(k), SPACING_US - beyond % SPACING_US, SPACING_US)
    }
}

/// The point `part`/`whole` of the way from `a` to `b`.
fn between(a: [i32; 3], b: [i32; 3], part: u32, whole: u32) -> [i32; 3] {
    // Bits: 31 + 13.
    [0, 1, 2].map(|i| {
        a[i] + ((i64::from(b[i]) - i64::from(a[i])) * i64::from(part) / i64::from(whole)) as i32
    })
}

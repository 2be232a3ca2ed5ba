//! History of the motor positions: a position of the ball belongs to the cable lengths at its
//! capture.

use plumb_protocol::dimension::{MOTORS, PerMotor};

use crate::timing::TICK_US;
use crate::vector::per_motor;

/// Ticks between two entries: 8 ms.
const SPACING_TICKS: u32 = 40;

/// Number of entries: half a second, 0.8 kB.
const ENTRIES: usize = 64;

/// Time between two entries, µs.
const SPACING_US: u32 = SPACING_TICKS * TICK_US;

/// Motor positions of the last half second, Q4 steps.
#[derive(Debug, Clone, Copy)]
pub(super) struct History {
    entries: [PerMotor<i32>; ENTRIES],
    /// Index of the newest entry.
    newest: usize,
    /// Ticks since the newest entry.
    ticks: u32,
}

impl History {
    pub(super) const EMPTY: Self = Self { entries: [[0; MOTORS]; ENTRIES], newest: 0, ticks: 0 };

    /// Counts a tick.
    #[inline(always)]
    pub(super) fn tick(&mut self) {
        self.ticks = self.ticks.wrapping_add(1);
    }

    /// Returns whether an [entry](Self::enter) is due.
    #[inline(always)]
    pub(super) fn is_due(&self) -> bool {
        self.ticks >= SPACING_TICKS
    }

    /// Enters the present positions (Q4 steps).
    #[inline(never)]
    pub(super) fn enter(&mut self, positions: PerMotor<i32>) {
        self.ticks = 0;
        self.newest = (self.newest + 1) % ENTRIES;
        self.entries[self.newest] = positions;
    }

    /// Returns the positions `age_us` ago, interpolated; `positions` are the present ones. Returns
    /// the oldest entry where `age_us` is beyond it.
    pub(super) fn ago(&self, age_us: u32, positions: PerMotor<i32>) -> PerMotor<i32> {
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

/// Interpolates: returns the point at `part`/`whole` of the way from `a` to `b`.
fn between(a: PerMotor<i32>, b: PerMotor<i32>, part: u32, whole: u32) -> PerMotor<i32> {
    // Bits: positions 31 + `part` 13.
    per_motor(|i| {
        a[i] + ((i64::from(b[i]) - i64::from(a[i])) * i64::from(part) / i64::from(whole)) as i32
    })
}

//! Time base of the step generation, and the pulse timing of a STEP/DIR driver in its clocks.

use plumb_protocol::boards::{Chip, WIDEST_PULSE_CLOCKS};
use plumb_protocol::units::Nanoseconds;
use plumb_protocol::wiring::StepDir;

/// Length of a tick, µs. Short enough that a new position changes the rates within 325 µs; long
/// enough that planning takes a few percent of the chip.
pub const TICK_US: u32 = 200;

/// Longest span of the moving average over the step plan, ms.
pub(crate) const MAX_MEAN_MS: u16 = 400;

/// Chip whose clocks are counted.
const CHIP: Chip = if cfg!(feature = "rp2350") { Chip::Rp2350 } else { Chip::Rp2040 };

/// Frequency of the clock that pulses are placed on, Hz. It is the chip's system clock, so that a
/// plan is exact there: 125 MHz on an RP2040, 150 MHz on an RP2350 (feature `rp2350`). The number
/// of pulses in a tick does not depend on it.
pub const CLOCK_HZ: u32 = CHIP.clock_hz();

/// Clocks in a microsecond.
pub const CLOCKS_PER_US: u32 = CLOCK_HZ / 1_000_000;

/// Clocks in a tick.
pub const TICK_CLOCKS: u32 = CLOCKS_PER_US * TICK_US;

/// Clocks from the end of a segment's last pulse to the first pulse of the next segment, at least.
///
/// It is the sum of the generator's instructions between the two; [`segment`](crate::segment)
/// counts them and checks this number.
pub(crate) const MIN_LOW: u32 = 14;

/// Minimum times at a driver's inputs, in clocks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DriverTiming {
    /// Time that STEP is high, at least, as a width that the generator can make.
    pub high: PulseWidth,
    /// Time from the beginning of a pulse to a change of DIR, at least. Never below `high`.
    pub hold: u32,
    /// Time that STEP is low between pulses, at least.
    pub low: u32,
    /// Time from a change of DIR to the next pulse, at least.
    pub setup: u32,
}

// What `Wiring::check` refuses is what the generator cannot make.
const _: () = assert!(DriverTiming::SLOWEST.high.clocks() == WIDEST_PULSE_CLOCKS);

impl DriverTiming {
    /// The slowest timing that the generator can make: safe for any driver while none is
    /// configured.
    pub const SLOWEST: Self =
        Self { high: PulseWidth { rounds: 31, delay: 15 }, hold: 513, low: 513, setup: 513 };

    /// Converts the times of a data sheet, rounded up to whole clocks. Returns `None` where the
    /// generator cannot make pulses so wide (above 513 clocks: 4.1 µs on an RP2040, 3.4 µs on an
    /// RP2350).
    pub fn new(driver: &StepDir) -> Option<Self> {
        let clocks = |ns: Nanoseconds| CHIP.clocks(ns);
        let high = PulseWidth::at_least(clocks(driver.high))?;
        let hold = clocks(driver.hold).max(high.clocks());
        // The next segment, whose direction may be another, begins once DIR was held.
        let low = clocks(driver.low).max(hold - high.clocks() + MIN_LOW);
        Some(Self { high, hold, low, setup: clocks(driver.setup) })
    }

    /// Returns the least time from one pulse to the next, clocks.
    pub const fn min_period(&self) -> u32 {
        self.high.clocks() + self.low
    }

    /// Returns the highest pulse rate, pulses/s. One clock is left for the rounding of the plan's
    /// periods.
    pub const fn max_pulse_rate(&self) -> u32 {
        CLOCK_HZ / (self.min_period() + 1)
    }
}

/// Width of a pulse as the generator makes it: one clock, then a loop of up to 32 rounds of up to
/// 16 clocks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PulseWidth {
    /// Rounds of the loop minus one, 0..32: the operand of `set x`.
    pub rounds: u8,
    /// Clocks of a round minus one, 0..16: the delay of `jmp x--`.
    pub delay: u8,
}

impl PulseWidth {
    /// Returns the least width of at least `clocks`; `None` above 513.
    #[cold]
    pub fn at_least(clocks: u32) -> Option<Self> {
        let looped = clocks.saturating_sub(1).max(1);
        (0..16u8)
            .filter_map(|delay| {
                let rounds = looped.div_ceil(u32::from(delay) + 1);
                (rounds <= 32).then_some(Self { rounds: (rounds - 1) as u8, delay })
            })
            .min_by_key(Self::clocks)
    }

    /// Returns the time that the pulse is high, clocks.
    pub const fn clocks(&self) -> u32 {
        1 + (self.rounds as u32 + 1) * (self.delay as u32 + 1)
    }
}

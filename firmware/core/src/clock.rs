//! Time base of the step generation: the tick and the clock that pulses are placed on.

/// Length of a tick, µs. Short enough that a new position changes the rates within 300 µs; long
/// enough that planning takes a few percent of the chip.
pub const TICK_US: u32 = 200;

/// Frequency of the clock that pulses are placed on, Hz. It is the RP2040's system clock, so that
/// a plan is exact there.
pub const CLOCK_HZ: u32 = 125_000_000;

/// Clocks in a microsecond.
pub const CLOCKS_PER_US: u32 = CLOCK_HZ / 1_000_000;

/// Clocks in a tick.
pub const TICK_CLOCKS: u32 = CLOCKS_PER_US * TICK_US;

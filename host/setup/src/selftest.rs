//! Self-test of a board's chip, without a rig: the pulses at its pins, its flash, its clock, and
//! what it has counted meanwhile.
//!
//! The motors' supply is off. The board turns each motor to and fro by jogs, as it would on a rig,
//! and a second part of the chip counts the pulses at the pins.

use std::time::Duration;

use plumb_protocol::config::{Config, JogLimits, Motor};
use plumb_protocol::diagnostics::{ChipMeasurement, Diagnostics, PulseCount};
use plumb_protocol::message::Jog;
use plumb_protocol::units::{Acceleration, Rate, Steps16};
use plumb_protocol::wiring::{Drivers, StepDir, Wiring};
use plumb_runtime::link::{Link, LinkError, Transport};
use plumb_runtime::rig::BoardName;
use serde::Serialize;

/// Rates of the jogs, pulses/s; the highest is that of the build.
pub const PULSE_RATES: [i32; 3] = [1_000, 100_000, 1_250_000];

/// Duration of a jog at its rate, as a part of a second.
const JOGS_PER_SECOND: i32 = 10;

/// Pulses of a full step: with 16 microsteps a pulse is a unit of [`Steps16`].
const MICROSTEPS: u8 = 16;

/// Longest distance of a motor from where it began, 1/16 steps.
const TRAVEL: i32 = 1 << 20;

/// Largest deviation of the chip's clock from USB's frames, parts per million: that of a full-speed
/// host (USB 2.0, section 7.1.11).
const MAX_DEVIATION: f64 = 500.0;

/// Frames of USB after which their number begins anew.
const FRAMES: i64 = 2048;

/// Time between two looks at a motor that turns.
const LOOK_INTERVAL: Duration = Duration::from_millis(20);

/// Result of one check.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Outcome {
    /// The chip does it.
    Passed,
    /// It does not.
    Failed,
    /// It could not be measured.
    NotMeasured,
}

impl Outcome {
    /// Returns the outcome of a claim that holds or does not.
    fn of(holds: bool) -> Self {
        if holds { Self::Passed } else { Self::Failed }
    }
}

/// One check, with its result in words.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Check {
    /// What was checked.
    pub check: String,
    /// Its outcome.
    pub outcome: Outcome,
    /// What was measured.
    pub measured: String,
}

/// Returns the configuration of the self-test: the fastest driver, the highest rate.
fn config() -> Config {
    let rate = Rate(PULSE_RATES[2] / i32::from(MICROSTEPS) * 256);
    let motor = Motor {
        max_rate: rate,
        max_acceleration: Acceleration(4_000_000),
        travel_min: Steps16(-TRAVEL),
        travel_max: Steps16(TRAVEL),
        reversed: false,
    };
    Config {
        motors: [motor; 3].into(),
        microsteps: MICROSTEPS,
        jog: JogLimits { max_rate: rate, max_distance: Steps16(TRAVEL) },
        ..Config::example()
    }
}

/// Runs the self-test of a board with the pins of this kind. `told` gets each check when it is
/// done. The board keeps the configuration of the self-test until it is configured or restarts;
/// what its flash keeps is unchanged.
///
/// # Errors
/// Where the board refuses: it is in motion or in a fault, has coils configured, or is an emulated
/// one; or the link fails.
pub fn run<T: Transport>(
    link: &mut Link<T>,
    board: BoardName,
    mut told: impl FnMut(&Check),
) -> Result<Vec<Check>, LinkError> {
    let drivers = Drivers::StepDir(StepDir::TMC2209);
    let wiring = Wiring { board: board.kind(), pins: board.board().pins, drivers };
    let mut checks = Vec::new();
    let mut done = |check: Check| {
        told(&check);
        checks.push(check);
    };
    let (begin, counted) = (link.measure()?, link.diagnostics()?);
    link.configure(wiring, config())?;
    for rate in PULSE_RATES {
        for (motor, name) in (0..).zip(["A", "B", "C"]) {
            done(check_pulses(link, motor, name, rate)?);
        }
    }
    done(check_flash(link)?);
    done(check_clock(&begin, &link.measure()?));
    let diagnostics = link.diagnostics()?;
    done(check_ticks(&counted, &diagnostics));
    done(check_stack(&diagnostics));
    Ok(checks)
}

/// Turns a motor to and fro, and compares the pulses at its pins with its way.
fn check_pulses<T: Transport>(
    link: &mut Link<T>,
    motor: u8,
    name: &str,
    rate: i32,
) -> Result<Check, LinkError> {
    let before = link.measure()?.pulses;
    let distance = rate / JOGS_PER_SECOND;
    for distance in [distance, -distance] {
        turn(link, motor, distance, rate)?;
    }
    let after = link.measure()?.pulses;
    let mut wanted = [PulseCount::default(); 3];
    let pulses = distance.unsigned_abs();
    wanted[usize::from(motor)] = PulseCount { low: pulses, high: pulses };
    let counted = [0, 1, 2].map(|i| PulseCount {
        low: after[i].low.wrapping_sub(before[i].low),
        high: after[i].high.wrapping_sub(before[i].high),
    });
    let words = counted.map(|count| format!("{}+{}", count.high, count.low)).join(", ");
    Ok(Check {
        check: format!("motor {name}, {pulses} pulses to and fro at {rate} pulses/s"),
        outcome: Outcome::of(counted == wanted),
        measured: format!("pulses at the pins of A, B, C: {words}"),
    })
}

/// Turns a motor by `distance` at `rate`, in pulses and pulses/s, and waits for its end.
fn turn<T: Transport>(
    link: &mut Link<T>,
    motor: u8,
    distance: i32,
    rate: i32,
) -> Result<(), LinkError> {
    let rate = Rate(rate * (256 / i32::from(MICROSTEPS)));
    link.jog(Jog { motor, distance: Steps16(distance), rate })?;
    loop {
        let telemetry = link.status()?;
        if !link.is_jogging(&telemetry)? {
            return Ok(());
        }
        link.wait(LOOK_INTERVAL)?;
    }
}

/// Has the board erase, write and read a sector of its flash.
fn check_flash<T: Transport>(link: &mut Link<T>) -> Result<Check, LinkError> {
    let written = link.test_flash()?;
    Ok(Check {
        check: "flash: a sector erased, written and read back".to_owned(),
        outcome: Outcome::of(written),
        measured: if written { "as written" } else { "not as written" }.to_owned(),
    })
}

/// Compares the chip's clock with USB's frames.
fn check_clock(begin: &ChipMeasurement, end: &ChipMeasurement) -> Check {
    let check = "clock against the frames of USB".to_owned();
    let elapsed = f64::from(end.time_us.wrapping_sub(begin.time_us));
    let (Some(first), Some(last)) = (begin.usb_frame, end.usb_frame) else {
        let measured = "no frames: the board is on its UART".to_owned();
        return Check { check, outcome: Outcome::NotMeasured, measured };
    };
    // The number of the frames that the clock tells, but for whole turns of their number.
    let expected = (elapsed / 1000.0).round() as i64;
    let more = (i64::from(last) - i64::from(first) - expected).rem_euclid(FRAMES);
    let more = if more > FRAMES / 2 { more - FRAMES } else { more };
    let frames = (expected + more) as f64;
    let (deviation, step) = ((elapsed / (1000.0 * frames) - 1.0) * 1e6, 1e9 / elapsed);
    Check {
        check,
        outcome: Outcome::of(deviation.abs() <= MAX_DEVIATION + step),
        measured: format!(
            "{:.3} s in {frames} frames of 1 ms: {deviation:.0} ppm, to {step:.0} ppm",
            elapsed * 1e-6
        ),
    }
}

/// Checks that no tick was late while motors turned.
fn check_ticks(before: &Diagnostics, after: &Diagnostics) -> Check {
    let late = after.chip.late_ticks.saturating_sub(before.chip.late_ticks);
    let at_rest = after.chip.late_at_rest.saturating_sub(before.chip.late_at_rest);
    Check {
        check: "no late tick while motors turn".to_owned(),
        outcome: Outcome::of(late == 0),
        measured: format!("{late} late, {at_rest} at rest"),
    }
}

/// Checks that the stack has never been full.
fn check_stack(diagnostics: &Diagnostics) -> Check {
    let check = "stack".to_owned();
    let Some(free) = diagnostics.chip.free_stack else {
        return Check { check, outcome: Outcome::NotMeasured, measured: "unknown".to_owned() };
    };
    let measured = format!("{free} bytes were never used");
    Check { check, outcome: Outcome::of(free > 0), measured }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(time_us: u32, usb_frame: Option<u16>) -> ChipMeasurement {
        ChipMeasurement { time_us, usb_frame, ..ChipMeasurement::default() }
    }

    #[test]
    fn the_clock_is_compared_with_the_frames() {
        for (begin, end, outcome) in [
            (at(0, Some(0)), at(10_000_000, Some(10_000 % 2048)), Outcome::Passed),
            // Both numbers wrap.
            (at(u32::MAX - 999, Some(2047)), at(5_000_000, Some(5_000 % 2048)), Outcome::Passed),
            (at(0, Some(0)), at(10_000_000, Some(10_005 % 2048)), Outcome::Passed),
            (at(0, Some(0)), at(10_000_000, Some(10_007 % 2048)), Outcome::Failed),
            (at(0, Some(0)), at(10_000_000, Some(9_993 % 2048)), Outcome::Failed),
            // No frames come.
            (at(0, Some(7)), at(10_000_000, Some(7)), Outcome::Failed),
            (at(0, None), at(10_000_000, Some(7)), Outcome::NotMeasured),
        ] {
            let check = check_clock(&begin, &end);
            assert_eq!(check.outcome, outcome, "{begin:?} {end:?}: {}", check.measured);
        }
    }
}

//! Numbers of a rig file: their ranges and units, which docs/use/rig-file.md repeats, and their
//! conversion to the board's units. Ranges of numbers that the board gets are the board's own
//! (`Params` in firmware/core).

use plumb_config::quantities;
use plumb_config::quantity::Range;
use plumb_protocol::dimension::{LEAST_MOTORS, MOTORS, MotorList};
use plumb_protocol::units::Point;
use serde::Deserializer;
use thiserror::Error;

/// Full steps of a turn of a common stepper motor (1.8 degrees a step).
pub const FULL_STEPS_PER_REVOLUTION: f64 = 200.0;

/// Lengths of cable that a turn of a motor can wind, metres.
pub const CABLE_PER_TURN_RANGE_M: [f64; 2] = [0.02, 0.5];

/// Current that a TMC2209 bears, amperes, root mean square (data sheet, first page).
pub(super) const LARGEST_CURRENT_A: f64 = 2.0;

quantities! {
    /// Distance of the ball at which the board acts, metres.
    Distance = Range::above_zero(1.0, "m");
    /// Time after which the board acts, seconds.
    Deadline = Range::above_zero(5.0, "s");
    /// Time without progress, seconds.
    ProgressTime = Range::above_zero(60.0, "s");
    /// Movement of a ball that follows, metres. Less is within the noise of its position.
    Movement = Range::new(0.005, 1.0, "m");
    /// Delay of a law, seconds. The default is none.
    #[derive(Default)]
    Delay = Range::new(0.0, 0.5, "s");
    /// Running mean of a law, seconds. The default is none.
    #[derive(Default)]
    Mean = Range::new(0.0, 0.4, "s");
    /// Least time of a high pulse, seconds.
    HighTime = Range::above_zero(4.1e-6, "s");
    /// Least time of a low pulse, seconds.
    LowTime = Range::above_zero(65e-6, "s");
    /// Least time from a change of direction to a pulse, seconds.
    SetupTime = Range::new(0.0, 65e-6, "s");
    /// Least time from a pulse to a change of direction, seconds.
    HoldTime = Range::new(0.0, 65e-6, "s");
    /// Least time from ENABLE to a pulse, seconds.
    EnableTime = Range::new(0.0, 0.2, "s");
    /// Current of a motor, amperes, root mean square. The sense resistor may allow less.
    Current = Range::above_zero(LARGEST_CURRENT_A, "A");
    /// Sense resistor of a driver, ohms.
    SenseResistor = Range::new(0.05, 1.0, "Ω");
    /// Share of the supply's voltage.
    Duty = Range::new(0.005, 1.0, "");
    /// Rate of a motor, full steps/s. The driver and the build of the board may allow less.
    MotorRate = Range::above_zero(1_250_000.0, "full steps/s");
    /// Acceleration of a motor, full steps/s².
    MotorAcceleration = Range::new(40.0, 4_000_000.0, "full steps/s²");
    /// Turn of a motor without the ball, full steps.
    Turn = Range::above_zero(100_000.0, "full steps");
    /// Distance of a jog, full steps: at most the widest travel.
    JogDistance = Range::above_zero(67_108_864.0, "full steps");
    /// Limit of the travel, full steps.
    TravelLimit = Range::new(-33_554_432.0, 33_554_432.0, "full steps");
    /// Gain of the law `interval`, 1/s.
    Gain = Range::above_zero(7539.0, "1/s");
    /// Gain of the law `sign`, 1/s.
    SignGain = Range::above_zero(1884.0, "1/s");
    /// Bound of |dp/du|, metres of ball for a metre of cable.
    JacobianBound = Range::above_zero(7.99, "");
    /// Coordinate of a corner of the workspace, metres.
    #[derive(Default)]
    Corner = Range::new(-4.0, 4.0, "m");
    /// Speed of a reference, m/s.
    ReferenceSpeed = Range::above_zero(2.0, "m/s");
    /// Acceleration of a reference, m/s².
    ReferenceAcceleration = Range::above_zero(20.0, "m/s²");
    /// Jerk of a reference, m/s³.
    ReferenceJerk = Range::above_zero(1000.0, "m/s³");
    /// Cable that a full step winds, metres.
    CablePerStep = Range::new(1e-7, 0.1, "m");
    /// Radius of a pulley, metres.
    PulleyRadius = Range::new(1e-4, 1.0, "m");
}

/// Range of the rate of a serial line.
pub const BAUD: Range = Range::new(300.0, 20_000_000.0, "bit/s");

/// Range of the pictures in a row within which a target counts as reached.
const FRAMES: Range = Range::new(1.0, 255.0, "pictures");

/// Range of the number of motors.
const MOTOR_COUNT: Range = Range::new(LEAST_MOTORS as f64, MOTORS as f64, "motors");

/// Reads the number of motors.
pub(super) fn motor_count<'de, D: Deserializer<'de>>(deserializer: D) -> Result<u8, D::Error> {
    MOTOR_COUNT.deserialize_whole(deserializer)
}

/// Reads the rate of a serial line, bit/s.
pub(super) fn baud<'de, D: Deserializer<'de>>(deserializer: D) -> Result<u32, D::Error> {
    BAUD.deserialize_whole(deserializer)
}

/// Reads a number of pictures in a row.
pub(super) fn frames<'de, D: Deserializer<'de>>(deserializer: D) -> Result<u8, D::Error> {
    FRAMES.deserialize_whole(deserializer)
}

/// Value that the board cannot be sent, or that every board of this kind refuses.
#[derive(Debug, Clone, Error, PartialEq)]
#[error("`{key}`{} {why}", .value.map_or_else(String::new, |value| format!(" = {value}")))]
pub struct OutOfRange {
    /// The key in the rig file.
    pub key: &'static str,
    /// Its value; `None` where the reason names it.
    pub value: Option<f64>,
    /// Reason.
    pub why: String,
}

/// Reason of a value that is beyond the range of the wire.
const NO_ROOM: &str = "is out of the board's range";

/// Conversion that collects every value out of range.
#[derive(Debug, Default)]
pub(super) struct Conversion {
    errors: Vec<OutOfRange>,
}

impl Conversion {
    /// Converts with `convert`. Returns the result, or the first value out of range.
    pub(super) fn first_error<T>(convert: impl FnOnce(&mut Self) -> T) -> Result<T, OutOfRange> {
        let mut conversion = Self::default();
        let converted = convert(&mut conversion);
        conversion.errors.into_iter().next().map_or(Ok(converted), Err)
    }

    /// Returns every value out of range, in the order of conversion.
    pub(super) fn into_errors(self) -> Vec<OutOfRange> {
        self.errors
    }

    /// Adds an error.
    pub(super) fn report(&mut self, key: &'static str, value: f64, why: &'static str) {
        self.errors.push(OutOfRange { key, value: Some(value), why: why.to_owned() });
    }

    /// Converts `value` of `key`. A value out of range becomes 0 and is reported.
    pub(super) fn fit<Q: Default>(
        &mut self,
        key: &'static str,
        value: f64,
        convert: impl FnOnce(f64) -> Option<Q>,
    ) -> Q {
        convert(value).unwrap_or_else(|| {
            self.report(key, value, NO_ROOM);
            Q::default()
        })
    }

    /// Returns the list of `key` where it has an entry for each of `count` motors. Another one is
    /// reported.
    pub(super) fn per_motor<T: Copy>(
        &mut self,
        key: &'static str,
        list: Option<MotorList<T>>,
        count: usize,
    ) -> Option<MotorList<T>> {
        let list = list?;
        if list.len() != count {
            let why = format!("has {} entries, and `motors.count` is {count}", list.len());
            self.errors.push(OutOfRange { key, value: None, why });
            return None;
        }
        Some(list)
    }

    /// Converts a point, metres. A point out of range becomes the origin; its largest coordinate is
    /// reported.
    pub(super) fn point(&mut self, key: &'static str, metres: [f64; 3]) -> Point {
        Point::from_metres(metres).unwrap_or_else(|| {
            let largest = |a: f64, b: f64| if b.abs() > a.abs() { b } else { a };
            self.report(key, metres.into_iter().fold(0.0, largest), NO_ROOM);
            Point::default()
        })
    }
}

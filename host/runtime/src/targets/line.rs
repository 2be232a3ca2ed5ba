//! Line of a stream of targets.

use nalgebra::{Point3, Vector3};
use serde::Deserialize;
use thiserror::Error;

/// Longest line, bytes, including its end.
pub const MAX_LINE_BYTES: u64 = 1024;

/// Largest time stamp, seconds. Time stamps in nanoseconds since 1970 are beyond it.
const MAX_TIME_S: f64 = 1e10;

/// Largest coordinate, metres, and largest speed along an axis, m/s. Millimetres are beyond it.
const MAX_VALUE: f64 = 100.0;

/// Line of a stream: a place of the target. An unknown key is an error. A message in another
/// format, such as one of ROS 2, becomes a line by [`TargetLine::new`].
///
/// ```
/// use plumb_runtime::targets::TargetLine;
///
/// let line = r#"{"t": 12.345, "target": [0.4, 0.3, 0.2], "velocity": [0.05, 0, 0]}"#;
/// assert_eq!(TargetLine::parse(line)?.t, Some(12.345));
/// assert!(TargetLine::parse(r#"{"target": [400, 300, 200]}"#).is_err());
/// # Ok::<(), plumb_runtime::targets::LineMistake>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TargetLine {
    /// When the target is there: seconds on any clock that runs evenly. Without it, the time of the
    /// line's arrival counts.
    pub t: Option<f64>,
    /// Place, metres in the rig frame.
    target: [f64; 3],
    /// Velocity, m/s. Without it, it is computed from the last places.
    velocity: Option<[f64; 3]>,
}

/// Mistake in a line.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum LineMistake {
    /// The line is not the JSON of a target.
    #[error("no target: {0}; a line is {{\"t\": 1.5, \"target\": [0.4, 0.3, 0.2]}}")]
    Json(String),
    /// The time stamp is out of its range.
    #[error("`t` is {0}: seconds, within ±1e10 (not milliseconds or nanoseconds)")]
    Time(f64),
    /// A number is out of its range.
    #[error("`{key}` has {value}: {unit}, within ±{MAX_VALUE}{}", not_millimetres(.unit))]
    Value {
        /// Key.
        key: &'static str,
        /// The number.
        value: f64,
        /// Unit.
        unit: &'static str,
    },
}

impl TargetLine {
    /// Parses and checks a line.
    ///
    /// # Errors
    /// The first mistake.
    pub fn parse(text: &str) -> Result<Self, LineMistake> {
        if !text.trim_start().starts_with('{') {
            return Err(LineMistake::Json("this is no object of JSON".to_owned()));
        }
        let line: Self = serde_json::from_str(text)
            .map_err(|error: serde_json::Error| LineMistake::Json(without_line(&error)))?;
        line.check()?;
        Ok(line)
    }

    /// Returns the line of a target at `position` (metres in the rig frame) at the time `t`
    /// (seconds on the sender's clock), with `velocity` (m/s) where it is known.
    ///
    /// # Errors
    /// The first number that is not finite or out of its range.
    pub fn new(
        t: Option<f64>,
        position: Point3<f64>,
        velocity: Option<Vector3<f64>>,
    ) -> Result<Self, LineMistake> {
        let line = Self { t, target: position.into(), velocity: velocity.map(Into::into) };
        line.check()?;
        Ok(line)
    }

    /// Checks the ranges of the numbers.
    fn check(&self) -> Result<(), LineMistake> {
        if let Some(t) = self.t.filter(|t| !is_within(*t, MAX_TIME_S)) {
            return Err(LineMistake::Time(t));
        }
        check("target", "metres", self.target)?;
        check("velocity", "m/s", self.velocity.unwrap_or_default())
    }

    /// Returns the place, metres in the rig frame.
    pub fn position(&self) -> Point3<f64> {
        self.target.into()
    }

    /// Returns the velocity, m/s.
    pub fn velocity(&self) -> Option<Vector3<f64>> {
        self.velocity.map(Vector3::from)
    }
}

/// Returns the message of an error in a line of JSON. The line has its own number.
fn without_line(error: &serde_json::Error) -> String {
    if error.is_eof() {
        return "the line is cut off".to_owned();
    }
    let (text, column) = (error.to_string(), error.column());
    let place = format!(" at line {} column {column}", error.line());
    format!("{} at column {column}", text.strip_suffix(&place).unwrap_or(&text))
}

fn check(key: &'static str, unit: &'static str, values: [f64; 3]) -> Result<(), LineMistake> {
    match values.into_iter().find(|value| !is_within(*value, MAX_VALUE)) {
        Some(value) => Err(LineMistake::Value { key, value, unit }),
        None => Ok(()),
    }
}

/// Returns the end of a sentence about a number of this unit that is far too large.
fn not_millimetres(unit: &str) -> &'static str {
    if unit == "metres" { " (not millimetres)" } else { "" }
}

/// Returns whether a number is finite and within ±`limit`.
fn is_within(value: f64, limit: f64) -> bool {
    value.abs() <= limit
}

#[cfg(test)]
mod tests {
    use plumb_config::error_chain::ErrorChain;

    use super::*;

    #[test]
    fn a_line_is_read_strictly() {
        let line = TargetLine::parse(r#"{"target": [0.4, 0.3, 0.2]}"#).unwrap();
        assert_eq!((line.t, line.velocity()), (None, None));
        assert_eq!(line.position(), Point3::new(0.4, 0.3, 0.2));
        let line = r#"{"t": -1, "velocity": [0.05, 0, -0.1], "target": [0, 0, 0]}"#;
        let velocity = TargetLine::parse(line).unwrap().velocity();
        assert_eq!(velocity, Some(Vector3::new(0.05, 0.0, -0.1)));
        for (text, named) in [
            ("", "no target: this is no object of JSON"),
            (
                "0.4 0.3 0.2",
                r#"no target: this is no object of JSON; a line is {"t": 1.5, "target": ["#,
            ),
            ("[0.4, 0.3, 0.2]", "no target: this is no object of JSON"),
            ("{}", "missing field `target`"),
            (r#"{"target": [0,4, 0,3, 0,2]}"#, r#"; a line is {"t": 1.5, "target": [0.4, "#),
            (r#"{"target": [0.4, 0.3]}"#, "no target: "),
            (r#"{"target": [0.4, 0.3, null]}"#, "no target: "),
            (r#"{"target": [1e999, 0, 0]}"#, "number out of range"),
            (r#"{"target": [0.4, 0.3, 0.2], "speed": 1}"#, "unknown field `speed`"),
            (r#"{"target": [400, 0, 0]}"#, "`target` has 400: metres, within ±100 (not m"),
            (r#"{"target": [0, 0, 0], "velocity": [0, 0, 1e9]}"#, "`velocity` has 1000000000: m/s"),
            (r#"{"t": 1.7e18, "target": [0, 0, 0]}"#, "not milliseconds or nanoseconds"),
            ("{\"target\": [0, 0, 0]} {", "trailing characters"),
            ("{\"target\": [0, 0,\n", ": the line is cut off; a line is "),
        ] {
            let mistake = TargetLine::parse(text).unwrap_err();
            let message = ErrorChain(&mistake).to_string();
            assert!(message.contains(named), "{text}: {message}");
        }
    }

    #[test]
    fn the_line_of_a_message_in_another_format_has_the_same_ranges() {
        let place = Point3::new(0.4, 0.3, 0.2);
        let line = TargetLine::new(Some(7.5), place, None).unwrap();
        assert_eq!(line, TargetLine::parse(r#"{"t": 7.5, "target": [0.4, 0.3, 0.2]}"#).unwrap());
        let fast = Vector3::new(0.0, f64::INFINITY, 0.0);
        for (t, position, velocity, named) in [
            (Some(f64::NAN), place, None, "`t` is NaN"),
            (None, Point3::new(0.4, f64::NAN, 0.2), None, "`target` has NaN"),
            (None, Point3::new(0.4, 300.0, 0.2), None, "`target` has 300"),
            (None, place, Some(fast), "`velocity` has inf"),
        ] {
            let message = TargetLine::new(t, position, velocity).unwrap_err().to_string();
            assert!(message.contains(named), "{message}");
        }
    }
}

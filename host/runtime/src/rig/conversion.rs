//! Conversion of a rig file's values to the board's units.

use plumb_protocol::units::Point;
use thiserror::Error;

/// Value that the board cannot be sent.
#[derive(Debug, Clone, Error, PartialEq)]
#[error("`{key}` = {value} {why}")]
pub struct OutOfRange {
    /// The key in the rig file.
    pub key: &'static str,
    /// Its value.
    pub value: f64,
    /// Reason.
    pub why: &'static str,
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
        self.errors.push(OutOfRange { key, value, why });
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

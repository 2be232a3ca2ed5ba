//! Numbers with a range and a unit, for configuration files and command lines.

use std::f64::consts::PI;
use std::fmt;

use serde::de::Error as _;
use serde::{Deserialize, Deserializer};
use thiserror::Error;

/// Range of a number, with its unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Range {
    low: f64,
    /// Whether `low` itself is out of the range.
    is_open: bool,
    high: f64,
    /// Unit; empty where there is none.
    unit: &'static str,
}

impl Range {
    /// Returns the range from `low` to `high`, both included.
    pub const fn new(low: f64, high: f64, unit: &'static str) -> Self {
        Self { low, is_open: false, high, unit }
    }

    /// Returns the usual other units of such a number.
    fn other_units(&self) -> impl Iterator<Item = OtherUnit> + use<> {
        let unit = self.unit;
        OTHER_UNITS.into_iter().filter(move |other| other.unit == unit)
    }

    /// Returns the range of numbers above 0, up to `high`.
    pub const fn above_zero(high: f64, unit: &'static str) -> Self {
        Self { low: 0.0, is_open: true, high, unit }
    }

    /// Returns whether `x` is in the range.
    pub const fn contains(&self, x: f64) -> bool {
        // A number that is none compares with nothing.
        (if self.is_open { x > self.low } else { x >= self.low }) && x <= self.high
    }

    /// Returns `x`, if it is in the range.
    ///
    /// # Errors
    /// Where it is not.
    pub const fn check(&self, x: f64) -> Result<f64, NumberError> {
        if self.contains(x) { Ok(x) } else { Err(NumberError { value: x, range: *self }) }
    }

    /// Reads a number of the range from a command line.
    ///
    /// # Errors
    /// Where the text is no number, or one out of the range, in words.
    pub fn parse(&self, text: &str) -> Result<f64, String> {
        let number = text.parse().map_err(|_| format!("must be a number, {self}"))?;
        self.check(number).map_err(|error| error.to_string())
    }

    /// Returns the whole number `n`, if it is in the range.
    ///
    /// # Errors
    /// Where it is not, or `T` cannot hold it.
    pub fn check_whole<T: TryFrom<i128>>(&self, n: i128) -> Result<T, NumberError> {
        let value = self.check(n as f64)?;
        T::try_from(n).map_err(|_| NumberError { value, range: *self })
    }

    /// Reads a whole number of this range, for `#[serde(deserialize_with = "...")]`.
    ///
    /// # Errors
    /// Where it is no whole number, or out of the range.
    pub fn deserialize_whole<'de, T, D>(&self, deserializer: D) -> Result<T, D::Error>
    where
        T: TryFrom<i128>,
        D: Deserializer<'de>,
    {
        let number = i64::deserialize(deserializer)?;
        self.check_whole(number.into()).map_err(D::Error::custom)
    }
}

impl fmt::Display for Range {
    /// Writes "above 0, to 5 s" or "-100 to 100 m".
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.is_open {
            f.write_str("above ")?;
        }
        write_bound(f, self.low)?;
        f.write_str(if self.is_open { ", to " } else { " to " })?;
        write_bound(f, self.high)?;
        if self.unit.is_empty() { Ok(()) } else { write!(f, " {}", self.unit) }
    }
}

/// Writes the end of a range: "0.4", "65535", "1e9", "6.5e-5".
fn write_bound(f: &mut fmt::Formatter<'_>, bound: f64) -> fmt::Result {
    let is_plain = bound == 0.0 || (1e-4..1e9).contains(&bound.abs());
    if is_plain { write!(f, "{bound}") } else { write!(f, "{bound:e}") }
}

/// Number out of its range.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[error("{} must be {range}{}", shown(*value), hint(*value, range))]
pub struct NumberError {
    value: f64,
    range: Range,
}

/// Unit that people use in place of one of Plumb.
#[derive(Debug, Clone, Copy, PartialEq)]
struct OtherUnit {
    /// Symbol of Plumb's unit.
    unit: &'static str,
    /// Name in the plural, such as "centimetres".
    name: &'static str,
    /// Such units in one of Plumb.
    count: f64,
}

/// Usual other units.
const OTHER_UNITS: [OtherUnit; 11] = [
    OtherUnit { unit: "m", name: "millimetres", count: 1000.0 },
    OtherUnit { unit: "m", name: "centimetres", count: 100.0 },
    OtherUnit { unit: "m/s", name: "millimetres a second", count: 1000.0 },
    OtherUnit { unit: "m/s", name: "centimetres a second", count: 100.0 },
    OtherUnit { unit: "mm", name: "centimetres", count: 0.1 },
    OtherUnit { unit: "mm", name: "metres", count: 0.001 },
    OtherUnit { unit: "s", name: "milliseconds", count: 1000.0 },
    OtherUnit { unit: "s", name: "minutes", count: 1.0 / 60.0 },
    OtherUnit { unit: "s", name: "hours", count: 1.0 / 3600.0 },
    OtherUnit { unit: "degrees", name: "radians", count: PI / 180.0 },
    OtherUnit { unit: "A", name: "milliamperes", count: 1000.0 },
];

/// Returns a number as a person writes it: a whole one without a decimal point.
fn shown(value: f64) -> String {
    let text = format!("{value:?}");
    text.strip_suffix(".0").unwrap_or(&text).to_owned()
}

/// Largest number of amperes that a person may mean as such. No motor of a rig has more.
const MAX_AMPERES: f64 = 10.0;

/// Returns the end of a message about a number in a usual other unit; empty where it is in none.
fn hint(value: f64, range: &Range) -> String {
    let is_meant = |other: &OtherUnit| {
        range.contains(value / other.count) && (other.unit != "A" || value > MAX_AMPERES)
    };
    let meant = range.other_units().filter(|other| is_meant(other));
    match &meant.map(|other| other.name).collect::<Vec<_>>()[..] {
        [] if range.unit == "1/m" && range.contains(value.recip()) => {
            "; is it the size of a unit? Write its inverse".to_owned()
        }
        [] => String::new(),
        names => format!("; is it in {}?", names.join(" or ")),
    }
}

/// Defines types of numbers with a range and a unit, which are checked when they are read.
#[macro_export]
macro_rules! quantities {
    ($($(#[$about:meta])* $name:ident = $range:expr;)+) => {$(
        $(#[$about])*
        #[derive(Debug, Clone, Copy, PartialEq, PartialOrd, ::serde::Deserialize)]
        #[serde(try_from = "f64")]
        pub struct $name(f64);

        impl $name {
            /// Range, with the unit.
            pub const RANGE: $crate::quantity::Range = $range;

            /// Returns a constant of the program. One that is out of the range does not compile,
            /// where it is evaluated at compile time.
            pub const fn constant(x: f64) -> Self {
                assert!(Self::RANGE.contains(x), "the constant is out of its range");
                Self(x)
            }

            /// Returns the number.
            pub const fn get(self) -> f64 {
                self.0
            }
        }

        impl TryFrom<f64> for $name {
            type Error = $crate::quantity::NumberError;

            fn try_from(x: f64) -> Result<Self, Self::Error> {
                Self::RANGE.check(x).map(Self)
            }
        }
    )+};
}

quantities! {
    /// Coordinate of a place, metres. No rig is farther from its origin; millimetres are beyond it.
    #[derive(Default)]
    Coordinate = Range::new(-100.0, 100.0, "m");
    /// Diameter of a ball, metres.
    BallDiameter = Range::new(0.001, 10.0, "m");
    /// Focal length, pixels.
    FocalLength = Range::new(1.0, 1e6, "pixels");
    /// Column or row of a picture, pixels.
    PixelCoordinate = Range::new(0.0, 65_535.0, "pixels");
    /// Coefficient of a lens's distortion.
    #[derive(Default)]
    DistortionCoefficient = Range::new(-1000.0, 1000.0, "");
    /// Units of depth in a metre.
    DepthUnits = Range::new(1.0, 1e6, "1/m");
    /// Hue, degrees: 0 red (the default), 120 green, 240 blue.
    #[derive(Default)]
    Hue = Range::new(0.0, 360.0, "degrees");
    /// Time of a camera: an exposure, a latency, seconds.
    CameraTime = Range::above_zero(10.0, "s");
    /// Gain of a camera, in the units of its driver.
    CameraGain = Range::new(-1e6, 1e6, "");
    /// Colour of light that a camera shows as white, kelvin.
    ColourTemperature = Range::new(1000.0, 20_000.0, "K");
}

/// Range of the columns and rows of a picture.
const SIDE: Range = Range::new(1.0, 65_535.0, "pixels");

/// Range of a camera's rate.
const RATE: Range = Range::new(1.0, 1000.0, "pictures/s");

/// Range of the domains of ROS 2.
const DOMAIN: Range = Range::new(0.0, 232.0, "");

/// Reads the number of columns or rows of a picture.
pub fn pixels<'de, D: Deserializer<'de>>(deserializer: D) -> Result<u16, D::Error> {
    SIDE.deserialize_whole(deserializer)
}

/// Reads the number of columns or rows of a picture, of a key that may be left out.
pub fn some_pixels<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<u16>, D::Error> {
    pixels(deserializer).map(Some)
}

/// Reads the rate of a camera, pictures/s.
pub fn rate<'de, D: Deserializer<'de>>(deserializer: D) -> Result<u16, D::Error> {
    RATE.deserialize_whole(deserializer)
}

/// Reads the number of a domain of ROS 2.
pub fn domain<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<u16>, D::Error> {
    DOMAIN.deserialize_whole(deserializer).map(Some)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_out_of_its_range_is_told_with_range_and_unit() {
        let wrong = |x: f64| CameraTime::try_from(x).unwrap_err().to_string();
        assert_eq!(wrong(1e308), "1e308 must be above 0, to 10 s");
        assert_eq!(wrong(0.0), "0 must be above 0, to 10 s");
        assert_eq!(Range::new(0.0, 65e-6, "s").to_string(), "0 to 6.5e-5 s");
        assert_eq!(wrong(f64::NAN), "NaN must be above 0, to 10 s");
        let wrong = |x: f64| Coordinate::try_from(x).unwrap_err().to_string();
        assert_eq!(wrong(f64::NEG_INFINITY), "-inf must be -100 to 100 m");
        for x in [-100.0, -0.0, 100.0] {
            assert_eq!(Coordinate::try_from(x).map(Coordinate::get), Ok(x));
        }
    }

    #[test]
    fn numbers_in_usual_other_units_are_named() {
        let message = |range: &Range, value| range.check(value).unwrap_err().to_string();
        let millimetres = message(&Coordinate::RANGE, 1737.0);
        let asked = "1737 must be -100 to 100 m; is it in millimetres or centimetres?";
        assert_eq!(millimetres, asked);
        assert_eq!(message(&Coordinate::RANGE, 1e9), "1000000000 must be -100 to 100 m");
        let diameter = message(&BallDiameter::RANGE, 1500.0);
        assert!(diameter.ends_with("; is it in millimetres?"), "{diameter}");
        let side = Range::new(0.2, 3.5, "m");
        assert_eq!(message(&side, 61.0), "61 must be 0.2 to 3.5 m; is it in centimetres?");
        assert!(message(&side, 610.0).ends_with("; is it in millimetres?"));
        let scale = message(&DepthUnits::RANGE, 0.001);
        assert!(scale.ends_with("1/m; is it the size of a unit? Write its inverse"), "{scale}");
        let current = Range::above_zero(5.0, "A");
        assert_eq!(message(&current, 800.0), "800 must be above 0, to 5 A; is it in milliamperes?");
        assert_eq!(message(&current, 5.5), "5.5 must be above 0, to 5 A");
        let speed = message(&Range::above_zero(5.0, "m/s"), 40.0);
        let asked = "is it in millimetres a second or centimetres a second?";
        assert_eq!(speed, format!("40 must be above 0, to 5 m/s; {asked}"));
        assert!(message(&CameraTime::RANGE, 33.0).ends_with("; is it in milliseconds?"));
        assert_eq!(message(&Hue::RANGE, 400.0), "400 must be 0 to 360 degrees");
    }

    #[test]
    fn a_whole_number_out_of_its_range_or_type_is_refused() {
        assert_eq!(SIDE.check_whole(640), Ok(640_u16));
        for n in [0, -1, 65_536, i128::MAX] {
            assert!(SIDE.check_whole::<u16>(n).is_err(), "{n}");
        }
        assert!(Range::new(0.0, 1000.0, "").check_whole::<u8>(256).is_err());
    }
}

//! Numbers on the command line. Each has a range with a unit, which its help, the error and
//! docs/use/commands.md name. They are checked while they are parsed, so that errors name the
//! option.

use clap::builder::TypedValueParser;
use plumb_config::quantity::{Coordinate, Range};
use plumb_path::shape::{LEAST_SIZE_M, MAX_SIZE_M};
use plumb_runtime::rig::CABLE_PER_TURN_RANGE_M;
use plumb_runtime::rig::quantity::{Gain, MotorRate, ReferenceSpeed};
use plumb_setup::new_rig::{BALL_RANGE_M, HEIGHT_RANGE_M, SIDE_RANGE_M};

/// Time of an option. 30 years are a time that every clock can represent.
pub(crate) const TIME: Range = Range::above_zero(1e9, "s");
/// Seed. JSON has all whole numbers of this range.
const SEED: Range = Range::new(0.0, 1e15, "");
/// Share of something.
pub(crate) const SHARE: Range = Range::new(0.0, 1.0, "");
/// Coordinate in the rig frame.
pub(crate) const COORDINATE: Range = Coordinate::RANGE;
/// Speed along a path.
pub(crate) const SPEED: Range = ReferenceSpeed::RANGE;
/// Size of a shape.
pub(crate) const SIZE: Range = Range::new(LEAST_SIZE_M, MAX_SIZE_M, "m");
/// Distance of a path from its waypoints.
pub(crate) const TOLERANCE: Range = Range::new(0.0, 1.0, "m");
/// Gain of the law interval.
pub(crate) const GAMMA: Range = Gain::RANGE;
/// Rate of a jog.
pub(crate) const RATE: Range = MotorRate::RANGE;
/// Distance of a jog, full steps or millimetres. `jog.max_distance` holds too.
pub(crate) const DISTANCE: Range = Range::new(-1e8, 1e8, "");
/// Column or row of a picture, also beyond its edge.
pub(crate) const PIXEL: Range = Range::new(-65_535.0, 65_535.0, "pixels");
/// Columns or rows of a picture.
pub(crate) const PICTURE_SIDE: Range = Range::new(1.0, 65_535.0, "pixels");
/// Angle.
pub(crate) const ANGLE: Range = Range::new(-360.0, 360.0, "degrees");
/// Side of a square of the printed board.
pub(crate) const SQUARE: Range = Range::new(1.0, 1000.0, "mm");
/// Standard deviation of a measured place.
pub(crate) const DEVIATION: Range = Range::new(0.01, 1000.0, "mm");
/// Distance of two guides of a new rig.
pub(crate) const SIDE: Range = of(SIDE_RANGE_M);
/// Height of the guides of a new rig.
pub(crate) const HEIGHT: Range = of(HEIGHT_RANGE_M);
/// Cable that a turn of a motor of a new rig winds.
pub(crate) const CABLE_PER_TURN: Range = of(CABLE_PER_TURN_RANGE_M);
/// Diameter of the ball of a new rig.
pub(crate) const BALL: Range = of(BALL_RANGE_M);

const fn of([low, high]: [f64; 2]) -> Range {
    Range::new(low, high, "m")
}

/// Returns the parser of a number of a range.
pub(crate) fn within(range: Range) -> impl TypedValueParser<Value = f64> {
    move |text: &str| range.parse(text)
}

/// Returns the parser of a whole number of a range.
pub(crate) fn whole<T>(low: f64, high: f64, unit: &'static str) -> impl TypedValueParser<Value = T>
where
    T: TryFrom<i128> + Clone + Send + Sync + 'static,
{
    whole_within(Range::new(low, high, unit))
}

/// Returns the parser of a whole number of a range.
pub(crate) fn whole_within<T>(range: Range) -> impl TypedValueParser<Value = T>
where
    T: TryFrom<i128> + Clone + Send + Sync + 'static,
{
    move |text: &str| parse_whole(text, &range)
}

/// Parses a whole number of a range.
pub(crate) fn parse_whole<T: TryFrom<i128>>(text: &str, range: &Range) -> Result<T, String> {
    let number: i128 = text.parse().map_err(|_| format!("must be a whole number, {range}"))?;
    range.check_whole(number).map_err(|error| error.to_string())
}

/// Returns the parser of a seed.
pub(crate) fn seed() -> impl TypedValueParser<Value = u64> {
    whole_within(SEED)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_out_of_their_range_are_refused_with_it() {
        assert_eq!((TIME.parse("0.5"), COORDINATE.parse("-2")), (Ok(0.5), Ok(-2.0)));
        assert_eq!(["0", "0.25", "1"].map(|it| SHARE.parse(it)), [Ok(0.0), Ok(0.25), Ok(1.0)]);
        for text in [
            "nan", "inf", "-inf", "0", "-1", "-0.0", "1e999", "", "x", "2e9", "1,5", "1.000,5",
            "250ms", "2min", "0.65 s", "0.65,", "1,2,3", ",",
        ] {
            let error = TIME.parse(text).unwrap_err();
            assert!(error.contains("above 0, to 1e9 s"), "{text}: {error}");
        }
        for text in ["nan", "-0.1", "1.1", "inf", "5%"] {
            assert!(SHARE.parse(text).is_err(), "{text}");
        }
        for text in ["1,5", "1.5", "1e16", "nan", "-1.0", "1x", "1e3", "5.0"] {
            let error = parse_whole::<u64>(text, &SEED).unwrap_err();
            assert!(error.ends_with("0 to 1e15"), "{text}: {error}");
        }
    }
}

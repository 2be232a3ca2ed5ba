//! Numbers and addresses on the command line. Each number has a range with a unit, which its help,
//! the error and docs/use/commands.md name. They are checked while they are parsed, so that errors
//! name the option.

use std::net::{IpAddr, SocketAddr};

use clap::builder::TypedValueParser;
use nalgebra::Point3;
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
/// Seconds of a simulation in a second of the computer.
pub(crate) const PACE: Range = Range::new(0.01, 1000.0, "");
/// Coordinate in the rig frame.
pub(crate) const COORDINATE: Range = Coordinate::RANGE;
/// Coordinate in the rig frame, or of a pixel.
pub(crate) const PLACE: Range = Range::new(-100.0, 65_535.0, "m or pixels");
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

/// Parses numbers of a range with commas between them.
pub(crate) fn list<const N: usize>(text: &str, range: &Range) -> Result<[f64; N], String> {
    of_words(text.split(','), range)
}

fn of_words<'a, const N: usize>(
    words: impl Iterator<Item = &'a str>,
    range: &Range,
) -> Result<[f64; N], String> {
    let numbers: Vec<f64> = words.map(|word| range.parse(word.trim())).collect::<Result<_, _>>()?;
    let count = numbers.len();
    numbers.try_into().map_err(|_| format!("needs {N} numbers, each {range}; given: {count}"))
}

/// Parses a place that is typed, "X Y Z" or "X,Y,Z" in metres.
///
/// # Errors
/// Where a number is missing, or no number: between blanks a comma is at the end of a word only.
pub(crate) fn typed_point(text: &str) -> Result<Point3<f64>, String> {
    if !text.contains(char::is_whitespace) {
        return point(text);
    }
    let words = text.split_whitespace().map(|word| word.strip_suffix(',').unwrap_or(word));
    of_words(words, &COORDINATE).map(Point3::from)
}

/// Parses the sides of the triangle of the guides, "AB,BC,CA" in metres.
pub(crate) fn sides(text: &str) -> Result<[f64; 3], String> {
    list(text, &SIDE)
}

/// Parses a point, "X,Y,Z" in metres.
pub(crate) fn point(text: &str) -> Result<Point3<f64>, String> {
    list(text, &COORDINATE).map(Point3::from)
}

/// Reads an address with a port, or a part of it, which gets the other part of `default`.
///
/// # Errors
/// An explanation where the text is no address.
pub(crate) fn with_port(text: &str, default: &str) -> Result<SocketAddr, String> {
    let default: SocketAddr = default.parse().map_err(|_| format!("{default} is no address"))?;
    let address = text.parse().ok();
    let of_ip = || text.parse().ok().map(|ip: IpAddr| SocketAddr::new(ip, default.port()));
    let of_port = || text.parse().ok().map(|port: u16| SocketAddr::new(default.ip(), port));
    address.or_else(of_ip).or_else(of_port).ok_or_else(|| {
        let port = default.port();
        format!("give an IP address, a port or both, such as 0.0.0.0, {port} or {default}")
    })
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

    #[test]
    fn a_typed_place_is_read_or_refused() {
        let place = Ok(Point3::new(0.5, 0.2, 0.15));
        for text in ["0.5 0.2 0.15", "0.5,0.2,0.15", "0.5, 0.2, 0.15"] {
            assert_eq!(typed_point(text), place, "{text}");
        }
        for text in ["0,5 0,2 0,15", "0,5 0,2 0.15", "0,5, 0,2, 0,15", "0.5 o.2 0.1", "", "a"] {
            let error = typed_point(text).unwrap_err();
            assert_eq!(error, "must be a number, -100 to 100 m", "{text}");
        }
        for (text, count) in [("0,5,0,2,0,15", 6), ("0.5 0.2", 2), ("0.5", 1), ("1 1 1 1", 4)] {
            let error = format!("needs 3 numbers, each -100 to 100 m; given: {count}");
            assert_eq!(typed_point(text), Err(error), "{text}");
        }
    }

    #[test]
    fn a_list_has_commas_between_its_numbers() {
        assert_eq!(point("0.5,0.2, 0.15"), Ok(Point3::new(0.5, 0.2, 0.15)));
        // A shell splits "0.5, 0.2, 0.15" at its spaces.
        for text in ["0.5,", "0.5,0.2,", "0,7;1,0;1,0", "0.5 0.2 0.15"] {
            assert!(point(text).is_err(), "{text}");
        }
        assert!(list::<2>("1,2,3", &PIXEL).is_err());
    }

    #[test]
    fn an_address_and_its_port_may_be_left_out() {
        let read = |text| with_port(text, "127.0.0.1:7586").map(|address| address.to_string());
        assert_eq!(read("0.0.0.0"), Ok("0.0.0.0:7586".to_owned()));
        assert_eq!(read("::1"), Ok("[::1]:7586".to_owned()));
        assert_eq!(read("127.0.0.1:0"), Ok("127.0.0.1:0".to_owned()));
        assert_eq!(read("7811"), Ok("127.0.0.1:7811".to_owned()));
        assert!(read("localhost").is_err() && read("70000").is_err());
    }
}

//! Numbers on the command line. Each has a range with a unit, which its help, the error and
//! docs/use/commands.md name. They are checked while they are parsed, so that errors name the
//! option.

use clap::builder::TypedValueParser;
use plumb_config::digit_groups::without_groups;
use plumb_config::quantity::{Coordinate, OtherUnit, Range};
use plumb_path::shape::{LEAST_SIZE_M, MAX_SIZE_M};
use plumb_runtime::rig::new_rig::{
    BALL_RANGE_M, CABLE_PER_TURN_RANGE_M, HEIGHT_RANGE_M, SIDE_RANGE_M,
};
use plumb_runtime::rig::quantity::{Gain, MotorRate, ReferenceSpeed};

/// Time of an option. 30 years are a time that every clock can represent.
pub(super) const TIME: Range = Range::above_zero(1e9, "s");
/// Seed. JSON has all whole numbers of this range.
const SEED: Range = Range::new(0.0, 1e15, "");
/// Share of something.
pub(super) const SHARE: Range = Range::new(0.0, 1.0, "");
/// Coordinate in the rig frame.
pub(super) const COORDINATE: Range = Coordinate::RANGE;
/// Speed along a path.
pub(super) const SPEED: Range = ReferenceSpeed::RANGE;
/// Size of a shape.
pub(super) const SIZE: Range = Range::new(LEAST_SIZE_M, MAX_SIZE_M, "m");
/// Distance of a path from its waypoints.
pub(super) const TOLERANCE: Range = Range::new(0.0, 1.0, "m");
/// Gain of the law interval.
pub(super) const GAMMA: Range = Gain::RANGE;
/// Rate of a jog.
pub(super) const RATE: Range = MotorRate::RANGE;
/// Distance of a jog, full steps or millimetres. `jog.max_distance` holds too.
pub(super) const DISTANCE: Range = Range::new(-1e8, 1e8, "");
/// Column or row of a picture, also beyond its edge.
pub(super) const PIXEL: Range = Range::new(-65_535.0, 65_535.0, "pixels");
/// Columns or rows of a picture.
pub(super) const PICTURE_SIDE: Range = Range::new(1.0, 65_535.0, "pixels");
/// Angle.
pub(super) const ANGLE: Range = Range::new(-360.0, 360.0, "degrees");
/// Side of a square of the printed board.
pub(super) const SQUARE: Range = Range::new(1.0, 1000.0, "mm");
/// Standard deviation of a measured place.
pub(super) const DEVIATION: Range = Range::new(0.01, 1000.0, "mm");
/// Distance of two guides of a new rig.
pub(super) const SIDE: Range = of(SIDE_RANGE_M);
/// Height of the guides of a new rig.
pub(super) const HEIGHT: Range = of(HEIGHT_RANGE_M);
/// Cable that a turn of a motor of a new rig winds.
pub(super) const CABLE_PER_TURN: Range = of(CABLE_PER_TURN_RANGE_M);
/// Diameter of the ball of a new rig.
pub(super) const BALL: Range = of(BALL_RANGE_M);

const fn of([low, high]: [f64; 2]) -> Range {
    Range::new(low, high, "m")
}

/// Parses a number of a range.
pub(super) fn parse(text: &str, range: &Range) -> Result<f64, String> {
    let wrong = |_| format!("must be a number, {range}{}", hint(text, range));
    let number: f64 = text.parse().map_err(wrong)?;
    range.check(number).map_err(|error| match in_percent(number, range) {
        Some(share) => format!("{error}; write {share} for {number} %"),
        None => error.to_string(),
    })
}

/// Returns the share that a number out of the range of shares is in percent; `None` for any other
/// number.
fn in_percent(number: f64, range: &Range) -> Option<f64> {
    let is_percent = *range == SHARE && !range.contains(number) && range.contains(number / 100.0);
    is_percent.then_some(number / 100.0)
}

/// Returns the hint at the end of an error about `text`: how the number is written where it has a
/// decimal comma, groups of digits, a comma behind it or a unit, else nothing.
fn hint(text: &str, range: &Range) -> String {
    if let Some(hint) = unit_hint(text, range) {
        return hint;
    }
    match with_decimal_point(text).filter(|point| point != text) {
        Some(point) => format!("; write {point}, with a decimal point"),
        None => without_groups(text)
            .filter(|number| number.parse().is_ok_and(|number| range.check(number).is_ok()))
            .map(|number| format!("; write {number}, with nothing between the thousands"))
            .unwrap_or_default(),
    }
}

/// Returns the hint about a number with a unit or a comma behind it: what to write, in the unit of
/// `range`. `None` for another text.
fn unit_hint(text: &str, range: &Range) -> Option<String> {
    let number = text.trim_end_matches(|c: char| !c.is_ascii_digit() && c != '.');
    let rest = text[number.len()..].trim();
    let number = with_decimal_point(number).filter(|_| !rest.is_empty())?;
    let unit = range.unit();
    if let Some(converted) = in_unit_of(range, &number, rest) {
        let unit = if unit.is_empty() { String::new() } else { format!(", in {unit}") };
        return Some(format!("; write {converted}{unit}"));
    }
    let is_own = || unit == rest || own_words(unit).contains(&rest);
    Some(match unit {
        "" => format!("; write {number} alone"),
        _ if rest.starts_with(',') => format!("; write {number} alone"),
        _ if is_own() => format!("; write {number} alone, in {unit}"),
        _ => format!("; write a number alone, in {unit}"),
    })
}

/// Returns the usual other words for a unit.
fn own_words(unit: &str) -> &'static [&'static str] {
    match unit {
        "m" => &["metre", "metres", "meter", "meters"],
        "s" => &["sec", "secs", "second", "seconds"],
        "degrees" => &["°", "deg", "degree"],
        "pixels" => &["px", "pixel"],
        "pictures" => &["picture", "frames"],
        "pictures/s" => &["fps", "Hz"],
        "bit/s" => &["baud", "Baud", "Bd", "bd", "bps"],
        "microsteps" => &["microstep"],
        _ => &[],
    }
}

/// Returns a number with the symbol or the name of a usual other unit in the unit of `range`;
/// `None` for another word. A share may be in percent.
fn in_unit_of(range: &Range, number: &str, symbol: &str) -> Option<f64> {
    let is_meant = |other: &OtherUnit| other.is_meant_by(symbol);
    let percent = || (symbol == "%" && *range == SHARE).then_some(100.0);
    let count = range.other_units().find(is_meant).map(|other| other.count).or_else(percent);
    let converted = number.parse::<f64>().ok()? / count?;
    // Nine decimal places: without the rounding of the division.
    Some((converted * 1e9).round() / 1e9)
}

/// Returns a number of which a decimal comma has become a point; `None` where it is none then.
pub(super) fn with_decimal_point(word: &str) -> Option<String> {
    let point = word.replacen(',', ".", 1);
    point.parse::<f64>().is_ok().then_some(point)
}

/// Returns the parser of a number of a range.
pub(super) fn within(range: Range) -> impl TypedValueParser<Value = f64> {
    move |text: &str| parse(text, &range)
}

/// Returns the parser of a whole number of a range.
pub(super) fn whole<T>(low: f64, high: f64, unit: &'static str) -> impl TypedValueParser<Value = T>
where
    T: TryFrom<i128> + Clone + Send + Sync + 'static,
{
    whole_within(Range::new(low, high, unit))
}

/// Returns the parser of a whole number of a range.
pub(super) fn whole_within<T>(range: Range) -> impl TypedValueParser<Value = T>
where
    T: TryFrom<i128> + Clone + Send + Sync + 'static,
{
    move |text: &str| parse_whole(text, &range)
}

/// Parses a whole number of a range.
pub(super) fn parse_whole<T: TryFrom<i128>>(text: &str, range: &Range) -> Result<T, String> {
    let wrong = |_| {
        let hint = unit_hint(text, range).or_else(|| whole_hint(text, range));
        format!("must be a whole number, {range}{}", hint.unwrap_or_default())
    };
    let number: i128 = text.parse().map_err(wrong)?;
    range.check_whole(number).map_err(|error| error.to_string())
}

/// Returns the hint about a whole number of `range` with a decimal point or an exponent, or about
/// microsteps as a part of a step: how it is written. `None` for another text.
fn whole_hint(text: &str, range: &Range) -> Option<String> {
    let parts = text.strip_prefix("1/").filter(|_| range.unit() == "microsteps");
    let number: f64 = parts.unwrap_or(text).parse().ok()?;
    (number.fract() == 0.0 && range.contains(number)).then(|| format!("; write {number}"))
}

/// Returns the parser of a seed.
pub(super) fn seed() -> impl TypedValueParser<Value = u64> {
    whole_within(SEED)
}

#[cfg(test)]
mod tests {
    use plumb_runtime::rig::quantity::BAUD;

    use super::*;

    #[test]
    fn numbers_out_of_their_range_are_refused_with_it() {
        assert_eq!((parse("0.5", &TIME), parse("-2", &COORDINATE)), (Ok(0.5), Ok(-2.0)));
        for text in ["nan", "inf", "-inf", "0", "-1", "-0.0", "1e999", "", "x", "2e9", "1,5"] {
            let error = parse(text, &TIME).unwrap_err();
            assert!(error.contains("above 0, to 1e9 s"), "{text}: {error}");
        }
        let error = parse("-0,5", &COORDINATE).unwrap_err();
        assert!(error.ends_with("; write -0.5, with a decimal point"), "{error}");
        let error = parse("1.000,5", &TIME).unwrap_err();
        assert!(error.ends_with("; write 1000.5, with nothing between the thousands"), "{error}");
        // No rig has such a side.
        let error = parse("610,880,930", &SIDE).unwrap_err();
        assert!(!error.contains("write"), "{error}");
        for (text, range, says) in [
            ("65cm", SIDE, "; write 0.65, in m"),
            ("650 mm", SIDE, "; write 0.65, in m"),
            ("-6,5cm", SIDE, "; write -0.065, in m"),
            ("40cm/s", SPEED, "; write 0.4, in m/s"),
            ("250ms", TIME, "; write 0.25, in s"),
            ("50mm", SPEED, "; write 0.05, in m/s"),
            ("50 mm/s", SPEED, "; write 0.05, in m/s"),
            ("0.05m/s", SPEED, "; write 0.05 alone, in m/s"),
            ("50km/h", SPEED, "; write a number alone, in m/s"),
            ("3.3cm", SQUARE, "; write 33, in mm"),
            ("36 mm", SQUARE, "; write 36 alone, in mm"),
            ("90°", ANGLE, "; write 90 alone, in degrees"),
            ("0.65,", SIDE, "; write 0.65 alone"),
            ("0.65 m", SIDE, "; write 0.65 alone, in m"),
            ("0,65m", SIDE, "; write 0.65 alone, in m"),
            ("2min", TIME, "; write 120, in s"),
            ("1.5 minutes", TIME, "; write 90, in s"),
            ("1h", TIME, "; write 3600, in s"),
            ("30sec", TIME, "; write 30 alone, in s"),
            ("2 lightyears", TIME, "; write a number alone, in s"),
            ("120deg", ANGLE, "; write 120 alone, in degrees"),
            ("0.5rad", ANGLE, "; write 28.647889757, in degrees"),
            ("65 centimeters", SIDE, "; write 0.65, in m"),
            ("5%", SHARE, "; write 0.05"),
        ] {
            let error = parse(text, &range).unwrap_err();
            assert!(error.ends_with(says), "{error}");
        }
        let whole = |text, range| parse_whole::<u64>(text, &range).unwrap_err();
        assert!(whole("15 px", PICTURE_SIDE).ends_with("; write 15 alone, in pixels"));
        assert!(whole("9600Bd", BAUD).ends_with("; write 9600 alone, in bit/s"));
        let microsteps = Range::new(1.0, 16.0, "microsteps");
        assert!(whole("1/16", microsteps).ends_with("; write 16"));
        assert!(!whole("1/32", microsteps).contains("write"));
        assert!(!whole("1/16", SEED).contains("write"));
        assert!(whole("1x", SEED).ends_with("; write 1 alone"));
        assert!(whole("1e3", SEED).ends_with("; write 1000"));
        assert!(whole("5.0", SEED).ends_with("; write 5"));
        for text in ["1,5", "1.5", "1e16", "nan", "-1.0"] {
            assert!(whole(text, SEED).ends_with("0 to 1e15"), "{text}");
        }
        let share = |text| parse(text, &SHARE).unwrap_err();
        assert!(share("5").ends_with("; write 0.05 for 5 %"), "{}", share("5"));
        assert!(!share("150").contains("write") && !share("-5").contains("write"));
        for text in ["1,2,3", "1,", ",", "1,x"] {
            let error = parse(text, &COORDINATE).unwrap_err();
            let has_tail = matches!(text, "1," | "1,x");
            assert_eq!(error.contains("; write 1 alone"), has_tail, "{error}");
            assert!(!error.contains("decimal"), "{error}");
        }
        assert_eq!(["0", "0.25", "1"].map(|it| parse(it, &SHARE)), [Ok(0.0), Ok(0.25), Ok(1.0)]);
        for text in ["nan", "-0.1", "1.1", "inf"] {
            assert!(parse(text, &SHARE).is_err(), "{text}");
        }
    }
}

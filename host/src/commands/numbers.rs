//! Numbers on the command line. They are checked while they are parsed, so that errors name the
//! option.

use plumb_cameras::toml_file::{Finite, NumberError, Positive};

/// Longest time of an option, seconds: 30 years, which every clock can represent.
const LONGEST_S: f64 = 1e9;

/// Parses a finite number.
pub(super) fn finite(text: &str) -> Result<f64, String> {
    checked(text, Finite::try_from, Finite::get)
}

/// Parses a finite number above 0.
pub(super) fn positive(text: &str) -> Result<f64, String> {
    checked(text, Positive::try_from, Positive::get)
}

/// Parses a finite number that is not below 0.
pub(super) fn not_negative(text: &str) -> Result<f64, String> {
    let number = finite(text)?;
    if number >= 0.0 { Ok(number) } else { Err(format!("{number} must not be below 0")) }
}

/// Parses a time above 0 and at most [`LONGEST_S`], seconds.
pub(super) fn seconds(text: &str) -> Result<f64, String> {
    let time = positive(text)?;
    if time <= LONGEST_S { Ok(time) } else { Err(format!("{time} must be at most {LONGEST_S} s")) }
}

/// Parses a share, 0 to 1.
pub(super) fn share(text: &str) -> Result<f64, String> {
    let share = finite(text)?;
    if (0.0..=1.0).contains(&share) {
        Ok(share)
    } else {
        Err(format!("{share} must be from 0 to 1"))
    }
}

/// Parses a number and checks it with `check`.
fn checked<T>(
    text: &str,
    check: impl FnOnce(f64) -> Result<T, NumberError>,
    value: impl FnOnce(T) -> f64,
) -> Result<f64, String> {
    let number = text.parse().map_err(|_| "must be a number".to_owned())?;
    check(number).map(value).map_err(|error| error.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_out_of_their_range_are_refused() {
        assert_eq!(
            (seconds("0.5"), positive("1e300"), finite("-2")),
            (Ok(0.5), Ok(1e300), Ok(-2.0))
        );
        for text in ["nan", "inf", "-inf", "0", "-1", "-0.0", "1e999", "", "x", "2e9"] {
            assert!(seconds(text).is_err(), "{text}");
        }
        for text in ["nan", "inf", "0", "-1", "1e999"] {
            assert!(positive(text).is_err(), "{text}");
        }
        assert_eq!((share("0"), share("0.25"), share("1")), (Ok(0.0), Ok(0.25), Ok(1.0)));
        for text in ["nan", "-0.1", "1.1", "inf"] {
            assert!(share(text).is_err(), "{text}");
        }
        for text in ["nan", "inf", "-inf", "1e999", "1,5"] {
            assert!(finite(text).is_err(), "{text}");
        }
    }
}

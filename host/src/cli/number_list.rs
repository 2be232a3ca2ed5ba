//! Several numbers in one word of the command line, with commas between them: places, sides.

use nalgebra::Point3;
use plumb_config::quantity::Range;

use crate::cli::numbers;

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
    of_words(words, &numbers::COORDINATE).map(Point3::from)
}

/// Parses the sides of the triangle of the guides, "AB,BC,CA" in metres.
pub(crate) fn sides(text: &str) -> Result<[f64; 3], String> {
    list(text, &numbers::SIDE)
}

/// Parses a point, "X,Y,Z" in metres.
pub(crate) fn point(text: &str) -> Result<Point3<f64>, String> {
    list(text, &numbers::COORDINATE).map(Point3::from)
}

#[cfg(test)]
mod tests {
    use super::*;

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
        assert!(list::<2>("1,2,3", &numbers::PIXEL).is_err());
    }
}

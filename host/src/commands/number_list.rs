//! Several numbers in one word of the command line, with commas between them: places, sides.

use nalgebra::Point3;
use plumb_config::digit_groups::is_digits;
use plumb_config::quantity::Range;

use super::numbers;

/// Parses numbers of a range with commas between them.
pub(super) fn list<const N: usize>(text: &str, range: &Range) -> Result<[f64; N], String> {
    let words: Vec<&str> = text.split(',').map(str::trim).collect();
    if let Some(points) = with_points::<N>(&words) {
        return Err(format!("write decimal points: {}", points.join(",")));
    }
    if text.contains(';') {
        return Err(format!("needs {N} numbers with decimal points, and commas between them"));
    }
    // "0.5, 0.2, 0.1" comes as "0.5,": a shell has split it at its spaces.
    if words.len() <= N && words.last() == Some(&"") {
        return Err(format!("needs {N} numbers with commas between them, without spaces"));
    }
    let numbers: Vec<f64> =
        words.iter().map(|it| numbers::parse(it, range)).collect::<Result<_, _>>()?;
    let count = numbers.len();
    let is_place = N == 3 && [0.4, 0.2, 0.15].iter().all(|number| range.contains(*number));
    let example = if is_place { "; write 0.4,0.2,0.15, for example" } else { "" };
    numbers.try_into().map_err(|_| {
        format!(
            "needs {N} numbers with commas between them, without spaces, each {range}; \
             given: {count}{example}"
        )
    })
}

/// Returns N numbers with decimal points where `words` are the parts before and behind their
/// decimal commas: whole numbers, twice as many as are needed. `None` for other words.
fn with_points<const N: usize>(words: &[&str]) -> Option<Vec<String>> {
    let is_whole = |word: &&str| is_digits(word.trim_start_matches('-'));
    let are_pairs = words.len() == 2 * N && words.iter().all(is_whole);
    are_pairs.then(|| words.chunks(2).map(|pair| pair.join(".")).collect())
}

/// Parses a place that is typed, "X Y Z" or "X,Y,Z" in metres.
///
/// # Errors
/// An explanation, such as of a decimal comma or a missing number.
pub(super) fn typed_point(text: &str) -> Result<Point3<f64>, String> {
    let words: Vec<&str> = text.split_whitespace().collect();
    let with_point = |word: &str| numbers::with_decimal_point(word.trim_end_matches(','));
    let has_comma =
        |word: &&str| word.trim_end_matches(',').contains(',') && with_point(word).is_some();
    if words.len() > 1 && words.iter().any(has_comma) {
        let points = words.iter().map(|word| with_point(word).unwrap_or_default());
        let points = points.collect::<Vec<_>>().join(" ");
        return Err(format!("write decimal points: {points}"));
    }
    let numbers = text.split([',', ' ', '\t']).filter(|it| !it.is_empty()).collect::<Vec<_>>();
    match numbers.len() {
        count @ ..3 => Err(match &["x", "y", "z"][count..] {
            [one] => format!("{one} is missing"),
            several => format!("{} are missing", several.join(" and ")),
        }),
        3 => point(&numbers.join(",")),
        count => Err(match with_points::<3>(&numbers) {
            Some(points) => format!("write decimal points: {}", points.join(" ")),
            None => format!("these are {count}"),
        }),
    }
}

/// Parses the sides of the triangle of the guides, "AB,BC,CA" in metres.
pub(super) fn sides(text: &str) -> Result<[f64; 3], String> {
    list(text, &numbers::SIDE)
}

/// Parses a point, "X,Y,Z" in metres.
pub(super) fn point(text: &str) -> Result<Point3<f64>, String> {
    list(text, &numbers::COORDINATE).map(Point3::from)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_typed_place_is_read_or_its_mistake_is_named() {
        let place = Ok(Point3::new(0.5, 0.2, 0.15));
        for text in ["0.5 0.2 0.15", "0.5,0.2,0.15", "0.5, 0.2, 0.15", "0.5,0.2 0.15"] {
            assert_eq!(typed_point(text), place, "{text}");
        }
        for (text, why) in [
            ("0,5 0,2 0,15", "write decimal points: 0.5 0.2 0.15"),
            ("0,5, 0,2, 0,15", "write decimal points: 0.5 0.2 0.15"),
            ("0,5,0,2,0,15", "write decimal points: 0.5 0.2 0.15"),
            ("0.5 0.2", "z is missing"),
            ("0.5", "y and z are missing"),
            ("0.5 0.2 0.1 0.3", "these are 4"),
            ("0.5 o.2 0.1", "must be a number, -100 to 100 m"),
        ] {
            assert_eq!(typed_point(text), Err(why.to_owned()), "{text}");
        }
    }

    #[test]
    fn a_place_of_an_option_with_decimal_commas_is_told_what_to_write() {
        assert_eq!(point("0.5,0.2,0.15"), Ok(Point3::new(0.5, 0.2, 0.15)));
        let error = point("0,5,0,2,0,15").unwrap_err();
        assert_eq!(error, "write decimal points: 0.5,0.2,0.15");
        // The other numbers of "0,5 0,2 0,15" are words of their own.
        let error = point("0,5").unwrap_err();
        let end = "; given: 2; write 0.4,0.2,0.15, for example";
        assert!(error.starts_with("needs 3 numbers") && error.ends_with(end), "{error}");
        let error = point("0,7;1,0;1,0").unwrap_err();
        assert_eq!(error, "needs 3 numbers with decimal points, and commas between them");
        // A shell splits "0.5, 0.2, 0.15" at its spaces.
        for error in [point("0.5,"), point("0.5,0.2,")].map(Result::unwrap_err) {
            assert!(error.ends_with("between them, without spaces"), "{error}");
        }
        let error = list::<2>("1,2,3", &numbers::PIXEL).unwrap_err();
        assert!(!error.contains("decimal"), "{error}");
    }
}

//! Values that people write in a way that TOML does not read, and what to write.

use toml::de::DeTable;

use super::brackets::unquoted;
use crate::digit_groups::{with_point, without_groups};
use crate::word_values::{booleans, named_pins};

/// Returns what is wrong with a value that people write, and what to write; `None` where that is
/// not known.
pub(super) fn value_mistake(value: &str) -> Option<String> {
    if let Some(message) = named_pins(value) {
        return Some(message);
    }
    if let Some(message) = typeset(value) {
        return Some(message);
    }
    if let Some(booleans) = booleans(value).filter(|it| it != value) {
        let is_large = booleans == value.to_lowercase();
        let what = if is_large { "in small letters" } else { "true or false" };
        return Some(format!("must be {what}: write {booleans}"));
    }
    let is_word = |c: char| c.is_ascii_alphanumeric() || "_-./".contains(c);
    if value.starts_with(|c: char| c.is_ascii_alphabetic() || c == '/')
        && value.chars().all(is_word)
    {
        return Some(format!("must be in quotation marks: write \"{value}\""));
    }
    if let Some((before, name)) = next_key(value) {
        return Some(format!("must have a comma between {before} and `{name}`"));
    }
    if value.starts_with('[') && value.contains(';') && !value.contains(['"', '\'']) {
        let points = with_decimal_points(value);
        let what = if points == value { "commas" } else { "decimal points, and commas between" };
        return Some(format!("must have {what}: write {}", points.replace(';', ",")));
    }
    if let Some(number) = without_groups(value) {
        return Some(format!("must have nothing between its thousands: write {number}"));
    }
    if is_number_with_more(value) {
        return Some("must be a number alone, without a unit or a fraction".to_owned());
    }
    let items = || value.split([',', '[', ']']).map(str::trim);
    if value.starts_with('[') && !value.contains(['"', '\'']) && items().any(is_number_with_more) {
        return Some("must have numbers alone, without units or fractions".to_owned());
    }
    other_signs(value)
}

/// Returns whether a value is a number with a unit or a divisor behind it: `110 steps/s`, `1/16`.
pub(super) fn is_number_with_more(value: &str) -> bool {
    let digits = value.trim_start_matches(['-', '+']);
    let more = digits.trim_start_matches(|c: char| c.is_ascii_digit());
    let more = more.strip_prefix('.').unwrap_or(more);
    let more = more.trim_start_matches(|c: char| c.is_ascii_digit());
    let has_prefix = ["0x", "0o", "0b"].iter().any(|prefix| digits.starts_with(prefix));
    let is_more = |c: char| c.is_alphabetic() || "/%°".contains(c);
    digits.starts_with(|c: char| c.is_ascii_digit())
        && !has_prefix
        && more.trim_start().starts_with(is_more)
}

/// Quotation marks of a word processor.
const QUOTES: [char; 8] = ['“', '”', '„', '‘', '’', '‚', '«', '»'];

/// Signs of a word processor for a minus: two dashes, and the minus of formulas.
const MINUS_SIGNS: [char; 3] = ['–', '—', '−'];

/// Returns the message about a number or list with the minus signs of a word processor, or a list
/// with its quotation marks; `None` for other values.
fn typeset(value: &str) -> Option<String> {
    let is_list = value.starts_with('[');
    let (what, plain) = if is_list && value.contains(QUOTES) {
        let plain = value.replace(QUOTES, "\"");
        match booleans(&plain) {
            Some(list) => ("be true or false", list),
            None => ("be in plain quotation marks", plain),
        }
    } else if value.contains(MINUS_SIGNS) && !value.contains(['"', '\'']) {
        let minus = value.replace(MINUS_SIGNS, "-");
        let points = if is_list && minus.contains(';') {
            Some(with_decimal_points(&minus).replace(';', ","))
        } else {
            with_point(&minus)
        };
        ("have a plain minus sign", points.unwrap_or(minus))
    } else {
        return None;
    };
    let is_read = DeTable::parse(&format!("x = {plain}")).is_ok();
    is_read.then(|| format!("must {what}: write {plain}"))
}

/// Returns the message about a value in the quotation marks of a word processor, or with the
/// parentheses of a tuple; `None` for other values.
fn other_signs(value: &str) -> Option<String> {
    if value.starts_with(QUOTES) {
        let text = value.trim_matches(QUOTES);
        return Some(match text.parse::<f64>() {
            Ok(_) => format!("must be a number without quotation marks: write {text}"),
            Err(_) => format!("must be in plain quotation marks: write \"{text}\""),
        });
    }
    (value.starts_with(['(', '[']) && value.contains('(') && !value.contains(['"', '\''])).then(
        || {
            let list = value.replace('(', "[").replace(')', "]");
            format!("must be in square brackets: write {list}")
        },
    )
}

/// Returns a list with points in place of the commas between two digits; a list with points is not
/// changed. Semicolons stand between its numbers.
pub(super) fn with_decimal_points(list: &str) -> String {
    let mut points = list.to_owned();
    let is_digit = |byte: Option<&u8>| byte.is_some_and(u8::is_ascii_digit);
    let bytes = list.as_bytes();
    for (place, _) in list.match_indices(',').filter(|_| !list.contains('.')) {
        if is_digit(bytes[..place].last()) && is_digit(bytes.get(place + 1)) {
            points.replace_range(place..=place, ".");
        }
    }
    points
}

/// Returns the value in braces before a key that no comma separates from it, and that key: 0.8 and
/// `mode` of `0.8 mode = "spreadcycle"`.
fn next_key(value: &str) -> Option<(&str, &str)> {
    let (equals, _) = unquoted(value).into_iter().find(|(_, c)| *c == '=')?;
    let (before, name) = value[..equals].trim().rsplit_once(char::is_whitespace)?;
    (!before.contains('{')).then_some((before.trim(), name))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_people_write_is_answered_with_what_to_write() {
        for (value, answer) in [
            ("TMC2209", "must be in quotation marks: write \"TMC2209\""),
            ("/dev/ttyACM0", "must be in quotation marks: write \"/dev/ttyACM0\""),
            ("True", "must be in small letters: write true"),
            ("[0.1; 0.2; 3]", "must have commas: write [0.1, 0.2, 3]"),
            (
                "[[0,6; 0,27; -1]]",
                "must have decimal points, and commas between: write [[0.6, 0.27, -1]]",
            ),
            ("0.8 sense_resistor = 0.15", "must have a comma between 0.8 and `sense_resistor`"),
            ("[True, False, False]", "must be in small letters: write [true, false, false]"),
            ("[True; False; False]", "must be true or false: write [true, false, false]"),
            ("[yes, no, no]", "must be true or false: write [true, false, false]"),
            ("yes", "must be true or false: write true"),
            (
                "[[0,6; 0,3; 0,3]; [0,65; 0,3; 0,3]]",
                "must have decimal points, and commas between: write [[0.6, 0.3, 0.3], [0.65, \
                 0.3, 0.3]]",
            ),
            ("[“A”, „B“]", "must be in plain quotation marks: write [\"A\", \"B\"]"),
            ("[‘A’, ‘B’]", "must be in plain quotation marks: write [\"A\", \"B\"]"),
            ("[“true”, “no”]", "must be true or false: write [true, false]"),
            ("[–1.0, 1.0]", "must have a plain minus sign: write [-1.0, 1.0]"),
            ("[−1,5; 1,0]", "must have a plain minus sign: write [-1.5, 1.0]"),
            ("—0.04", "must have a plain minus sign: write -0.04"),
            ("−0,04", "must have a plain minus sign: write -0.04"),
            ("“110”", "must be a number without quotation marks: write 110"),
            ("1,000.0", "must have nothing between its thousands: write 1000.0"),
            ("1.000,5", "must have nothing between its thousands: write 1000.5"),
            ("-1'000", "must have nothing between its thousands: write -1000"),
            ("1 000 000", "must have nothing between its thousands: write 1000000"),
            ("110 steps/s", "must be a number alone, without a unit or a fraction"),
            ("-0.5m", "must be a number alone, without a unit or a fraction"),
            ("1/16", "must be a number alone, without a unit or a fraction"),
            ("“tmc2209”", "must be in plain quotation marks: write \"tmc2209\""),
            ("(0.6, 0.2)", "must be in square brackets: write [0.6, 0.2]"),
            ("[[0.6, 0.2 m, 0.3]]", "must have numbers alone, without units or fractions"),
            ("[GP10, 11,GPIO12]", "must have the numbers of the pins alone: write [10, 11, 12]"),
            ("GP15", "must have the number of the pin alone: write 15"),
            ("[(1, 2), (3, 4)]", "must be in square brackets: write [[1, 2], [3, 4]]"),
        ] {
            assert_eq!(value_mistake(value).as_deref(), Some(answer), "{value}");
        }
        for value in ["1.2.3", "1..2", "0x", "\"a", "[1, 2", "{ a = 1 }", "é", "-"] {
            assert_eq!(value_mistake(value), None, "{value}");
        }
    }
}

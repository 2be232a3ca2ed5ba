//! Words that people write in the place of truth values and of the numbers of pins, alone and in
//! lists.

/// Returns a value, or a list, with `true` and `false` in place of what people write for them:
/// words, and 1 and 0 in quotation marks or beside words; `None` for other values.
///
/// ```
/// use plumb_config::word_values::booleans;
///
/// assert_eq!(booleans("[Yes; no; 0]").as_deref(), Some("[true, false, false]"));
/// assert_eq!(booleans("[1, 0]"), None);
/// ```
pub fn booleans(value: &str) -> Option<String> {
    let has_word = value.contains(|c: char| c.is_ascii_alphabetic());
    has_word.then(|| with_numbers(value)).flatten()
}

/// Returns the same as [`booleans`], also for numbers alone: a key is known to take truth values.
///
/// ```
/// use plumb_config::word_values::with_numbers;
///
/// assert_eq!(with_numbers("[1, 0]").as_deref(), Some("[true, false]"));
/// ```
pub fn with_numbers(value: &str) -> Option<String> {
    let boolean = |word: &str| match word.trim_matches(['"', '\'']).to_lowercase().as_str() {
        "true" | "yes" | "1" => Some("true".to_owned()),
        "false" | "no" | "0" => Some("false".to_owned()),
        _ => None,
    };
    each_item(value, &[',', ';'], boolean)
}

/// Returns what is wrong with a value that names pins, and what to write; `None` for other values.
pub fn named_pins(value: &str) -> Option<String> {
    let numbers = pin_numbers(value)?;
    let what = if value.starts_with('[') { "numbers of the pins" } else { "number of the pin" };
    Some(format!("must have the {what} alone: write {numbers}"))
}

/// Returns the numbers of pins that a value names, `[10, 11]` of `[GP10, GP11]`; `None` where it
/// names none, and where anything else stands between the names.
fn pin_numbers(value: &str) -> Option<String> {
    let number = |word: &str| {
        let upper = word.to_uppercase();
        let name = upper.strip_prefix("GPIO").or_else(|| upper.strip_prefix("GP"));
        let digits = name.map_or(word, |name| name.trim_start_matches('_'));
        digits.parse::<u8>().ok().map(|number| number.to_string())
    };
    let has_name = value.to_uppercase().contains("GP");
    has_name.then(|| each_item(value, &[','], number)).flatten()
}

/// Returns a value, or a list with its items between `separators`, with `written` in place of each;
/// `None` where one of them is none. A separator may stand behind the last item.
fn each_item(
    value: &str,
    separators: &[char],
    written: impl Fn(&str) -> Option<String>,
) -> Option<String> {
    let Some(list) = value.strip_prefix('[').and_then(|rest| rest.strip_suffix(']')) else {
        return written(value.trim());
    };
    let items = list.trim_end().trim_end_matches(separators).split(separators);
    let items: Option<Vec<String>> = items.map(|item| written(item.trim())).collect();
    items.map(|items| format!("[{}]", items.join(", ")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_truth_values() {
        for (value, expected) in [
            ("True", Some("true")),
            ("no", Some("false")),
            ("[yes, no, NO,]", Some("[true, false, false]")),
            ("['true', \"false\"]", Some("[true, false]")),
            ("[True; 0]", Some("[true, false]")),
            ("1", None),
            ("[1, 0]", None),
            ("[yes, maybe]", None),
            ("", None),
        ] {
            assert_eq!(booleans(value).as_deref(), expected, "{value}");
        }
    }

    #[test]
    fn names_of_pins_have_their_numbers() {
        for (value, numbers) in [
            ("GP15", Some("15")),
            ("gpio_7", Some("7")),
            ("[GP10, GP11 ,gp12, ]", Some("[10, 11, 12]")),
            ("[10, GP11]", Some("[10, 11]")),
            ("[10, 11]", None),
            ("[GP10, A]", None),
            ("GP", None),
            ("GPX", None),
            ("GP300", None),
            ("15", None),
            ("", None),
        ] {
            assert_eq!(pin_numbers(value).as_deref(), numbers, "{value}");
        }
    }
}

//! Truth values in the words that people write.

/// Returns a value, or a list, with `true` and `false` in place of what people write for them:
/// words, and 1 and 0 in quotation marks or beside words; `None` for other values.
///
/// ```
/// use plumb_config::booleans::booleans;
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
/// use plumb_config::booleans::with_numbers;
///
/// assert_eq!(with_numbers("[1, 0]").as_deref(), Some("[true, false]"));
/// ```
pub fn with_numbers(value: &str) -> Option<String> {
    let boolean = |word: &str| match word.trim().trim_matches(['"', '\'']).to_lowercase().as_str() {
        "true" | "yes" | "1" => Some("true"),
        "false" | "no" | "0" => Some("false"),
        _ => None,
    };
    let Some(list) = value.strip_prefix('[').and_then(|rest| rest.strip_suffix(']')) else {
        return boolean(value).map(str::to_owned);
    };
    let items = list.trim_end().trim_end_matches([',', ';']).split([',', ';']);
    let items: Option<Vec<&str>> = items.map(boolean).collect();
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
}

//! Numbers whose digits stand in groups of three.

/// Signs that people put between groups of digits, or before the decimals.
const SIGNS: [char; 5] = ['.', ',', '\'', '’', ' '];

/// Returns a number without the signs between its groups of three digits, and with a decimal point;
/// `None` for a text without such groups.
///
/// ```
/// use plumb_config::digit_groups::without_groups;
///
/// assert_eq!(without_groups("1.000,5").as_deref(), Some("1000.5"));
/// assert_eq!(without_groups("-1 000 000").as_deref(), Some("-1000000"));
/// assert_eq!(without_groups("1000,5"), None);
/// ```
pub fn without_groups(text: &str) -> Option<String> {
    let digits = text.strip_prefix(['-', '+']).unwrap_or(text);
    let minus = if text.starts_with('-') { "-" } else { "" };
    let mut signs: Vec<char> = digits.chars().filter(|c| SIGNS.contains(c)).collect();
    let mut groups: Vec<&str> = digits.split(SIGNS).collect();
    let has_decimals =
        signs.len() > 1 && matches!(signs.last(), Some('.' | ',')) && signs.last() != signs.first();
    let decimals = if has_decimals { signs.pop().and(groups.pop()) } else { None };
    let (first, rest) = groups.split_first()?;
    let are_groups = (1..=3).contains(&first.len()) && rest.iter().all(|group| group.len() == 3);
    let is_one_sign = signs.first().is_some_and(|first| signs.iter().all(|sign| sign == first));
    if !are_groups || !is_one_sign || !groups.iter().chain(&decimals).all(|it| is_digits(it)) {
        return None;
    }
    let point = decimals.map(|decimals| format!(".{decimals}")).unwrap_or_default();
    Some(format!("{minus}{}{point}", groups.concat()))
}

/// Returns whether a text has digits only, and at least one.
///
/// ```
/// use plumb_config::digit_groups::is_digits;
///
/// assert!(is_digits("007"));
/// assert!(!is_digits("") && !is_digits("-7") && !is_digits("7.0"));
/// ```
pub fn is_digits(text: &str) -> bool {
    !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_of_digits_are_joined() {
        for (text, number) in [
            ("1,000.0", "1000.0"),
            ("1.000,25", "1000.25"),
            ("1'000", "1000"),
            ("12’345.6", "12345.6"),
            ("-1.000.000", "-1000000"),
            ("+1 000", "1000"),
        ] {
            assert_eq!(without_groups(text).as_deref(), Some(number), "{text}");
        }
        for text in ["", "1", "1.5", "1,0000", "1000.000.000", "1.000.00", "1,000.000,0", "a,000"] {
            assert_eq!(without_groups(text), None, "{text}");
        }
    }
}

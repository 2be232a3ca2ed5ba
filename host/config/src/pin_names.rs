//! Names of pins in the place of their numbers.

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
        let digits = upper.strip_prefix("GPIO").or_else(|| upper.strip_prefix("GP"))?;
        let number: u8 = digits.trim_start_matches('_').parse().ok()?;
        Some(number.to_string())
    };
    let Some(list) = value.strip_prefix('[').and_then(|rest| rest.strip_suffix(']')) else {
        return number(value);
    };
    let items: Vec<&str> =
        list.trim_end().trim_end_matches(',').split(',').map(str::trim).collect();
    let has_name = items.iter().any(|item| number(item).is_some());
    let whole = |item: &&str| item.parse::<u8>().ok().map(|it| it.to_string());
    let numbers = items.iter().map(|item| number(item).or_else(|| whole(item)));
    let numbers: Option<Vec<String>> = numbers.collect();
    numbers.filter(|_| has_name).map(|numbers| format!("[{}]", numbers.join(", ")))
}

#[cfg(test)]
mod tests {
    use super::*;

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

//! Lists whose commas are the decimal sign too, or lack one.

use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::line_at;
use super::syntax::{SyntaxMistake, without_comment};
use crate::digit_groups::is_digits;

/// Returns the message about a line with a list of numbers whose decimals begin with a zero, which
/// TOML refuses: `[0,05, 0,27, 0,325]`.
pub(super) fn list_with_commas(line: &str) -> Option<String> {
    let value = without_comment(&line[line.find('[')?..]).trim().trim_end_matches([',', ';']);
    let (_, numbers) = innermost_lists(value).into_iter().find(|(_, numbers)| {
        let has_zero = |number: &&str| number.len() > 1 && number.starts_with('0');
        numbers.iter().map(|text| text.trim_start_matches('-')).any(|number| has_zero(&number))
    })?;
    Some(pairs_message(value, &numbers))
}

/// Returns the lists in `value` that have no list in them and whole numbers only: their places with
/// their brackets, bytes, and their numbers.
fn innermost_lists(value: &str) -> Vec<(Range<usize>, Vec<&str>)> {
    let lists = value.match_indices('[').filter_map(|(begin, _)| {
        let list = &value[begin + 1..];
        let list = &list[..list.find([']', '['])?];
        let numbers = list.split(',').map(str::trim).filter(|it| !it.is_empty());
        let numbers: Vec<&str> = numbers.collect();
        let are_whole = numbers.iter().all(|number| is_digits(number.trim_start_matches('-')));
        (are_whole && !numbers.is_empty()).then(|| (begin..begin + list.len() + 2, numbers))
    });
    lists.collect()
}

/// Returns the message about a line with two numbers or lists that have no comma between them:
/// `[0.05 0.27, 0.325]`.
pub(super) fn missing_comma(line: &str) -> Option<String> {
    let line = without_comment(line);
    let list = &line[line.find('[')?..];
    if list.contains(['"', '\'', '{', '=', ';']) {
        return None;
    }
    let words: Vec<&str> = list.split_whitespace().collect();
    let is_end = |word: &str| word.ends_with(|c: char| c.is_ascii_digit() || ".]".contains(c));
    let is_begin =
        |word: &str| word.starts_with(|c: char| c.is_ascii_digit() || "-+.[".contains(c));
    let gap = words.windows(2).find(|pair| is_end(pair[0]) && is_begin(pair[1]))?;
    let (before, behind) = (gap[0].trim_start_matches('['), gap[1].trim_end_matches([',', ']']));
    Some(format!("must have a comma between {before} and {behind}"))
}

/// Least number of whole numbers of a list that are taken for fewer numbers with decimal commas: no
/// key has so many numbers.
const LEAST_NUMBERS: usize = 5;

/// Returns the keys with a list whose commas are the decimal sign too: it has whole numbers only,
/// and too many of them. The crate `toml` ignores the numbers at the end of such a list.
pub(super) fn lists_with_commas(text: &str, table: &DeTable<'_>) -> Vec<SyntaxMistake> {
    let mut found = Vec::new();
    search(text, table, "", &mut found);
    found
}

fn search(text: &str, table: &DeTable<'_>, prefix: &str, found: &mut Vec<SyntaxMistake>) {
    for (name, value) in table {
        let key = format!("{prefix}{}", name.get_ref());
        if let DeValue::Table(table) = value.get_ref() {
            search(text, table, &format!("{key}."), found);
        } else if let Some(numbers) = commas_in(text, value) {
            let line = line_at(text, value.span().start);
            let value = text.get(value.span()).unwrap_or_default().to_owned();
            let message = pairs_message(&value, &numbers);
            found.push(SyntaxMistake { line, key, value, message });
        }
    }
}

/// Returns the numbers of the first list in `value` whose commas are the decimal sign too.
fn commas_in<'a>(text: &'a str, value: &Spanned<DeValue<'_>>) -> Option<Vec<&'a str>> {
    let DeValue::Array(list) = value.get_ref() else { return None };
    let is_whole = |it: &Spanned<DeValue<'_>>| matches!(it.get_ref(), DeValue::Integer(_));
    if list.len() >= LEAST_NUMBERS && list.iter().all(is_whole) {
        return Some(list.iter().filter_map(|it| text.get(it.span())).collect());
    }
    list.iter().find_map(|value| commas_in(text, value))
}

/// Returns the message about `value`, one of whose lists has these `numbers`: the parts before and
/// behind decimal commas.
fn pairs_message(value: &str, numbers: &[&str]) -> String {
    let what = "has commas as the decimal sign and between its numbers: write points";
    if !numbers.len().is_multiple_of(2) {
        return format!("{what}, as in [0.4, 0.5, 0.2]");
    }
    let list = |numbers: &[&str]| {
        let points = numbers.chunks(2).map(|pair| pair.join(".")).collect::<Vec<_>>();
        format!("[{}]", points.join(", "))
    };
    if value.contains('\n') {
        return format!("{what}, {}", list(numbers));
    }
    let mut points = value.to_owned();
    // A place has as many numbers in each list.
    let lists = innermost_lists(value).into_iter().filter(|(_, it)| it.len() == numbers.len());
    for (place, numbers) in lists.rev() {
        points.replace_range(place, &list(&numbers));
    }
    format!("{what}, {points}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_missing_comma_is_found_between_numbers_and_lists_only() {
        for (line, gap) in [
            ("at = [0.85 0.61, 0.665]", "0.85 and 0.61"),
            ("  [0.1, -0.2 -.3],  # 1 2", "-0.2 and -.3"),
            ("min = [[1, 2] [3, 4]]", "2] and [3"),
        ] {
            let message = format!("must have a comma between {gap}");
            assert_eq!(missing_comma(line), Some(message), "{line}");
        }
        for line in ["a = [1, 2]", "a = 1 2", "a = ['1 2']", "[table] # 1 2", "a = [1 , 2 ]"] {
            assert_eq!(missing_comma(line), None, "{line}");
        }
    }
}

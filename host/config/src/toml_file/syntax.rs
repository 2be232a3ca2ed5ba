//! Errors of syntax, and decimal commas, in words: the key, its value, and what to write.

use toml::Spanned;
use toml::de::{DeTable, DeValue, Error};

use super::brackets::unclosed;
use super::{line_at, one_line};
use crate::type_words::in_words;

/// Mistake in the syntax of a file.
pub(super) struct SyntaxMistake {
    /// Number of the line, from 1.
    pub(super) line: usize,
    /// The key with its tables; empty where it is unknown.
    pub(super) key: String,
    /// The value, as in the file; empty where the key is unknown or is there twice.
    pub(super) value: String,
    /// Description.
    pub(super) message: String,
}

impl SyntaxMistake {
    /// Returns the mistake that comes first: a bracket that is not closed, or what `error` of the
    /// crate `toml` means.
    pub(super) fn first(text: &str, error: &Error) -> Self {
        let own = Self::of(text, error);
        unclosed(text).filter(|bracket| bracket.line <= own.line).unwrap_or(own)
    }

    /// Returns the mistake that `error` of the crate `toml` means.
    pub(super) fn of(text: &str, error: &Error) -> Self {
        let span = error.span().unwrap_or_default();
        let line = line_at(text, span.start);
        let written = text.lines().nth(line - 1).unwrap_or_default();
        let plain = |key: String, value: &str, message: String| Self {
            line,
            key,
            value: value.to_owned(),
            message,
        };
        if error.message() == "duplicate key" {
            let name = text.get(span).unwrap_or_default().trim();
            let key = match written.trim_start().starts_with('[') {
                true => name.to_owned(),
                false => key_below(text, line, name),
            };
            return plain(key, "", "is there twice: remove one of the two".to_owned());
        }
        if let Some((name, value, point)) = decimal_comma(written) {
            let message = format!("must have a decimal point: write {point}");
            return plain(key_below(text, line, name), value, message);
        }
        let message = match list_with_commas(written) {
            Some(message) => message,
            None => in_words(&one_line(error.message())),
        };
        plain(String::new(), "", message)
    }
}

/// Returns the key `name` of a line with the table that it is in.
pub(super) fn key_below(text: &str, line: usize, name: &str) -> String {
    let above = text.lines().take(line - 1).map(str::trim);
    let headers = above.filter_map(|line| line.strip_prefix('[')?.split_once(']'));
    match headers.last() {
        Some((table, _)) => format!("{}.{name}", table.trim()),
        None => name.to_owned(),
    }
}

/// Looks for the first number of a line with a decimal comma. Returns its key, the number, and the
/// number with a decimal point.
fn decimal_comma(line: &str) -> Option<(&str, &str, String)> {
    let mut begin = 0;
    for (equals, _) in line.match_indices('=') {
        let name = line[begin..equals].rsplit(['{', ',']).next().unwrap_or_default().trim();
        let value = line[equals + 1..].trim_start();
        let value = value.split(['}', '#', ' ', '\t']).next().unwrap_or_default();
        let value = value.trim_end_matches(',');
        if let Some(point) = with_point(value) {
            return Some((name, value, point));
        }
        begin = equals + 1;
    }
    None
}

/// Returns a number with a decimal comma with a decimal point; `None` for any other text.
fn with_point(text: &str) -> Option<String> {
    let (whole, decimals) = text.split_once(',')?;
    let are_digits = |text: &str| !text.is_empty() && text.bytes().all(|it| it.is_ascii_digit());
    let is_it = are_digits(whole.trim_start_matches(['-', '+'])) && are_digits(decimals);
    is_it.then(|| format!("{whole}.{decimals}"))
}

/// Returns the message about a line with a list of numbers whose decimals begin with a zero, which
/// TOML refuses: `[0,05, 0,27, 0,325]`.
fn list_with_commas(line: &str) -> Option<String> {
    let list = &line[line.rfind('[')? + 1..];
    let list = &list[..list.find(']')?];
    let numbers: Vec<&str> = list.split(',').map(str::trim).filter(|it| !it.is_empty()).collect();
    let digits = |text: &&str| text.trim_start_matches('-').to_owned();
    let is_whole = |text: &&str| {
        let digits = digits(text);
        !digits.is_empty() && digits.bytes().all(|byte| byte.is_ascii_digit())
    };
    let has_zero =
        numbers.iter().any(|text| digits(text).len() > 1 && digits(text).starts_with('0'));
    (has_zero && numbers.iter().all(is_whole)).then(|| pairs_message(&numbers))
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
        } else if let Some(message) = commas_in(text, value) {
            let line = line_at(text, value.span().start);
            let value = text.get(value.span()).unwrap_or_default().to_owned();
            found.push(SyntaxMistake { line, key, value, message });
        }
    }
}

/// Returns the message about the first list in `value` whose commas are the decimal sign too.
fn commas_in(text: &str, value: &Spanned<DeValue<'_>>) -> Option<String> {
    let DeValue::Array(list) = value.get_ref() else { return None };
    let is_whole = |it: &Spanned<DeValue<'_>>| matches!(it.get_ref(), DeValue::Integer(_));
    if list.len() >= LEAST_NUMBERS && list.iter().all(is_whole) {
        let numbers: Vec<&str> = list.iter().filter_map(|it| text.get(it.span())).collect();
        return Some(pairs_message(&numbers));
    }
    list.iter().find_map(|value| commas_in(text, value))
}

/// Returns the message about numbers that are the parts before and behind decimal commas.
fn pairs_message(numbers: &[&str]) -> String {
    let what = "has commas as the decimal sign and between its numbers: write points";
    if !numbers.len().is_multiple_of(2) {
        return format!("{what}, as in [0.4, 0.5, 0.2]");
    }
    let points = numbers.chunks(2).map(|pair| pair.join(".")).collect::<Vec<_>>();
    format!("{what}, [{}]", points.join(", "))
}

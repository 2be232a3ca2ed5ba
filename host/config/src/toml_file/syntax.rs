//! Errors of syntax, and decimal commas, in words: the key, its value, and what to write.

use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue, Error};

use super::brackets::{unclosed, unquoted};
use super::{line_at, one_line};
use crate::booleans::booleans;
use crate::digit_groups::{is_digits, thousands, with_point, without_groups};
use crate::pin_names::named_pins;
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
        if let Some((key, message)) = table_of_a_value(text, written) {
            return plain(key, "", message);
        }
        if let Some(DecimalComma { name, value, advice }) = decimal_comma(written) {
            return plain(key_below(text, line, &name), value, advice);
        }
        let open = open_key(text, line);
        if let Some(message) = list_with_commas(written).or_else(|| missing_comma(written)) {
            let key = assignment(written).map(|(name, _)| key_below(text, line, name));
            return plain(key.or(open).unwrap_or_default(), "", message);
        }
        if let Some((key, message)) = open.zip(part_of_a_list(text, line)) {
            return plain(key, "", message);
        }
        if let Some(table) = header_without_bracket(written) {
            return plain(String::new(), "", format!("a `[` is missing: write [{table}]"));
        }
        let message = in_words(&one_line(error.message()));
        let innermost = wrong_in_braces(written);
        let innermost = innermost.as_ref().map(|(name, value)| (name.as_str(), *value));
        match innermost.or_else(|| assignment(written)) {
            Some((name, value)) => {
                let message =
                    value_mistake(value).unwrap_or_else(|| format!("cannot be read: {message}"));
                plain(key_below(text, line, name), value, message)
            }
            None => plain(String::new(), "", message),
        }
    }
}

/// Returns the table that a line begins, and the message where a line of the text gives that table,
/// or one around it, a value; `None` elsewhere.
fn table_of_a_value(text: &str, line: &str) -> Option<(String, String)> {
    let table = line.trim().strip_prefix('[')?.split_once(']')?.0.trim();
    let mut lines = (1..).zip(text.lines());
    let (number, key) = lines.find_map(|(number, line)| {
        let key = key_below(text, number, assignment(line)?.0);
        let rest = table.strip_prefix(key.as_str())?;
        (rest.is_empty() || rest.starts_with('.')).then_some((number, key))
    })?;
    let message = format!(
        "is there twice: line {number} sets `{key}`. Remove that line, or write these keys into \
         its braces"
    );
    Some((table.to_owned(), message))
}

/// Returns the name of the table in a line `workspace]`; `None` for another line.
fn header_without_bracket(line: &str) -> Option<&str> {
    let table = without_comment(line).trim().strip_suffix(']')?.trim();
    let is_part = |c: char| c.is_ascii_alphanumeric() || "_-.".contains(c);
    (table.starts_with(|c: char| c.is_ascii_alphabetic()) && table.chars().all(is_part))
        .then_some(table)
}

/// Returns the key whose list, begun in a line above, `line` continues or begins.
fn open_key(text: &str, line: usize) -> Option<String> {
    let above: Vec<&str> = text.lines().take(line).collect();
    let begin = above.iter().rposition(|line| assignment(line).is_some())?;
    let count = |line: &&str, bracket| unquoted(line).iter().filter(|it| it.1 == bracket).count();
    let of = |bracket| above[begin..above.len() - 1].iter().map(|it| count(it, bracket)).sum();
    let (open, closed): (usize, usize) = (of('['), of(']'));
    let is_open = open > closed || begin + 1 == line;
    is_open.then(|| key_below(text, begin + 1, assignment(above[begin]).map_or("", |it| it.0)))
}

/// Returns what is wrong in a line of a list of several lines, and what to write for it.
fn part_of_a_list(text: &str, line: usize) -> Option<String> {
    let lines: Vec<&str> =
        text.lines().take(line).map(|line| without_comment(line).trim()).collect();
    let (written, above) = lines.split_last()?;
    let value = assignment(written).map(|(_, value)| value);
    let part = value.unwrap_or(written).trim_end_matches([',', ';', ' ']);
    // The brackets of the whole list stand in other lines.
    let surplus = part.matches('[').count() as isize - part.matches(']').count() as isize;
    let mut list = part;
    for _ in 0..surplus.abs() {
        list = if surplus > 0 { list.strip_prefix('[')? } else { list.strip_suffix(']')? }.trim();
    }
    if value == Some(list) {
        return None;
    }
    if let Some(message) = value_mistake(list).filter(|_| list.starts_with(['[', '('])) {
        return Some(message.replacen(": write ", &format!(": for {list} write "), 1));
    }
    let above = above.iter().rfind(|line| !line.is_empty())?;
    // The error is told behind the semicolon, and in the line below it.
    let lists = [written, above].into_iter().filter(|line| line.starts_with('['));
    if let Some(list) = lists.filter_map(|line| line.strip_suffix(';')).next() {
        return Some(format!("must have commas between lists: for {list}; write {list},"));
    }
    missing_comma(&format!("{above} {written}"))
}

/// Returns the name and the value of a line `name = value`, without its comment; `None` for another
/// line, and where the value is missing.
fn assignment(line: &str) -> Option<(&str, &str)> {
    let (name, value) = line.split_once('=')?;
    let (name, value) = (name.trim(), without_comment(value).trim());
    let is_part = |c: char| c.is_ascii_alphanumeric() || "_-.".contains(c);
    let is_name = !name.is_empty() && name.chars().all(is_part);
    (is_name && !value.is_empty() && !value.starts_with('=')).then_some((name, value))
}

/// Returns the first key of a line, with the inline tables around it, whose value TOML refuses, and
/// that value; `None` for a line without inline tables.
fn wrong_in_braces(line: &str) -> Option<(String, &str)> {
    assignment(line).filter(|(_, value)| value.starts_with('{'))?;
    let values = assignments(line).into_iter().map(|(name, begin)| (name, value_at(line, begin)));
    let mut values = values.filter(|(_, value)| !value.is_empty() && !value.starts_with('{'));
    values.find(|(_, value)| DeTable::parse(&format!("x = {value}")).is_err())
}

/// Returns the value that begins at a byte of a line: it ends at a comma or brace outside its own
/// brackets and strings, or at a comment.
fn value_at(line: &str, begin: usize) -> &str {
    let mut depth = 0;
    for (place, c) in unquoted(line).into_iter().filter(|(place, _)| *place >= begin) {
        match c {
            '[' | '(' | '{' => depth += 1,
            ']' | ')' => depth -= 1,
            '}' if depth > 0 => depth -= 1,
            ',' if depth > 0 => {}
            ',' | '}' | '#' => return line[begin..place].trim(),
            _ => {}
        }
    }
    line[begin..].trim()
}

/// Returns a value without the comment behind it.
fn without_comment(value: &str) -> &str {
    match unquoted(value).last() {
        Some((comment, '#')) => &value[..*comment],
        _ => value,
    }
}

/// Returns what is wrong with a value that people write, and what to write; `None` where that is
/// not known.
fn value_mistake(value: &str) -> Option<String> {
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
fn is_number_with_more(value: &str) -> bool {
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
        ("be in plain quotation marks", value.replace(QUOTES, "\""))
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

/// Returns the key `name` of a line with the table that it is in.
pub(super) fn key_below(text: &str, line: usize, name: &str) -> String {
    let above = text.lines().take(line - 1).map(str::trim);
    let headers = above.filter_map(|line| line.strip_prefix('[')?.split_once(']'));
    // A line of a list is none.
    let is_name = |table: &str| {
        table.trim_start_matches(['[', ' ']).starts_with(|c: char| c.is_ascii_alphabetic())
    };
    let headers = headers.filter(|(table, _)| is_name(table));
    match headers.last() {
        Some((table, _)) => format!("{}.{name}", table.trim()),
        None => name.to_owned(),
    }
}

/// Number with a decimal comma.
struct DecimalComma<'a> {
    /// Its key, with the inline tables around it: `driver.coils.duty`.
    name: String,
    /// The number, with the unit behind it.
    value: &'a str,
    /// What to write.
    advice: String,
}

/// Looks for the first number of a line with a decimal comma.
fn decimal_comma(line: &str) -> Option<DecimalComma<'_>> {
    assignments(line).into_iter().find_map(|(name, begin)| {
        let value = line[begin..].trim_start();
        let value = value.split(['}', '#']).next().unwrap_or_default().trim_end();
        let is_of_number = |c: char| c.is_ascii_digit() || "+-,".contains(c);
        let length = value.find(|c: char| !is_of_number(c)).unwrap_or(value.len());
        let (number, rest) = value.split_at(length);
        let unit = if number.ends_with(',') { "" } else { rest.split(',').next()?.trim_end() };
        let number = number.trim_end_matches(',');
        let advice = decimal_point(number)?;
        if is_unit(unit) {
            let value = &value[..length + unit.len()];
            let advice = "must be a number alone, with a decimal point".to_owned();
            return Some(DecimalComma { name, value, advice });
        }
        (rest.is_empty() || rest.starts_with([' ', '\t']) || value[..length].ends_with(','))
            .then_some(DecimalComma { name, value: number, advice })
    })
}

/// Returns whether the text behind a number is its unit.
fn is_unit(text: &str) -> bool {
    let is_begin = |c: char| c.is_alphabetic() || "/%°".contains(c);
    text.trim_start().starts_with(is_begin) && !text.contains('=')
}

/// Returns what to write for a number with a decimal comma; `None` for any other text. Before three
/// digits the comma may stand between thousands.
fn decimal_point(text: &str) -> Option<String> {
    let point = with_point(text)?;
    match thousands(text) {
        Some(whole) => {
            let shown = point.trim_end_matches('0');
            let shown = if shown.ends_with('.') { format!("{shown}0") } else { shown.to_owned() };
            let what = "must have a decimal point, or nothing between its thousands";
            Some(format!("{what}: write {shown} or {whole}"))
        }
        None => Some(format!("must have a decimal point: write {point}")),
    }
}

/// Returns the keys of a line, with the inline tables around them, and where their values begin,
/// bytes.
fn assignments(line: &str) -> Vec<(String, usize)> {
    let (mut begin, mut tables, mut name, mut found) = (0, Vec::new(), "", Vec::new());
    for (place, c) in unquoted(line).into_iter().filter(|(_, c)| "{},=".contains(*c)) {
        match c {
            '{' => tables.push(name),
            '}' => drop(tables.pop()),
            '=' => {
                name = line[begin..place].trim();
                found.push(([&tables[..], &[name]].concat().join("."), place + 1));
            }
            _ => {}
        }
        begin = place + 1;
    }
    found
}

/// Returns a list with points in place of the commas between two digits; a list with points is not
/// changed. Semicolons stand between its numbers.
fn with_decimal_points(list: &str) -> String {
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

/// Returns the message about a line with a list of numbers whose decimals begin with a zero, which
/// TOML refuses: `[0,05, 0,27, 0,325]`.
fn list_with_commas(line: &str) -> Option<String> {
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
fn missing_comma(line: &str) -> Option<String> {
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

    #[test]
    fn a_decimal_comma_is_found_with_the_tables_around_it() {
        let point = "must have a decimal point";
        let thousands = format!("{point}, or nothing between its thousands: write");
        let alone = "must be a number alone, with a decimal point";
        for (line, name, value, advice) in [
            ("gain = 0,5", "gain", "0,5", format!("{point}: write 0.5")),
            ("a = { b = { c = 1, d = 0,5 } }", "a.b.d", "0,5", format!("{point}: write 0.5")),
            ("a = { b = { c = 1 }, d = 0,5, e = 1 }", "a.d", "0,5", format!("{point}: write 0.5")),
            ("a = 0,5 # m", "a", "0,5", format!("{point}: write 0.5")),
            ("a = { b = 0,5 c = 1 }", "a.b", "0,5", format!("{point}: write 0.5")),
            ("a = 1,100", "a", "1,100", format!("{thousands} 1.1 or 1100")),
            ("a = -1,000", "a", "-1,000", format!("{thousands} -1.0 or -1000")),
            ("a = 0,100", "a", "0,100", format!("{point}: write 0.100")),
            ("a = 0,4 cm", "a", "0,4 cm", alone.to_owned()),
            ("a = { b = 2,5cm, c = 1 }", "a.b", "2,5cm", alone.to_owned()),
            ("a = 2,5 mm/s # 1", "a", "2,5 mm/s", alone.to_owned()),
        ] {
            let found = decimal_comma(line).unwrap();
            let found = (found.name.as_str(), found.value, found.advice);
            assert_eq!(found, (name, value, advice), "{line}");
        }
        for line in ["a = { b = 1 }", "a = 1,000,000", "a = 0,5.1", "a = [0,5]", "a = \"0,5\""] {
            assert!(decimal_comma(line).is_none(), "{line}");
        }
    }

    #[test]
    fn a_list_of_several_lines_is_answered_with_its_key() {
        let points =
            "must have decimal points, and commas between: for [0,6; 0,3] write [0.6, 0.3]";
        let semicolon = "must have commas between lists: for [1, 2]; write [1, 2],";
        let commas = "must have commas: for [0.6; 0.3] write [0.6, 0.3]";
        for (list, line, says) in [
            ("[\n  [0,6; 0,3],\n  [0,5; 0,3],\n]", 3, points),
            ("[\n  [1, 2],\n  [0,6; 0,3]]", 4, points),
            ("[[0.6; 0.3],\n  [1, 2]]", 2, commas),
            ("[\n  [0.6; 0.3];\n  [1, 2]\n]", 3, commas),
            ("[\n  [1, 2];\n  [3, 4]\n]", 3, semicolon),
            ("[\n  (1, 2),\n  [3, 4]\n]", 3, "must be in square brackets: for (1, 2) write [1, 2]"),
            ("[\n  [1, 2] # a\n\n  [3, 4]\n]", 5, "must have a comma between 2] and [3"),
        ] {
            let text = format!("[t]\na = {list}\n");
            let (_, errors) = DeTable::parse_recoverable(&text);
            let found = SyntaxMistake::of(&text, &errors[0]);
            let found = (found.line, found.key.as_str(), found.message.as_str());
            assert_eq!(found, (line, "t.a", says), "{text}");
        }
        let text = "[a]\nb = [\n  [1, 2],\n]\nworkspace] # c\n";
        let (_, errors) = DeTable::parse_recoverable(text);
        let message = SyntaxMistake::of(text, &errors[0]).message;
        assert_eq!(message, "a `[` is missing: write [workspace]");
    }

    #[test]
    fn a_wrong_value_is_found_with_the_tables_around_it() {
        for (line, found) in [
            ("a = { b = { c = 1, d = 0.8A } }", Some(("a.b.d", "0.8A"))),
            ("a = { b = { c = R110, d = 0.8A } }  # 1", Some(("a.b.c", "R110"))),
            ("a = { b = [0, 1], c = [GP1, GP2], d = 1 }", Some(("a.c", "[GP1, GP2]"))),
            ("a = { b = '1, } 2', c = 0.8 A }", Some(("a.c", "0.8 A"))),
            ("a = { b = true, c = [{ d = 1 }] }", None),
            ("a = 0.8A", None),
        ] {
            let wrong = wrong_in_braces(line);
            let wrong = wrong.as_ref().map(|(name, value)| (name.as_str(), *value));
            assert_eq!(wrong, found, "{line}");
        }
    }

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

    #[test]
    fn a_line_is_a_name_and_a_value_without_its_comment() {
        assert_eq!(assignment(" a.b = 'x # y' # z"), Some(("a.b", "'x # y'")));
        assert_eq!(assignment(r#"a = "x\" # y" # z"#), Some(("a", r#""x\" # y""#)));
        for line in ["a 1", "a =", "a = # b", "a = = 2", "[a]", "a b = 2"] {
            assert_eq!(assignment(line), None, "{line}");
        }
    }
}

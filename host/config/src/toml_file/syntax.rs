//! Errors of syntax, and decimal commas, in words: the key, its value, and what to write.

use toml::de::{DeTable, Error};

use super::brackets::{is_name, unclosed, unquoted};
use super::lists::{list_with_commas, missing_comma};
use super::values::value_mistake;
use super::{line_at, one_line};
use crate::digit_groups::{thousands, with_point};
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
    is_name(table).then_some(table)
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
pub(super) fn without_comment(value: &str) -> &str {
    match unquoted(value).last() {
        Some((comment, '#')) => &value[..*comment],
        _ => value,
    }
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

#[cfg(test)]
mod tests {
    use super::*;

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
    fn a_line_is_a_name_and_a_value_without_its_comment() {
        assert_eq!(assignment(" a.b = 'x # y' # z"), Some(("a.b", "'x # y'")));
        assert_eq!(assignment(r#"a = "x\" # y" # z"#), Some(("a", r#""x\" # y""#)));
        for line in ["a 1", "a =", "a = # b", "a = = 2", "[a]", "a b = 2"] {
            assert_eq!(assignment(line), None, "{line}");
        }
    }
}

//! Brackets that are not closed. The crate `toml` reports the values behind such a bracket, which
//! are right, and not the bracket.

use super::syntax::{SyntaxMistake, key_below};

/// Returns the first bracket that is still open where another key or table begins, or at the end of
/// the text. `None` where every bracket is closed, and for a text with strings of several lines.
pub(super) fn unclosed(text: &str) -> Option<SyntaxMistake> {
    if text.contains("\"\"\"") || text.contains("'''") {
        return None;
    }
    let mut open: Vec<(char, usize)> = Vec::new();
    for (number, line) in (1..).zip(text.lines()) {
        if !open.is_empty() && begins_anew(line.trim()) {
            break;
        }
        for bracket in brackets(line) {
            match bracket {
                '[' | '{' => open.push((bracket, number)),
                _ => drop(open.pop()),
            }
        }
    }
    let (bracket, line) = *open.first()?;
    let lacking = if bracket == '[' { ']' } else { '}' };
    let written = text.lines().nth(line - 1).unwrap_or_default();
    let name = written.split('=').next().unwrap_or_default().trim();
    let is_table = name.starts_with('[');
    Some(SyntaxMistake {
        line,
        key: if is_table { name.to_owned() } else { key_below(text, line, name) },
        value: String::new(),
        message: format!("is not closed: a `{lacking}` is missing"),
    })
}

/// Returns whether a line (without spaces at its ends) is a key with its value, or the name of a
/// table: neither may stand in brackets.
fn begins_anew(line: &str) -> bool {
    let is_value = |text: &str| ["true", "false", "inf", "nan"].contains(&text);
    let table = line.strip_prefix('[').and_then(|line| line.split_once(']'));
    let key = line.split_once('=').is_some_and(|(name, _)| is_name(name.trim()));
    key || table.is_some_and(|(name, _)| is_name(name) && !is_value(name))
}

/// Returns whether a text is the name of a key or a table, perhaps with the tables around it.
pub(super) fn is_name(text: &str) -> bool {
    let is_part = |c: char| c.is_ascii_alphanumeric() || "_-.".contains(c);
    text.starts_with(|c: char| c.is_ascii_alphabetic()) && text.chars().all(is_part)
}

/// Returns the brackets of a line outside its strings and its comment.
fn brackets(line: &str) -> impl Iterator<Item = char> {
    unquoted(line).into_iter().map(|(_, c)| c).filter(|c| "[]{}".contains(*c))
}

/// Returns the characters of a line outside its strings, with their places in bytes, up to the `#`
/// of its comment. Quotation marks are left out.
pub(super) fn unquoted(line: &str) -> Vec<(usize, char)> {
    let (mut found, mut quote, mut is_escaped) = (Vec::new(), None, false);
    for (place, c) in line.char_indices() {
        match quote {
            Some(_) if is_escaped => is_escaped = false,
            Some('"') if c == '\\' => is_escaped = true,
            Some(end) if c == end => quote = None,
            Some(_) => {}
            None if c == '"' || c == '\'' => quote = Some(c),
            None => {
                found.push((place, c));
                if c == '#' {
                    break;
                }
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_open_bracket_is_named_with_its_key_and_line() {
        for (text, line, key, lacking) in [
            ("a = 1\nb = [[1, 2]\n[c]\nd = 2\n", 2, "b", ']'),
            ("[t]\nb = [1,\n  2,\nc = 3\n", 2, "t.b", ']'),
            ("[t]\nb = { x = 1\nc = 3\n", 2, "t.b", '}'),
            ("b = [ \"]\", ']', # ]\n", 1, "b", ']'),
        ] {
            let found = unclosed(text).unwrap();
            assert_eq!((found.line, found.key.as_str()), (line, key), "{text}");
            assert!(found.message.contains(lacking), "{text}: {}", found.message);
        }
    }

    #[test]
    fn closed_brackets_are_none() {
        for text in [
            "b = [\n  [1, 2], # [\n  [true]\n]\nc = \"[\\\"[\"\n[t]\n",
            "[[list]]\na = { x = [1], y = '{' }\n[t.u]\n",
            "b = \"\"\"\n[\n\"\"\"\n",
            "",
        ] {
            assert!(unclosed(text).is_none(), "{text}");
        }
    }
}

//! Tables of numbers in text, as spreadsheets and robots write them.
//!
//! Columns are separated by `;`, tabs, `,` or blanks: by the first of them that the first line has.
//! Between all but commas a number may have a decimal comma. A byte-order mark, empty lines, empty
//! columns at the end, brackets round a line, and lines that begin with `#` are left out; but the
//! last of these before the first numbers may have the names of the columns, as `numpy.savetxt`
//! writes them. A first line `sep=;` of a spreadsheet names the separator. The crate `csv` would
//! count the lines without them, so that a message would name a wrong one.

/// Separators, in the order in which they are looked for.
const SEPARATORS: [char; 3] = [';', '\t', ','];

/// Units that a name of a column may have behind it: "x [m]", "t (s)", "y_m".
const UNITS: [&str; 8] = ["m", "meter", "meters", "metre", "metres", "s", "sec", "seconds"];

/// Names of the column t.
const TIME_NAMES: [&str; 3] = ["t", "time", "timestamp"];

/// Lines of a table.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Table {
    separator: char,
    /// Names of the columns; `None` where the table begins with numbers.
    pub(crate) names: Option<Row>,
    /// Lines with numbers.
    pub(crate) rows: Vec<Row>,
}

/// Line of a table.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Row {
    /// Number of the line in the text, from 1.
    pub(crate) line: usize,
    /// Fields, without spaces and quotes around them, and without the empty ones at the end.
    pub(crate) fields: Vec<String>,
}

impl Row {
    fn new(line: usize, text: &str, separator: char) -> Self {
        let mut fields: Vec<String> = match separator {
            ' ' => text.split_whitespace().map(|field| bare(field).to_owned()).collect(),
            _ => text.split(separator).map(|field| bare(field).to_owned()).collect(),
        };
        fields.truncate(fields.iter().rposition(|field| !field.is_empty()).map_or(0, |it| it + 1));
        Self { line, fields }
    }

    /// Returns whether the line has names: its first field that is not empty begins with a letter,
    /// and is no number, such as "nan".
    fn has_names(&self) -> bool {
        let first = self.fields.iter().find(|field| !field.is_empty());
        first.is_some_and(|it| it.starts_with(char::is_alphabetic) && it.parse::<f64>().is_err())
    }
}

/// Returns the lines of a text, without spaces around them. In a text without line feeds each
/// carriage return ends a line, as on old Macs.
pub(crate) fn lines(text: &str) -> impl Iterator<Item = &str> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    text.split(if text.contains('\n') { '\n' } else { '\r' }).map(str::trim)
}

impl Table {
    /// Returns the lines of `text` that are neither empty nor a comment. A comment has the names
    /// where it has as many of the `known` ones as the first line has numbers, and nothing else.
    pub(crate) fn of(text: &str, known: &[&str]) -> Self {
        let lines = (1..).zip(lines(text)).filter(|(_, line)| !is_empty(line));
        let (comments, lines): (Vec<_>, Vec<_>) = lines.partition(|(_, it)| it.starts_with('#'));
        let mut lines = lines.into_iter().map(|(line, text)| (line, unbracketed(text))).peekable();
        let named = lines.peek().and_then(|(_, line)| named_separator(line));
        if named.is_some() {
            lines.next();
        }
        let first = lines.peek().map_or("", |(_, line)| line);
        let found = SEPARATORS.into_iter().find(|&separator| first.contains(separator));
        let separator = named.or(found).unwrap_or(' ');
        let mut rows: Vec<Row> =
            lines.map(|(line, text)| Row::new(line, text, separator)).collect();
        let mut names = None;
        if rows.first().is_some_and(Row::has_names) {
            names = Some(rows.remove(0));
        } else if let Some(first) = rows.first() {
            let above = comments.into_iter().take_while(|(line, _)| *line < first.line).last();
            let split = |separator| {
                let (line, text) = above?;
                let row = Row::new(line, text.trim_start_matches('#').trim(), separator);
                let is_known = |name: &String| known.contains(&base(&name.to_lowercase()));
                let is_whole = row.fields.len() == first.fields.len();
                (is_whole && row.fields.iter().all(is_known)).then_some(row)
            };
            names = split(separator).or_else(|| split(' '));
        }
        Self { separator, names, rows }
    }

    /// Returns the finite number in a field; `None` where it has none.
    pub(crate) fn number(&self, field: &str) -> Option<f64> {
        let has_point = self.separator == ',' || field.contains('.');
        let number = if has_point { field.parse() } else { field.replacen(',', ".", 1).parse() };
        number.ok().filter(|number: &f64| number.is_finite())
    }
}

/// Returns the name of a column in lower case, without its unit where that is one of [`UNITS`].
pub(crate) fn column_name(field: &str) -> String {
    let name = field.to_lowercase();
    let has_plain_unit = with_unit(&name).is_none_or(|(_, unit)| UNITS.contains(&unit));
    if has_plain_unit { base(&name).to_owned() } else { name }
}

/// Returns the name of a column without its unit: t for "timestamp".
fn base(name: &str) -> &str {
    let base = with_unit(name).map_or(name, |(base, _)| base);
    if TIME_NAMES.contains(&base) { "t" } else { base }
}

/// Returns the name and the unit of a column with a unit in brackets, or behind "in", `/`, `_` or a
/// space.
fn with_unit(name: &str) -> Option<(&str, &str)> {
    let in_brackets = [('[', ']'), ('(', ')')].iter().find_map(|&(open, close)| {
        let (name, unit) = name.strip_suffix(close)?.split_once(open)?;
        Some((name.trim_end_matches('_').trim(), unit.trim()))
    });
    in_brackets
        .or_else(|| name.split_once(" in "))
        .or_else(|| name.split_once('/').map(|(name, unit)| (name.trim(), unit.trim())))
        .or_else(|| name.rsplit_once(['_', ' ']))
}

/// Returns whether a line has no value, as an empty row of a spreadsheet, which has separators.
fn is_empty(line: &str) -> bool {
    line.chars().all(|c| c.is_whitespace() || c == '"' || SEPARATORS.contains(&c))
}

/// Returns a line without the brackets around it, as programs print lists: "[0.6, 0.25, 0.3],".
fn unbracketed(line: &str) -> &str {
    let is_bracket = |c: char| "[](){}".contains(c);
    match line.starts_with(is_bracket) {
        true => line.trim_matches(|c| is_bracket(c) || c == ',' || c == ' '),
        false => line,
    }
}

/// Returns the separator that a line `sep=;` names, which spreadsheets write first; `None` for any
/// other line.
fn named_separator(line: &str) -> Option<char> {
    let line = bare(line);
    let named = line.get(..4).filter(|start| start.eq_ignore_ascii_case("sep="))?;
    let mut rest = line[named.len()..].chars();
    // A tab at the end of the line is trimmed.
    let separator = rest.next().unwrap_or('\t');
    rest.all(|more| more == separator).then_some(separator)
}

/// Returns a field without spaces and quotes around it.
fn bare(field: &str) -> &str {
    let field = field.trim();
    field.strip_prefix('"').and_then(|rest| rest.strip_suffix('"')).unwrap_or(field).trim()
}

#[cfg(test)]
mod tests;

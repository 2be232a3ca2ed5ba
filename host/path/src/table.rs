//! Tables of numbers in text, as spreadsheets and robots write them.
//!
//! Fields are separated by `;`, tabs or `,`: by the first of them that the first line has. Between
//! `;` and tabs a number may have a decimal comma. A byte-order mark, empty lines and lines that
//! begin with `#` are left out; but the last of these before the first numbers may have the names
//! of the columns, as `numpy.savetxt` writes them. A first line `sep=;` of a spreadsheet names the
//! separator. The crate `csv` would count the lines without them, so that a message would name a
//! wrong one. Empty columns at the end are left out too.

/// What to do about a table with decimal commas between commas, for messages.
const DECIMAL_COMMAS: &str = "commas are the decimal sign and separate the columns too: write \
                                  points (0.4,0.5,0.2), or separate the columns by semicolons \
                                  (0,4;0,5;0,2)";

/// What to do about a first column without a name, for messages.
const INDEX: &str = "column 1 has no name (pandas writes its index there: to_csv(…, index=False))";

/// Units that a name of a column may have behind it: "x [m]", "t (s)", "y_m".
const UNITS: [&str; 8] = ["m", "meter", "meters", "metre", "metres", "s", "sec", "seconds"];

/// Other units that are known without brackets too: "x_mm".
const OTHER_UNITS: [&str; 9] =
    ["cm", "mm", "millimeters", "millimetres", "in", "ms", "us", "ns", "min"];

/// Names of the coordinates.
const AXES: [&str; 3] = ["x", "y", "z"];

/// Names of the columns of all tables, for a line whose columns stand between spaces.
const NAMES: [&str; 6] = ["t", "x", "y", "z", "dwell", "tolerance"];

/// Names that people give the column t.
const TIME_NAMES: [&str; 3] = ["t", "time", "timestamp"];

/// Largest number of columns, or of their mistakes, that a message lists.
const MAX_SHOWN: usize = 4;

/// Separators, in the order in which they are looked for.
const SEPARATORS: [char; 3] = [';', '\t', ','];

/// Lines of a table.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Table {
    separator: char,
    rows: Vec<Row>,
    /// Names of the columns in the last comment before the first line, if it has them.
    commented: Option<Row>,
    /// Names in that comment, if spaces separate them.
    spaced_names: Option<String>,
}

/// Line of a table.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Row {
    /// Number of the line in the text, from 1.
    pub line: u64,
    /// Fields, without spaces and quotes around them.
    pub fields: Vec<String>,
    /// Text of the line, without spaces around it.
    pub text: String,
}

impl Row {
    /// Returns whether the line has names: its first field that is not empty begins with a letter.
    fn has_names(&self) -> bool {
        let first = self.fields.iter().find(|field| !field.is_empty());
        first.is_some_and(|it| it.starts_with(char::is_alphabetic) && !is_number(it))
    }

    /// Returns whether all fields are known names of columns, x, y and z among them.
    fn names_places(&self) -> bool {
        let names: Vec<String> = self.fields.iter().map(|field| field.to_lowercase()).collect();
        let bases: Vec<&str> = names.iter().map(|name| meant(base(name))).collect();
        bases.iter().all(|name| NAMES.contains(name))
            && AXES.iter().all(|name| bases.contains(name))
    }

    /// Returns the names of columns that stand between spaces, with commas between them; `None`
    /// where the line has anything else.
    fn spaced_names(&self) -> Option<String> {
        let fields = self.text.split_whitespace().map(str::to_owned).collect();
        let names = Self { line: self.line, fields, text: String::new() };
        names.names_places().then(|| names.fields.join(","))
    }

    /// Returns the number of fields without the empty ones at the end.
    fn filled(&self) -> usize {
        self.fields.iter().rposition(|field| !field.is_empty()).map_or(0, |last| last + 1)
    }

    /// Returns the number of columns of a table with this first line: those without the empty ones
    /// at the end, but three or more for numbers.
    fn columns(&self) -> usize {
        if self.has_names() { self.filled() } else { self.filled().max(AXES.len()) }
    }

    /// Returns a comment as the names of the columns of the numbers below it: one for each, perhaps
    /// not for empty columns at the end. `None` where it has others.
    fn names_above(mut self, first: &Self) -> Option<Self> {
        self.fields.truncate(self.filled());
        let has_as_many = (first.filled()..=first.fields.len()).contains(&self.fields.len());
        (!first.has_names() && has_as_many && self.names_places()).then_some(self)
    }

    /// Returns the text of the line, without the last columns where there are many.
    pub fn in_short(&self) -> String {
        match self.fields.len() <= NAMES.len() {
            true => self.text.clone(),
            false => shortened(self.fields.clone(), ","),
        }
    }

    /// Returns what to write in place of a line in brackets, as programs print lists of numbers:
    /// "[0.6, 0.25, 0.3],". `None` for any other line.
    pub fn bracket_mistake(&self) -> Option<String> {
        let is_bracket = |c: char| "[](){}".contains(c);
        let line = self.text.trim_matches(|c| is_bracket(c) || c == ',').trim();
        if !self.text.starts_with(is_bracket) || line.contains(is_bracket) {
            return None;
        }
        let words = || line.split_whitespace().collect::<Vec<_>>().join(",");
        let line = if line.contains(SEPARATORS) { line.to_owned() } else { words() };
        Some(format!("brackets do not belong to a table: write {line}"))
    }
}

/// Returns whether a line has no value, as an empty row of a spreadsheet, which has separators.
fn is_empty(line: &str) -> bool {
    line.chars().all(|c| c.is_whitespace() || c == '"' || SEPARATORS.contains(&c))
}

/// Returns the lines of a text, without spaces around them. In a text without line feeds each
/// carriage return ends a line, as on old Macs.
pub(crate) fn lines(text: &str) -> impl Iterator<Item = &str> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    text.split(if text.contains('\n') { '\n' } else { '\r' }).map(str::trim)
}

impl Table {
    /// Returns the lines of `text` that are neither empty nor a comment.
    pub fn of(text: &str) -> Self {
        let lines = (1..).zip(lines(text)).filter(|(_, line)| !is_empty(line));
        let (comments, mut lines): (Vec<(u64, &str)>, Vec<_>) =
            lines.partition(|(_, line)| line.starts_with('#'));
        let named = lines.first().and_then(|(_, line)| named_separator(line));
        if named.is_some() {
            lines.remove(0);
        }
        let first = lines.first().map_or("", |(_, line)| line);
        let found = || SEPARATORS.into_iter().find(|&separator| first.contains(separator));
        let separator = named.or_else(found).unwrap_or(',');
        let row = |line, text: &str| Row {
            line,
            fields: text.split(separator).map(|field| bare(field).to_owned()).collect(),
            text: text.to_owned(),
        };
        let mut rows: Vec<Row> = lines.into_iter().map(|(line, text)| row(line, text)).collect();
        let is_above = |line: &u64| rows.first().is_some_and(|first| *line < first.line);
        let comment = comments.into_iter().take_while(|(line, _)| is_above(line)).last();
        let comment = comment.map(|(line, text)| row(line, text.trim_start_matches('#').trim()));
        let spaced_names = comment.as_ref().and_then(Row::spaced_names);
        let commented = comment.and_then(|comment| comment.names_above(rows.first()?));
        let columns = commented.as_ref().or(rows.first()).map_or(0, Row::columns);
        for row in &mut rows {
            let kept = row.filled().max(columns);
            row.fields.truncate(kept);
        }
        Self { separator, rows, commented, spaced_names }
    }

    /// Takes the first line where it has the names of the columns, or else the comment above it
    /// that has them.
    pub fn take_names(&mut self) -> Option<Row> {
        let is_named = self.rows.first()?.has_names();
        if is_named { Some(self.rows.remove(0)) } else { self.commented.take() }
    }

    /// Returns what is wrong with the brackets or the separators of a line, and what to do, where
    /// it has not so many columns as are needed; `None` where it is neither.
    pub fn separator_mistake(&self, row: &Row, columns: usize) -> Option<String> {
        if let Some(mistake) = row.bracket_mistake() {
            return Some(mistake);
        }
        if self.has_decimal_commas(row, columns) {
            return Some(DECIMAL_COMMAS.to_owned());
        }
        let others = SEPARATORS.into_iter().filter(|it| *it != self.separator);
        let mut others = others.filter(|it| row.text.split(*it).count() == columns);
        let are_numbers =
            |it: &char| row.text.split(*it).all(|field| number_in(*it, bare(field)).is_some());
        match others.find(are_numbers) {
            Some(other) => {
                let (other, first) = (separator_name(other), separator_name(self.separator));
                Some(format!(
                    "the line separates its columns by {other}, but the first line by {first}: \
                     separate all by {other}"
                ))
            }
            None => self.spaces_mistake(row),
        }
    }

    /// Returns what to write in place of a line whose columns, names or numbers, stand between
    /// spaces; `None` for any other line.
    pub fn spaces_mistake(&self, row: &Row) -> Option<String> {
        let words: Vec<&str> = row.text.split_whitespace().collect();
        let is_name = |word: &&str| {
            let name = bare(word).to_lowercase();
            NAMES.contains(&base(&name))
        };
        let is_number = |word: &&str| number_in(' ', bare(word)).is_some();
        if words.len() < 2 || !(words.iter().all(is_name) || words.iter().all(is_number)) {
            return None;
        }
        if let Some(names) = &self.spaced_names {
            return Some(format!(
                "spaces do not separate columns: write commas, between the names too; in numpy: \
                 savetxt(…, delimiter=\",\", header=\"{names}\")"
            ));
        }
        let separator = if row.text.contains(',') { ';' } else { self.separator };
        let line = words.join(&separator.to_string());
        Some(format!("spaces do not separate columns: write {line}"))
    }

    /// Returns whether the commas of a line are the decimal sign too: between commas it has whole
    /// numbers only, and too many of them for so many columns.
    fn has_decimal_commas(&self, row: &Row, columns: usize) -> bool {
        let is_whole = |field: &String| {
            let digits = field.trim_matches('"').trim_start_matches('-');
            !digits.is_empty() && digits.bytes().all(|byte| byte.is_ascii_digit())
        };
        let is_too_long = (columns + 1..=2 * columns).contains(&row.fields.len());
        self.separator == ',' && is_too_long && row.fields.iter().all(is_whole)
    }

    /// Returns the lines.
    pub fn rows(&self) -> &[Row] {
        &self.rows
    }

    /// Returns whether the comment above the numbers has names between spaces, the time among them.
    pub fn has_spaced_time(&self) -> bool {
        self.spaced_names.as_ref().is_some_and(|names| names.split(',').any(is_time))
    }

    /// Returns the number of columns of the first line; 0 without a line.
    pub fn columns(&self) -> usize {
        self.rows.first().map_or(0, |row| row.fields.len())
    }

    /// Returns the finite number in a field; `None` where it has none.
    pub fn number(&self, field: &str) -> Option<f64> {
        number_in(self.separator, field).filter(|number| number.is_finite())
    }
}

/// Returns the number in a field between these separators; `None` where it has none.
fn number_in(separator: char, field: &str) -> Option<f64> {
    if separator == ',' || field.contains('.') {
        return field.parse().ok();
    }
    field.replacen(',', ".", 1).parse().ok()
}

/// Returns the name of a separator, for messages.
fn separator_name(separator: char) -> &'static str {
    match separator {
        ';' => "semicolons",
        '\t' => "tabs",
        _ => "commas",
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

/// Returns the place in `known` of each column that a line of names has, in any order; `None` where
/// it has others, one twice, or not the first `needed` of them. [`wrong_names`] says why.
pub fn places_of(found: &[String], known: &[&str], needed: usize) -> Option<Vec<usize>> {
    let place = |name: &String| known.iter().position(|column| *column == column_name(name));
    let places: Vec<usize> = found.iter().map(place).collect::<Option<_>>()?;
    let times = |column: usize| places.iter().filter(|place| **place == column).count();
    let is_complete = (0..needed).all(|column| times(column) == 1);
    let is_once = (needed..known.len()).all(|column| times(column) <= 1);
    (is_complete && is_once).then_some(places)
}

/// Returns the mistakes in names of columns: "'w' is unknown, z is missing". A table may have the
/// columns `known`, and must have the first `needed` of them. Empty where there is none.
pub fn wrong_names(found: &[String], known: &[&str], needed: usize) -> String {
    let names: Vec<String> = found.iter().map(|name| column_name(name)).collect();
    let times = |name: &str| names.iter().filter(|it| *it == name).count();
    let is_there = |name: &str| names.iter().any(|it| proposed(it, &names, known) == Some(name));
    let missing = known.iter().take(needed).filter(|name| !is_there(name));
    let missing: Vec<String> = missing.map(|name| format!("{name} is missing")).collect();
    let unknown = (1..).zip(found.iter().zip(&names));
    let unknown = unknown.filter(|(_, (_, name))| !known.contains(&name.as_str()));
    let unknown = unknown.map(|(column, (written, name))| {
        let has_other_unit =
            with_unit(name).is_some_and(|(_, unit)| !unit.is_empty() && !UNITS.contains(&unit));
        match (proposed(name, &names, known), base(name)) {
            _ if name.is_empty() && column == 1 => INDEX.to_owned(),
            _ if name.is_empty() => format!("column {column} has no name"),
            (Some(known), _) if has_other_unit => {
                let unit = if known == "t" || known == "dwell" { "seconds" } else { "metres" };
                format!("'{written}' must be in {unit}: convert it, and write {known}")
            }
            (Some(known), _) => format!("'{written}' is unknown: write {known}"),
            (None, "dwell" | "tolerance") => {
                format!("'{written}' is for waypoints (`--waypoints`), not for a path")
            }
            _ if missing.is_empty() && !is_time(name) => {
                format!("'{written}' is unknown: remove the column")
            }
            _ => format!("'{written}' is unknown"),
        }
    });
    let twice = known.iter().filter(|name| times(name) > 1);
    let twice = twice.map(|name| format!("{name} is there {} times", times(name)));
    shortened(unknown.chain(missing.iter().cloned()).chain(twice).collect(), ", ")
}

/// Returns the column of `known` that a person means by one of `names`: t by "timestamp", x by
/// "x-position" where no other name begins with x.
fn proposed<'a>(name: &str, names: &[String], known: &[&'a str]) -> Option<&'a str> {
    let column = meant(base(name));
    let is_alone = |axis: &str| names.iter().filter(|name| name.starts_with(axis)).count() == 1;
    let is_axis = |axis: &str| AXES.contains(&axis) && column.starts_with(axis) && is_alone(axis);
    let known = || known.iter().copied();
    known().find(|it| *it == column).or_else(|| known().find(|it| is_axis(it)))
}

/// Returns `words` with `separator` between them, without those above [`MAX_SHOWN`].
fn shortened(mut words: Vec<String>, separator: &str) -> String {
    let more = words.len().saturating_sub(MAX_SHOWN);
    words.truncate(MAX_SHOWN);
    match more {
        0 => words.join(separator),
        _ => format!("{}, and {more} more", words.join(separator)),
    }
}

/// Returns whether the name of a column, perhaps with a unit, is one that people give the time.
pub fn is_time(name: &str) -> bool {
    TIME_NAMES.contains(&base(&name.to_lowercase()))
}

/// Returns the name of a column without its unit.
fn base(name: &str) -> &str {
    with_unit(name).map_or(name, |(base, _)| base)
}

/// Returns the column that a person means by a name without unit: t by "timestamp".
fn meant(base: &str) -> &str {
    if TIME_NAMES.contains(&base) { "t" } else { base }
}

/// Returns the name of a column in lower case, without its unit where that is one of [`UNITS`].
fn column_name(field: &str) -> String {
    let name = field.to_lowercase();
    match with_unit(&name) {
        Some((base, unit)) if UNITS.contains(&unit) => base.to_owned(),
        _ => name,
    }
}

/// Returns the name and the unit of a column with a unit in brackets, behind "in" or `/`, or behind
/// `_` or a space.
fn with_unit(name: &str) -> Option<(&str, &str)> {
    let in_brackets = [('[', ']'), ('(', ')')].iter().find_map(|&(open, close)| {
        let (name, unit) = name.strip_suffix(close)?.split_once(open)?;
        Some((name.trim_end_matches('_').trim(), unit.trim()))
    });
    let is_unit = |(_, unit): &(&str, &str)| UNITS.contains(unit) || OTHER_UNITS.contains(unit);
    let behind_slash =
        || name.split_once('/').map(|(name, unit)| (name.trim(), unit.trim())).filter(is_unit);
    in_brackets
        .or_else(|| name.split_once(" in "))
        .or_else(behind_slash)
        .or_else(|| name.rsplit_once(['_', ' ']).filter(is_unit))
}

/// Returns the number of further mistakes, which a message does not list.
pub fn more_mistakes(more: usize) -> String {
    match more {
        1 => "1 more mistake".to_owned(),
        _ => format!("{more} more mistakes"),
    }
}

/// Returns the number of columns of a line that has too few or too many of them, for a message.
pub fn column_count(count: usize) -> String {
    match count {
        1 => "1 column, perhaps with another separator than the first line".to_owned(),
        _ => format!("{count} columns"),
    }
}

/// Returns the end of a message about a mistake that `more` further lines or fields have.
pub fn and_more(more: usize, what: &str) -> String {
    match more {
        0 => String::new(),
        1 => format!(" (1 more {what} too)"),
        _ => format!(" ({more} more {what}s too)"),
    }
}

/// Returns whether a field is a number, such as "nan" and "inf", which begin with letters.
fn is_number(field: &str) -> bool {
    field.parse::<f64>().is_ok()
}

/// Returns a field without spaces and quotes around it.
fn bare(field: &str) -> &str {
    let field = field.trim();
    field.strip_prefix('"').and_then(|rest| rest.strip_suffix('"')).unwrap_or(field).trim()
}

#[cfg(test)]
mod tests;

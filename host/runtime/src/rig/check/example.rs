//! Examples of keys that can be copied to where they belong in the file.

use plumb_config::toml_file::place;

use super::Document;

impl Document<'_> {
    /// Returns the end of a sentence: an example of the key `name` that can be copied to its line.
    /// Where the file does not have the key, the text says below which table it belongs.
    pub(super) fn example(&self, name: &str, value: &str) -> String {
        let target = (name == "targets").then(|| self.middle());
        let value = match &target {
            Some(Some(target)) => target,
            // One outside the workspace would be the next mistake.
            Some(None) => return String::new(),
            None => value,
        };
        if let Some(written) = self.written(name) {
            return format!(", for example `{written} = {value}`");
        }
        let tables = name.match_indices('.').rev().map(|(dot, _)| (&name[..dot], &name[dot + 1..]));
        for (table, own) in tables {
            if self.has_header(table) {
                return format!(", for example `{own} = {value}` below [{table}]");
            }
            if place(self.text, table).is_some_and(|place| place.value.starts_with('{')) {
                return format!(", for example `{own} = {value}` in the braces of `{table}`");
            }
        }
        format!(", for example `{name} = {value}` at the top of the file")
    }

    /// Returns a target in the middle of the workspace, to the millimetre; `None` where the text
    /// has no workspace that can be read.
    fn middle(&self) -> Option<String> {
        let corner = |key: &str| -> Option<Vec<f64>> {
            let value = place(self.text, key)?.value;
            let list = value.strip_prefix('[')?.strip_suffix(']')?;
            list.split(',').map(|number| number.trim().parse().ok()).collect()
        };
        let (min, max) = (corner("workspace.min")?, corner("workspace.max")?);
        let middle = min.iter().zip(&max).map(|(min, max)| ((min + max) * 500.0).round() / 1e3);
        let middle: Vec<f64> = middle.collect();
        (min.len() == 3 && max.len() == 3).then(|| format!("[{middle:?}]"))
    }

    /// Returns the key `name` as its line has it, without the table that it stands in: `max_rate`
    /// of `motors.max_rate`. `None` where the file does not have it.
    pub(super) fn written<'n>(&self, name: &'n str) -> Option<&'n str> {
        let line = self.text.lines().nth(place(self.text, name)?.line - 1)?;
        let dots = name.match_indices('.').map(|(dot, _)| dot + 1);
        let mut endings = std::iter::once(0).chain(dots).map(|begin| &name[begin..]);
        endings.find(|ending| is_assigned(line, ending))
    }

    /// Returns whether the file has the line `[table]`.
    fn has_header(&self, table: &str) -> bool {
        let header = |line: &str| {
            let (name, _) = line.trim().strip_prefix('[')?.split_once(']')?;
            Some(name.trim() == table)
        };
        self.text.lines().any(|line| header(line) == Some(true))
    }
}

/// Returns whether a line has `name = `, with nothing of a name before it.
fn is_assigned(line: &str, name: &str) -> bool {
    line.match_indices(name).any(|(begin, _)| {
        let is_whole = line[..begin].is_empty() || line[..begin].ends_with([' ', '\t', '{', ',']);
        is_whole && line[begin + name.len()..].trim_start().starts_with('=')
    })
}

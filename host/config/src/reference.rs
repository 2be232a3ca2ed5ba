//! Keys of a file format, from its reference page in the book.

/// Key of a configuration file, in the words of its reference page.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Key {
    /// Name with its tables: `intrinsics.fx`.
    pub name: String,
    /// Unit; empty for none.
    pub unit: String,
    /// Range; empty for any value of the type.
    pub range: String,
    /// Default, or an example for a required key; empty for none.
    pub value: String,
    /// Whether a file must have the key.
    pub is_required: bool,
    /// Meaning.
    pub meaning: String,
}

/// Returns the keys of a reference page: the rows of its tables with the columns key, unit, range,
/// default, meaning.
pub fn keys(page: &str) -> Vec<Key> {
    page.lines().filter_map(key).collect()
}

/// Character that replaces an escaped bar of a table while its cells are separated.
const ESCAPED_BAR: char = '\u{1}';

fn key(line: &str) -> Option<Key> {
    let line = line.replace("\\|", &ESCAPED_BAR.to_string());
    let cells: Vec<String> =
        line.split('|').map(|cell| cell.trim().replace(ESCAPED_BAR, "|")).collect();
    let [_, name, unit, range, value, meaning, _] = cells.as_slice() else { return None };
    let name = name.strip_prefix('`')?.strip_suffix('`')?.to_owned();
    let is_required = value.starts_with("required");
    let value = value.split('`').nth(1).unwrap_or_default().to_owned();
    let [unit, range, meaning] = [unit, range, meaning].map(|cell| plain(cell));
    Some(Key { name, unit, range, value, is_required, meaning })
}

/// Returns a cell without links and code marks.
fn plain(cell: &str) -> String {
    let mut text = String::new();
    let mut rest = cell;
    while let Some((before, link)) = rest.split_once('[') {
        let Some((words, (_, after))) = link
            .split_once("](")
            .and_then(|(words, target)| Some((words, target.split_once(')')?)))
        else {
            break;
        };
        text.push_str(before);
        text.push_str(words);
        rest = after;
    }
    text.push_str(rest);
    text.replace('`', "")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_of_a_reference_page_is_a_key() {
        let page = "\
# Page

| key | unit | range | default | meaning |
|---|---|---|---|---|
| `law.interval.alpha` | 1 | at most `beta` | required, e.g. `0.005` | α: least \\|dp/du\\| |
| `camera.file` | | a path | none | the [camera file](camera-file.md#pose), relative |
";
        let key = |name: &str, unit: &str, range: &str, value: &str, meaning: &str| Key {
            name: name.to_owned(),
            unit: unit.to_owned(),
            range: range.to_owned(),
            value: value.to_owned(),
            is_required: value == "0.005",
            meaning: meaning.to_owned(),
        };
        let expected = [
            key("law.interval.alpha", "1", "at most beta", "0.005", "α: least |dp/du|"),
            key("camera.file", "", "a path", "", "the camera file, relative"),
        ];
        assert_eq!(keys(page), expected);
    }
}

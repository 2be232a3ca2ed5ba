//! Suggestions for misspelt keys and names.

/// Returns the name that `message` of the crate `toml` most probably means: of "unknown field
/// `gian`, expected one of `gain`, `name`" it is `gain`. `None` where no expected name is similar.
pub(super) fn nearest(message: &str) -> Option<&str> {
    if !message.starts_with("unknown field") && !message.starts_with("unknown variant") {
        return None;
    }
    // The text between each pair of backquotes.
    let mut names = message.split('`').skip(1).step_by(2);
    let unknown = names.next()?;
    let (distance, name) = names.map(|name| (edit_distance(unknown, name), name)).min()?;
    (3 * distance <= unknown.chars().count().max(3)).then_some(name)
}

/// Returns the number of characters to insert, delete, replace or exchange with their neighbour
/// that turns `a` into `b` (optimal string alignment distance).
fn edit_distance(a: &str, b: &str) -> usize {
    let (a, b): (Vec<char>, Vec<char>) = (a.chars().collect(), b.chars().collect());
    // Rows i - 2, i - 1 and i of the table: distances between the first i characters of `a` and the
    // first j of `b`.
    let (mut before, mut last): (Vec<usize>, Vec<usize>) = (Vec::new(), (0..=b.len()).collect());
    for i in 1..=a.len() {
        let mut row = vec![i];
        for j in 1..=b.len() {
            let replaced = last[j - 1] + usize::from(a[i - 1] != b[j - 1]);
            let mut distance = replaced.min(last[j] + 1).min(row[j - 1] + 1);
            if i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] {
                distance = distance.min(before[j - 2] + 1);
            }
            row.push(distance);
        }
        (before, last) = (last, row);
    }
    last.last().copied().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_similar_name_is_suggested() {
        let cases = [
            ("unknown field `gian`, expected `gain` or `name`", Some("gain")),
            ("unknown field `diameter`, expected `diameter_m` or `hue`", Some("diameter_m")),
            ("unknown variant `opnni`, expected one of `simulated`, `openni`", Some("openni")),
            ("unknown field `k1`, expected one of `fx`, `fy`, `cx`, `cy`", None),
            ("unknown field `motor`, expected `rig` or `camera`", None),
            ("unknown field `x`, there are no fields", None),
            ("missing field `gain`", None),
        ];
        for (message, name) in cases {
            assert_eq!(nearest(message), name, "{message}");
        }
    }

    #[test]
    fn the_distance_counts_single_edits() {
        let cases = [("", "", 0), ("abc", "abc", 0), ("gian", "gain", 1), ("", "abc", 3)];
        for (a, b, distance) in cases {
            assert_eq!(edit_distance(a, b), distance, "{a} {b}");
            assert_eq!(edit_distance(b, a), distance, "{b} {a}");
        }
        assert_eq!(edit_distance("kitten", "sitting"), 3);
    }
}

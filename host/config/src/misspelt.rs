//! Names that a person has misspelt.

/// Returns the one of `names` that `word` most probably means; `None` where none is similar: at
/// most a third of the characters of `word` differ, and one of a short word.
pub fn nearest<'a>(word: &str, names: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let word = word.to_lowercase();
    let distances = names.into_iter().map(|name| (edit_distance(&word, name), name));
    let (distance, name) = distances.min()?;
    (3 * distance <= word.chars().count().max(3)).then_some(name)
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
    fn the_distance_counts_single_edits() {
        let cases = [("", "", 0), ("abc", "abc", 0), ("gian", "gain", 1), ("", "abc", 3)];
        for (a, b, distance) in cases {
            assert_eq!(edit_distance(a, b), distance, "{a} {b}");
            assert_eq!(edit_distance(b, a), distance, "{b} {a}");
        }
        assert_eq!(edit_distance("kitten", "sitting"), 3);
    }

    #[test]
    fn a_name_that_is_far_from_the_word_is_not_meant() {
        let names = ["emulate", "verify", "run"];
        let cases =
            [("Emulaet", Some("emulate")), ("simulate", Some("emulate")), ("rum", Some("run"))];
        for (word, name) in cases {
            assert_eq!(nearest(word, names), name, "{word}");
        }
        for word in ["version", "examples", "", "x"] {
            assert_eq!(nearest(word, names), None, "{word}");
        }
    }
}

//! Names that a person has misspelt.

/// Returns the one of `names` that `word` most probably means; `None` where none is similar: at
/// most a third of the characters of `word` are inserted, deleted, replaced or exchanged with their
/// neighbour, and one of a short word.
pub fn nearest<'a>(word: &str, names: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let word = word.to_lowercase();
    let distances = names.into_iter().map(|name| (strsim::osa_distance(&word, name), name));
    let (distance, name) = distances.min()?;
    (3 * distance <= word.chars().count().max(3)).then_some(name)
}

#[cfg(test)]
mod tests {
    use super::*;

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

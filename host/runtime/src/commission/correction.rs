//! The text of a rig file with other directions of the motors. Everything else stays as it is.

use std::ops::Range;

use serde::Deserialize;
use toml::Spanned;

/// The part of a rig file that is replaced.
#[derive(Deserialize)]
struct File {
    motors: Spanned<Motors>,
}

#[derive(Deserialize)]
struct Motors {
    reversed: Option<Spanned<[bool; 3]>>,
    max_rate: Spanned<f64>,
}

/// Returns the rig file's text with `motors.reversed`. A comment behind the old value stays.
///
/// # Errors
/// Where the text is no rig file.
pub fn corrected(text: &str, reversed: [bool; 3]) -> Result<String, toml::de::Error> {
    let file: File = toml::from_str(text)?;
    let value = format!("{reversed:?}");
    let mut text = text.to_owned();
    match &file.motors.get_ref().reversed {
        Some(old) => text.replace_range(old.span(), &value),
        None => insert(&mut text, &file.motors, &value),
    }
    Ok(text)
}

/// Adds the key to a table without it, before `max_rate`.
fn insert(text: &mut String, motors: &Spanned<Motors>, value: &str) {
    let rate: Range<usize> = motors.get_ref().max_rate.span();
    let key = text[..rate.start].rfind("max_rate").unwrap_or(rate.start);
    let is_line = text[..key].ends_with('\n');
    let separator = if is_line { "\n" } else { ", " };
    text.insert_str(key, &format!("reversed = {value}{separator}"));
}

#[cfg(test)]
mod tests {
    use super::*;

    const PAPER: &str = include_str!("../../../rigs/paper.toml");

    #[test]
    fn only_the_directions_change() {
        let new = corrected(PAPER, [true, false, true]).unwrap();
        let old = "reversed = [false, false, false]";
        assert!(PAPER.contains(old));
        assert_eq!(new, PAPER.replace(old, "reversed = [true, false, true]"));
    }

    #[test]
    fn a_missing_key_is_added() {
        let text = "[motors] # mine\nmax_rate = 5.0 # slow\ntravel = [0, 1]\n";
        let new = corrected(text, [true, false, false]).unwrap();
        let expected = text.replace("max_rate", "reversed = [true, false, false]\nmax_rate");
        assert_eq!(new, expected);
        let text = "motors = { max_rate = 5.0 }\n";
        let new = corrected(text, [false, false, true]).unwrap();
        assert_eq!(new, "motors = { reversed = [false, false, true], max_rate = 5.0 }\n");
    }
}

use serde::Deserialize;

use super::*;
use crate::quantity::CameraTime;

#[derive(Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    rig: Rig,
    #[serde(default)]
    law: Law,
    size: Option<Size>,
}

#[derive(Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct Rig {
    gain: CameraTime,
    steps: u8,
    at: [f64; 2],
}

#[derive(Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "lowercase")]
enum Law {
    #[default]
    Taut,
    Sign {
        gain: CameraTime,
        mean: f64,
    },
}

#[derive(Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct Size {
    side: CameraTime,
}

const PLACEHOLDERS: &str = "\
rig = { gain = 1.0, steps = 1, at = [0, 0] }
law.sign = { gain = 1.0, mean = 0.0 }
";

fn mistakes(text: &str) -> Vec<(usize, String, String)> {
    let diagnosis = diagnose::<File>(text, PLACEHOLDERS);
    let syntax = diagnosis.mistakes.iter().any(|mistake| mistake.kind == Kind::Syntax);
    assert!(diagnosis.contents.is_none() || !syntax, "{diagnosis:?}");
    diagnosis.mistakes.into_iter().map(|m| (m.line, m.key, m.value)).collect()
}

fn expected(list: &[(usize, &str, &str)]) -> Vec<(usize, String, String)> {
    list.iter().map(|&(line, key, value)| (line, key.to_owned(), value.to_owned())).collect()
}

#[test]
fn a_valid_file_has_no_mistake() {
    let text = "[rig]\ngain = 2\nsteps = 3\nat = [1, 2]\n";
    let diagnosis = diagnose::<File>(text, PLACEHOLDERS);
    assert_eq!(diagnosis.mistakes, []);
    assert_eq!(diagnosis.contents.unwrap().rig.steps, 3);
}

#[test]
fn every_mistake_is_reported_once() {
    let text = "\
colour = 1
[rig]
gian = 2.0
gain = -1.0
steps = 300
at = [1]
[law.sign]
gain = 'x'
[size]
";
    let all = [
        (1, "colour", ""),
        (3, "rig.gian", ""),
        (4, "rig.gain", "-1.0"),
        (5, "rig.steps", "300"),
        (6, "rig.at", "[1]"),
        (7, "law.sign.mean", ""),
        (8, "law.sign.gain", "'x'"),
        (9, "size.side", ""),
    ];
    assert_eq!(mistakes(text), expected(&all));
}

#[test]
fn a_missing_table_and_a_wrong_choice_are_reported_without_what_follows() {
    assert_eq!(mistakes(""), expected(&[(1, "rig", "")]));
    let rig = "rig = { gain = 1, steps = 1, at = [0, 0] }\n";
    assert_eq!(mistakes(&format!("{rig}law = 'sing'\n")), expected(&[(2, "law", "'sing'")]));
    assert_eq!(mistakes("rig = 3\nlaw = 4"), expected(&[(1, "rig", "3"), (2, "law", "4")]));
    let two = format!("{rig}law.sign = {{}}\nlaw.taut = {{}}\n");
    assert_eq!(mistakes(&two).len(), 1, "{:?}", mistakes(&two));
}

#[test]
fn errors_of_syntax_are_reported_by_line() {
    let errors = mistakes("[rig]\ngain 1\nsteps = = 2\nat = [0, 0]\n");
    let lines: Vec<_> = errors.iter().map(|(line, ..)| *line).collect();
    assert_eq!(lines, [2, 3]);
}

/// With all of them the time grows with the square of the length: minutes for a file of 1 MB.
#[test]
fn errors_of_syntax_are_reported_up_to_a_limit() {
    let found = mistakes(&"x y\n".repeat(20_000));
    assert_eq!(found.len(), MAX_SYNTAX_ERRORS);
    assert_eq!(found[99].0, 100);
}

//! Tests of the commands `plumb-lab control`, `paths` and `paper`.

use std::path::Path;

use super::{json, lab, stderr};

/// Runs a command with bad input. Returns the error.
fn refusal(line: &str) -> String {
    let words: Vec<&str> = line.split(' ').collect();
    let output = lab(&[&words[..], &["--json"]].concat(), Path::new("."));
    assert_eq!(output.status.code(), Some(2), "{line}: {}", stderr(&output));
    let error = json(&output)["error"].as_str().unwrap().to_owned();
    assert_eq!(stderr(&output).trim_end(), format!("plumb-lab: {error}"));
    error
}

#[test]
fn the_papers_suite_takes_the_papers_frames() {
    let line = json(&lab(&["paper", "--json"], Path::new(".")));
    assert_eq!((line["suite"].as_str(), line["law"].as_str()), (Some("paper"), Some("interval")));
    let [gammas, frames] = ["gamma", "frames"].map(|key| line[key].as_array().unwrap());
    for (gamma, frames) in gammas.iter().zip(frames) {
        let product = gamma.as_f64().unwrap() * frames.as_f64().unwrap();
        assert!((product / 17_100.0 - 1.0).abs() < 0.05, "{line}");
    }
}

#[test]
fn an_option_without_effect_and_a_controller_that_cannot_follow_are_bad_input() {
    let error = refusal("control --law sign,taut --gamma 999");
    assert!(error.contains("--gamma") && error.contains("interval"), "{error}");
    let error = refusal("paths --suite path-elastic --law reference");
    assert!(error.contains("reference cannot follow a path"), "{error}");
}

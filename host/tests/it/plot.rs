//! `plumb plot`: the figures of a run again, and several runs in one.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::fs;

use crate::common::{folder, plumb, stderr};

#[test]
fn figures_are_drawn_again_and_runs_are_compared() {
    let folder = folder();
    for (law, out) in [("taut", "one"), ("interval", "two")] {
        let arguments = ["demo", "--virtual-time", "--law", law, "--out", out];
        let output = plumb(&arguments, folder.path());
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    }
    let figure = folder.path().join("one/figure4.svg");
    let first = fs::read_to_string(&figure).unwrap();
    fs::remove_file(&figure).unwrap();
    let output = plumb(&["plot", "one", "two"], folder.path());
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    // The rows have six digits after the point: a pixel may differ.
    let again = fs::read_to_string(&figure).unwrap();
    let lines = |svg: &str| svg.matches("<polyline").count();
    assert_eq!((lines(&again), again.lines().count()), (lines(&first), first.lines().count()));
    let compared = fs::read_to_string(folder.path().join("runs.svg")).unwrap();
    assert!(compared.contains("one: ") && compared.contains("two: "), "{compared}");
    // The figure of the runs together is not replaced.
    let output = plumb(&["plot", "one", "two"], folder.path());
    assert_eq!(output.status.code(), Some(2));
    let told = "runs.svg: exists already, and is not overwritten: give another file with --out";
    assert!(stderr(&output).contains(told), "{}", stderr(&output));
}

#[test]
fn the_help_names_each_figure_that_is_replaced() {
    let help = String::from_utf8(plumb(&["plot", "--help"], folder().path()).stdout).unwrap();
    for figure in ["figure4.svg", "figure5.svg", "deviation.svg"] {
        assert!(help.contains(figure), "{help}");
    }
}

#[test]
fn a_folder_that_is_not_of_a_run_is_bad_input_and_nothing_is_drawn() {
    let folder = folder();
    fs::create_dir(folder.path().join("empty")).unwrap();
    let output = plumb(&["plot", "empty"], folder.path());
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    assert!(stderr(&output).contains("empty is not a folder of a run"), "{}", stderr(&output));
    assert_eq!(fs::read_dir(folder.path().join("empty")).unwrap().count(), 0);
}

//! `-v`: what a run reports on standard error.

#![allow(clippy::unwrap_used, reason = "a test stops at the first surprise")]

use std::process::{Command, Output};

use crate::common::{folder, json, stderr};

/// A run in virtual time that ends after half a second, with `options`.
fn demo(options: &[&str]) -> Output {
    let folder = folder();
    let mut command = Command::new(env!("CARGO_BIN_EXE_plumb"));
    command.args(options).args(["demo", "--virtual-time", "--timeout", "0.5"]);
    command.current_dir(folder.path()).output().unwrap()
}

/// The number of lines of standard error with `text`.
fn count(output: &Output, text: &str) -> usize {
    stderr(output).lines().filter(|line| line.contains(text)).count()
}

#[test]
fn the_steps_of_a_run_are_reported_on_standard_error_only() {
    let quiet = demo(&[]);
    let steps = [
        "connected to the board",
        "configured the board",
        "beginning the run",
        "driving to a target",
        "ended the drive",
        "ended the run",
    ];
    let output = demo(&["-v"]);
    for step in steps {
        assert_eq!(count(&quiet, step), 0, "{step}");
        assert_eq!(count(&output, step), 1, "{step}: {}", stderr(&output));
    }
    // The result is the same, and stands alone.
    assert_eq!(output.stdout, quiet.stdout);
    assert_eq!(output.stdout.iter().filter(|&&byte| byte == b'\n').count(), 1);
}

#[test]
fn frames_are_reported_from_the_third_level_on() {
    assert_eq!(count(&demo(&["-vv"]), "handled a frame"), 0);
    let output = demo(&["-vvv"]);
    let frames = json(&output)["frames"].as_u64().unwrap();
    assert_eq!(count(&output, "handled a frame") as u64, frames, "{}", stderr(&output));
}

#[test]
fn a_closed_standard_error_changes_no_result() {
    let folder = folder();
    let mut command = Command::new("sh");
    let script =
        format!("exec {} -vvv demo --virtual-time --timeout 0.5 2>&-", env!("CARGO_BIN_EXE_plumb"));
    let output = command.args(["-c", &script]).current_dir(folder.path()).output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    assert_eq!(output.stdout, demo(&[]).stdout);
}

#[test]
fn quiet_leaves_out_the_result_of_a_run_that_reached_its_targets_and_nothing_else() {
    let folder = folder();
    let run = |options: &[&str], out| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_plumb"));
        command.args(["demo", "--virtual-time", "--quiet", "--out", out]).args(options);
        command.current_dir(folder.path()).output().unwrap()
    };
    let reached = run(&[], "reached");
    assert_eq!((reached.status.code(), stderr(&reached).as_str()), (Some(0), ""));
    assert_eq!(json(&reached)["reached"], true);
    let late = run(&["--timeout", "0.5"], "late");
    assert_eq!(late.status.code(), Some(1));
    let text = stderr(&late);
    let last = text.lines().last().unwrap();
    assert!(last.starts_with("not reached in time: ") && last.contains("--timeout"), "{text}");
    let both = demo(&["-v", "--quiet"]);
    assert_eq!(both.status.code(), Some(2), "{}", stderr(&both));
}

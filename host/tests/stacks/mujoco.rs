//! `plumb cosim` on other people's physics: the example beside it, on MuJoCo.

#![allow(clippy::unwrap_used, reason = "a test stops at the first surprise")]

use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// A Python that has MuJoCo, where `scripts/mujoco` leaves one; without it the test is passed over,
/// but never with CI set.
fn python_with_mujoco() -> Option<PathBuf> {
    let has_mujoco = |python: &PathBuf| {
        Command::new(python)
            .args(["-c", "import mujoco"])
            .output()
            .is_ok_and(|it| it.status.success())
    };
    let pythons = [PathBuf::from("python3"), repository().join("target/mujoco/bin/python")];
    let python = pythons.into_iter().find(has_mujoco);
    if python.is_none() {
        assert!(std::env::var_os("CI").is_none(), "no Python has MuJoCo: scripts/mujoco");
        println!("skipped: no Python has MuJoCo (scripts/mujoco)");
    }
    python
}

/// Returns the output of the example at the end of a run with these options.
fn example(python: &Path, options: &[&str]) -> Value {
    let output = Command::new(python)
        .arg(repository().join("host/examples/cosim_mujoco.py"))
        .args(["--plumb", env!("CARGO_BIN_EXE_plumb"), "--seed", "1"])
        .args(options)
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

/// The default law keeps the cables taut on the paper's task; `adaptive`, which does not, shows
/// that the example can tell.
#[test]
fn the_example_does_the_papers_task_on_mujoco() {
    let Some(python) = python_with_mujoco() else { return };
    let [taut, adaptive] = ["taut", "adaptive"].map(|law| example(&python, &["--law", law]));
    let number = |key: &str| taut[key].as_f64().unwrap();
    assert!(number("reached_s") < 6.0, "{taut}");
    assert!(number("error_mm") < 10.0, "{taut}");
    assert!(number("slack_s") < 0.02, "{taut}");
    assert!(adaptive["slack_s"].as_f64().unwrap() > 0.1, "{adaptive}");
}

/// Two cables let the ball swing out of their plane, which nothing measures or damps but the air.
#[test]
fn two_cables_bring_a_swinging_ball_to_its_target_on_mujoco() {
    let Some(python) = python_with_mujoco() else { return };
    let folder = tempfile::tempdir().unwrap();
    let init = Command::new(env!("CARGO_BIN_EXE_plumb"))
        .args(["init", "--planar", "--simulated"])
        .current_dir(&folder)
        .output()
        .unwrap();
    assert!(init.status.success());
    let rig = folder.path().join("rig.toml");
    let line = example(&python, &["--planar", "--rig", rig.to_str().unwrap()]);
    assert!(line["error_mm"].as_f64().unwrap() < 10.0, "{line}");
    assert!(line["slack_s"].as_f64().unwrap() < 0.02, "{line}");
}

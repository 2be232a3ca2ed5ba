//! `plumb cosim` on physics that are not ours: the example beside it, on MuJoCo.

#![allow(clippy::unwrap_used, reason = "a test stops at the first surprise")]

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use serde_json::Value;

use crate::common::{folder, program, rig_file, stderr};

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

/// Returns the output of the example at the end of a run with this law.
fn example(python: &Path, law: &str) -> Value {
    let output = Command::new(python)
        .arg(repository().join("host/examples/cosim_mujoco.py"))
        .args(["--plumb", env!("CARGO_BIN_EXE_plumb"), "--law", law, "--seed", "1"])
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn a_target_outside_the_workspace_is_told_with_the_limits_and_with_whose_they_are() {
    let folder = folder();
    rig_file(folder.path(), |text| text);
    let refusal = |options: &[&str]| {
        let mut command = program(&[&["cosim"], options].concat(), folder.path());
        let mut child = command.stdin(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        let line = "{\"t\": 0, \"dt\": 0.1, \"target\": [9, 0, 0]}\n";
        child.stdin.take().unwrap().write_all(line.as_bytes()).unwrap();
        let output = child.wait_with_output().unwrap();
        assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
        stderr(&output)
    };
    let text = refusal(&[]);
    let says = "outside the workspace. The workspace without a rig file is x -4.000 to 4.000 m,";
    assert!(text.contains(says), "{text}");
    let text = refusal(&["--rig", "rig.toml"]);
    assert!(text.contains("The workspace of rig.toml is x "), "{text}");
}

/// The default law keeps the cables taut on the paper's task; `adaptive`, which does not, shows
/// that the example can tell.
#[test]
fn the_example_does_the_papers_task_on_mujoco() {
    let Some(python) = python_with_mujoco() else { return };
    let [taut, adaptive] = ["taut", "adaptive"].map(|law| example(&python, law));
    let number = |key: &str| taut[key].as_f64().unwrap();
    assert!(number("reached_s") < 6.0, "{taut}");
    assert!(number("error_mm") < 10.0, "{taut}");
    assert!(number("slack_s") < 0.02, "{taut}");
    assert!(adaptive["slack_s"].as_f64().unwrap() > 0.1, "{adaptive}");
}

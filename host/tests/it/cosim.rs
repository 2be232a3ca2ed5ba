//! `plumb cosim`: its refusals.

#![allow(clippy::unwrap_used, reason = "a test stops at the first surprise")]

use std::io::Write;
use std::process::Stdio;

use crate::common::{folder, program, rig_file, stderr};

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

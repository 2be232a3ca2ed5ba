//! A run whose camera never shows the ball: what it reports.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::fs;

use serde_json::Value;

use crate::common::{CAMERA_AWAY, Emulator, folder, json, plumb, rig_file, stderr};

#[test]
fn a_run_without_a_ball_says_so_and_claims_no_error() {
    let folder = folder();
    let rig = rig_file(folder.path(), |text| text + CAMERA_AWAY);
    let emulator = Emulator::start();
    let run = ["run", "--rig", &rig, "--port", &emulator.port, "--json", "--out", "run"];
    let output = plumb(&run, folder.path());
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    let line = json(&output);
    let frames = line["frames"].as_u64().unwrap();
    let seen = format!("ball seen in 0 of {frames} pictures");
    let text = stderr(&output);
    let last = text.lines().last().unwrap();
    let says_so = last.contains("The ball was never seen: compare [ball] of the camera file");
    assert!(frames > 0 && text.contains(&seen) && says_so, "{text}");
    let clear = format!("`plumb clear --rig {rig} --port {}` clears it", emulator.port);
    assert!(last.contains("no fresh position") && last.ends_with(&clear), "{text}");
    let summary = fs::read_to_string(folder.path().join("run/summary.json")).unwrap();
    for line in [line, serde_json::from_str::<Value>(&summary).unwrap()] {
        assert_eq!(line["located"], 0, "{line}");
        // `get`: a key that is left out is no null.
        assert_eq!(line.get("filtered_error_mm"), Some(&Value::Null), "{line}");
        assert_eq!(line["legs"][0].get("filtered_error_mm"), Some(&Value::Null), "{line}");
    }
}

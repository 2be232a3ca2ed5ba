//! A run whose files cannot be written: its result and its exit code are those of the run.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

mod common;

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use common::{folder, json, stderr};

/// What the system says of a write beyond the limit of [`demo`].
const CAUSE: &str = "File too large";

/// `plumb demo` where no file may grow beyond `blocks` of 512 bytes: a write that would is an
/// error, as on a full disk.
fn demo(folder: &Path, blocks: u32) -> Output {
    let limited =
        format!(r#"trap "" XFSZ; ulimit -f {blocks}; exec "$0" demo --virtual-time --out run"#);
    Command::new("sh")
        .args(["-c", &limited, env!("CARGO_BIN_EXE_plumb")])
        .current_dir(folder)
        .output()
        .unwrap()
}

/// Names of what is in the run's folder.
fn files(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder.join("run")).unwrap();
    let mut names: Vec<String> =
        entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn a_figure_without_room_hides_no_result() {
    let folder = folder();
    // 30 KiB: the rows have 26, the figure 54.
    let output = demo(folder.path(), 60);
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    let line = json(&output);
    assert!(line["reached"] == true && line["targets_reached"] == 1, "{line}");
    let text = stderr(&output);
    assert!(
        text.contains("the run folder is not complete") && text.contains("figure4.svg"),
        "{text}"
    );
    assert!(text.contains(CAUSE), "{text}");
    // What was begun and has no room is gone, and the rest is there.
    let files = files(folder.path());
    assert!(
        files.contains(&"run.csv".to_owned()) && files.contains(&"summary.json".to_owned()),
        "{files:?}"
    );
    assert!(!files.contains(&"figure4.svg".to_owned()), "{files:?}");
}

#[test]
fn rows_without_room_end_the_run_with_the_cause() {
    let folder = folder();
    let output = demo(folder.path(), 8);
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    let line = json(&output);
    assert!(line["reached"] == false && line["at_rest"] == true, "{line}");
    let ending = line["ending"].as_str().unwrap();
    assert!(ending.contains("run.csv") && ending.contains(CAUSE), "{line}");
    assert!(stderr(&output).contains(ending), "{}", stderr(&output));
    let kept: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(folder.path().join("run/summary.json")).unwrap())
            .unwrap();
    assert_eq!(kept["ending"], line["ending"]);
}

#[test]
fn a_summary_without_room_does_not_hide_the_cause() {
    let folder = folder();
    // 512 bytes: enough for the first rows, too little for the summary.
    let output = demo(folder.path(), 1);
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    let ending = json(&output)["ending"].as_str().unwrap().to_owned();
    assert!(ending.contains("run.csv") && ending.contains(CAUSE), "{ending}");
    assert!(stderr(&output).contains(&ending), "{}", stderr(&output));
    assert!(!files(folder.path()).contains(&"summary.json".to_owned()));
}

#[test]
fn the_last_rows_without_room_fail_the_run_at_the_same_frame() {
    // Room for all rows but the last ones.
    let whole = folder();
    demo(whole.path(), 1 << 20);
    let size = fs::metadata(whole.path().join("run/run.csv")).unwrap().len();
    let blocks = u32::try_from((size - 1) / 512).unwrap();
    let results = [(); 4].map(|()| {
        let folder = folder();
        let output = demo(folder.path(), blocks);
        assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
        let line = json(&output);
        assert!(line["ending"].as_str().unwrap().contains("run.csv"), "{line}");
        line["frames"].as_u64().unwrap()
    });
    assert!(results.iter().all(|&frames| frames == results[0]), "{results:?}");
}

#[test]
fn a_disk_that_is_full_from_the_beginning_is_a_failure() {
    let folder = folder();
    let output = demo(folder.path(), 0);
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    assert!(stderr(&output).contains("run.csv"), "{}", stderr(&output));
}

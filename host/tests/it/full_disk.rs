//! Files that cannot be written, by the limit of a file's size (`ulimit -f`): the cause is told,
//! what was written before is complete, and the exit code is that of a failure.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::fs;
use std::path::Path;
use std::process::Output;

use crate::common::{folder, json, limited, plumb, record, rig_file, stderr};

/// Cause of a write beyond the limit, with what to do.
const CAUSE: &str = "the limit of a file's size is reached: that of this process (`ulimit -f`";

/// `plumb demo` where no file may grow beyond `blocks` of 512 bytes.
fn demo(folder: &Path, blocks: u32) -> Output {
    limited(&["demo", "--virtual-time", "--out", "run"], folder, blocks, "")
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
    // 30 KiB: the rows have 20, the figure 45.
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
    let rows = fs::read_to_string(folder.path().join("run/run.csv")).unwrap();
    let columns = |row: &str| row.split(',').count();
    assert!(rows.ends_with('\n') && rows.lines().count() > 10, "{rows}");
    assert!(rows.lines().all(|row| columns(row) == columns(rows.lines().next().unwrap())));
}

#[test]
fn a_summary_without_room_does_not_hide_the_cause() {
    let folder = folder();
    // 1 KiB: enough for the first rows, too little for the summary.
    let output = demo(folder.path(), 2);
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

/// A picture has some 200 KiB, the list of pictures less than a block.
#[test]
fn a_recording_without_room_keeps_its_whole_pictures() {
    let folder = folder();
    let run = ["demo", "--virtual-time", "--timeout", "1", "--record", "recording", "--out", "run"];
    let output = limited(&run, folder.path(), 100, "");
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    let text = stderr(&output);
    assert!(text.contains("recording/rgb/000001.png") && text.contains(CAUSE), "{text}");
    assert!(text.contains("no picture is kept: "), "{text}");
    assert!(folder.path().join("run/summary.json").exists());
    assert!(!folder.path().join("recording/rgb/000001.png").exists(), "half a picture");
    let list = fs::read_to_string(folder.path().join("recording/rgb.txt")).unwrap();
    assert_eq!(list.lines().count(), 1, "{list}");
}

#[test]
fn every_command_tells_of_a_file_without_room() {
    let folder = folder();
    record(folder.path());
    plumb(&["demo", "--virtual-time", "--out", "drawn"], folder.path());
    let rig = rig_file(folder.path(), |text| text);
    let places = ["0.2,0.2,0.1", "0.7,0.1,0.1", "0.7,0.5,0.1", "0.4,0.3,0.4"];
    let places: Vec<&str> = places.iter().flat_map(|place| ["--place", place]).collect();
    let ball =
        [&["calibrate", "--rig", &rig, "--ball", "--yes", "--frames", "2"], &places[..]].concat();
    for (arguments, file) in [
        (&["init", "new", "--simulated", "--yes"][..], "rig.toml"),
        (&["calibrate", "--print-board", "board.pdf"], "board.pdf"),
        (&ball, "camera.calibration.png"),
        (&["plot", "drawn"], "figure4.svg"),
        (&["replay", "recording", "--debug", "stages"], "stages"),
        (&["man", "pages"], "pages"),
    ] {
        let output = limited(arguments, folder.path(), 0, "");
        let text = stderr(&output);
        assert_eq!(output.status.code(), Some(1), "{arguments:?}: {text}");
        assert!(text.contains(file) && text.contains(CAUSE), "{arguments:?}: {text}");
    }
    for file in ["new/rig.toml", "board.pdf", "drawn/figure4.new", "camera.calibration.png"] {
        assert!(!folder.path().join(file).exists(), "half of {file}");
    }
    assert!(folder.path().join("drawn/figure4.svg").exists());
}

#[test]
fn results_without_room_are_a_failure_and_messages_are_none() {
    let folder = folder();
    let recording = record(folder.path());
    let replay = ["replay", recording.to_str().unwrap()];
    let output = limited(&replay, folder.path(), 1, "> rows.csv");
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    assert!(stderr(&output).contains(CAUSE), "{}", stderr(&output));
    let json = ["demo", "--virtual-time", "--timeout", "0.2", "--out", "run"];
    let output = limited(&json, folder.path(), 0, "> line.json");
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    assert!(stderr(&output).contains(CAUSE), "{}", stderr(&output));
    // A log that has no room is no failure of the run.
    let rig = rig_file(folder.path(), |text| text);
    let verbose = ["check", "--rig", &rig, "--file-only", "-vvv"];
    let output = limited(&verbose, folder.path(), 0, "2> log");
    assert_eq!(output.status.code(), Some(0));
}

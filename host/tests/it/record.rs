//! `--record`: what a run sees is what `plumb replay` finds in its recording.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

fn plumb(arguments: &[&str], folder: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_plumb")).args(arguments).current_dir(folder).output().unwrap()
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// The columns of a CSV's rows, without its header; empty fields are not numbers.
fn numbers(text: &str, columns: &[usize]) -> Vec<Vec<f64>> {
    let row = |line: &str| {
        let fields: Vec<&str> = line.split(',').collect();
        columns.iter().map(|&column| fields[column].parse().unwrap_or(f64::NAN)).collect()
    };
    text.lines().skip(1).map(row).collect()
}

#[test]
fn a_recorded_run_is_replayed_to_the_same_rows() {
    let folder = tempfile::tempdir().unwrap();
    let run = ["demo", "--virtual-time", "--timeout", "1", "--record", "recording", "--out", "run"];
    let output = plumb(&run, folder.path());
    assert!(stderr(&output).contains("recorded: "), "{}", stderr(&output));
    let replayed = plumb(&["replay", "recording"], folder.path());
    assert!(replayed.status.success(), "{}", stderr(&replayed));
    // u, v, radius, score and x, y, z.
    let seen = numbers(
        &fs::read_to_string(folder.path().join("run/run.csv")).unwrap(),
        &[2, 3, 4, 5, 6, 7, 8],
    );
    let found = numbers(&String::from_utf8_lossy(&replayed.stdout), &[1, 2, 3, 8, 5, 6, 7]);
    assert!(
        seen.len() > 20 && seen.len() == found.len(),
        "{} rows, {} replayed",
        seen.len(),
        found.len()
    );
    for (row, (seen, found)) in seen.iter().zip(&found).enumerate() {
        for (i, (a, b)) in seen.iter().zip(found).enumerate() {
            // What the coarser of the two files rounds to: pixels to 0.001, metres to 0.00001.
            let rounding = if i < 4 { 0.000_6 } else { 0.000_006 };
            assert!(
                (a - b).abs() < rounding || (a.is_nan() && b.is_nan()),
                "row {row}: {seen:?}, {found:?}"
            );
        }
    }
    // Once more, over it: refused, and left as it is.
    let before = fs::read(folder.path().join("recording/rgb.txt")).unwrap();
    let again = plumb(&run, folder.path());
    assert_eq!(again.status.code(), Some(2), "{}", stderr(&again));
    assert!(stderr(&again).contains("recording exists already"), "{}", stderr(&again));
    assert_eq!(fs::read(folder.path().join("recording/rgb.txt")).unwrap(), before);
}

#[test]
fn a_folder_that_cannot_be_made_is_named() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("file"), "").unwrap();
    for path in ["file", "file/below", "/proc/no/such"] {
        let output = plumb(&["demo", "--virtual-time", "--record", path], folder.path());
        assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
        assert!(stderr(&output).contains(path), "{path}: {}", stderr(&output));
        assert!(!folder.path().join("runs").exists());
    }
    for path in ["file", "absent"] {
        let camera = Path::new(env!("CARGO_MANIFEST_DIR")).join("rigs/camera.toml");
        let output = plumb(&["replay", path, "--camera", camera.to_str().unwrap()], folder.path());
        assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
        assert!(stderr(&output).contains(path), "{path}: {}", stderr(&output));
    }
}

#[test]
fn replay_writes_an_image_of_each_stage_for_each_frame() {
    let folder = tempfile::tempdir().unwrap();
    let run =
        ["demo", "--virtual-time", "--timeout", "0.2", "--record", "recording", "--out", "run"];
    let output = plumb(&run, folder.path());
    assert!(stderr(&output).contains("recorded: "), "{}", stderr(&output));
    let replay = ["replay", "recording", "--debug", "stages"];
    let replayed = plumb(&replay, folder.path());
    assert!(replayed.status.success(), "{}", stderr(&replayed));
    let frames = numbers(&String::from_utf8_lossy(&replayed.stdout), &[0]).len();
    let mut names: Vec<String> = fs::read_dir(folder.path().join("stages"))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    let stages = ["1-proposals", "2-outline", "3-features", "4-score"];
    let expected: Vec<String> = (0..frames)
        .flat_map(|frame| stages.map(|stage| format!("{frame:06}-{stage}.png")))
        .collect();
    assert!(frames > 3, "{frames}");
    assert_eq!(names, expected);
    // Each is a picture.
    for name in &names[..stages.len()] {
        let bytes = fs::read(folder.path().join("stages").join(name)).unwrap();
        assert!(bytes.starts_with(b"\x89PNG") && bytes.len() > 1000, "{name}");
    }
    // Images are never mixed with those of another replay.
    let again = plumb(&replay, folder.path());
    assert_eq!(again.status.code(), Some(2), "{}", stderr(&again));
    assert!(stderr(&again).contains("is not empty"), "{}", stderr(&again));
}

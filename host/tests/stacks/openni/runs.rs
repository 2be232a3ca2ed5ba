//! Runs with a camera: their recordings, and cameras that fail.

use std::fs;
use std::process::Stdio;

use plumb_openni_driver::Control;

use super::fixture::{Emulator, Fixture, rows, stderr, stdout, until_rows};

/// A run with `--record`: replays of both recordings make the same detections.
#[test]
fn a_replay_makes_the_detections_of_the_run() {
    let Some(fixture) = Fixture::new(true) else { return };
    let emulator = Emulator::start();
    fixture.rig(&emulator.port, "[camera.openni]\nintrinsics = \"device\"\nlatency = 0.005");
    let output = fixture.plumb(&["run", "--record", "recording", "--out", "run"]);
    assert!(output.status.success(), "{}", stderr(&output));
    assert!(
        stderr(&output).contains("recorded: ") && !stderr(&output).contains("left out"),
        "{}",
        stderr(&output)
    );

    let run = rows(&fs::read_to_string(fixture.path().join("run/run.csv")).unwrap());
    let replayed = fixture.plumb(&["replay", "recording"]);
    assert!(replayed.status.success(), "{}", stderr(&replayed));
    let replayed = rows(&stdout(&replayed));
    assert_eq!(run.len(), replayed.len());
    let numbers =
        |row: &[String]| -> Vec<f64> { row.iter().map(|field| field.parse().unwrap()).collect() };
    for (run, replayed) in run.iter().zip(&replayed) {
        // u, v, radius and x, y, z, to the digits that both write.
        let (run, replayed) =
            ([&run[2..5], &run[6..9]].concat(), [&replayed[1..4], &replayed[5..8]].concat());
        for (a, b) in numbers(&run).iter().zip(numbers(&replayed)) {
            assert!((a - b).abs() < 2e-3, "{run:?} {replayed:?}");
        }
        let target = [0.400, 0.400, 0.150];
        assert!(
            numbers(&replayed[3..]).iter().zip(target).all(|(p, t)| (p - t).abs() < 0.004),
            "{replayed:?}"
        );
    }

    // The device's own recording has every frame of the device, also those that the run skipped.
    let oni = fixture.plumb(&["replay", "recording/recording.oni"]);
    assert!(oni.status.success(), "{}", stderr(&oni));
    let oni = rows(&stdout(&oni));
    assert!(oni.len() >= run.len(), "{} of {}", oni.len(), run.len());
    for row in &oni {
        assert_eq!(row[1..], replayed[0][1..], "the ball is at rest");
    }

    // Runs of the recordings from a rig file. They may end before the board reports.
    for (recording, out) in [("recording/recording.oni", "again"), ("recording", "once-more")] {
        fixture.rig(&emulator.port, &format!("recording = {recording:?}"));
        let again = fixture.plumb(&["run", "--out", out, "--json"]);
        let summary: serde_json::Value = serde_json::from_str(&stdout(&again)).unwrap();
        assert!(
            again.status.success() || summary["ending"] == "no more pictures",
            "{recording}: {}",
            stderr(&again)
        );
        // A busy machine leaves overdue frames out.
        assert!(
            summary["located"].as_u64() >= Some(5) && summary["lost"] == 0,
            "{recording}: {summary}"
        );
    }
}

#[test]
fn unplugging_the_camera_ends_a_run_with_a_complete_folder() {
    let Some(mut fixture) = Fixture::new(true) else { return };
    // The ball is far from the target, so that the run goes on, and at rest, so that no error
    // grows.
    let ball = Some([0.0, 0.0, 1.2]);
    fixture.camera.write(&Control { ball, ..Fixture::control() }).unwrap();
    let emulator = Emulator::start();
    fixture.rig(&emulator.port, "");
    let mut command = fixture.command(&["run", "--record", "recording", "--out", "run"]);
    let mut run = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    // A busy machine takes few pictures before the motors have turned so far that the same picture
    // is an error.
    until_rows(&mut run, fixture.path(), 4);
    fixture.camera.write(&Control { plugged: false, ..Fixture::control() }).unwrap();
    let output = run.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    assert!(stderr(&output).contains("the camera was unplugged"), "{}", stderr(&output));
    let summary = fs::read_to_string(fixture.path().join("run/summary.json")).unwrap();
    assert!(summary.contains("unplugged"), "{summary}");
    assert!(fixture.path().join("run/figure4.svg").exists());
    for recording in ["recording", "recording/recording.oni"] {
        let replayed = fixture.plumb(&["replay", recording]);
        assert!(replayed.status.success(), "{recording}: {}", stderr(&replayed));
        assert!(rows(&stdout(&replayed)).len() >= 3, "{recording}");
    }
}

#[test]
fn a_silent_camera_ends_a_run() {
    let Some(mut fixture) = Fixture::new(true) else { return };
    fixture.camera.write(&Control { ball: Some([0.0, 0.0, 1.2]), ..Fixture::control() }).unwrap();
    let emulator = Emulator::start();
    fixture.rig(&emulator.port, "");
    let mut command = fixture.command(&["run", "--out", "run"]);
    let mut run = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    until_rows(&mut run, fixture.path(), 3);
    fixture.camera.write(&Control { silent: true, ..Fixture::control() }).unwrap();
    let output = run.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    assert!(stderr(&output).contains("no picture for"), "{}", stderr(&output));
}

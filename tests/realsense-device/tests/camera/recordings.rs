//! The library's own recordings: whole, left early, and damaged.

use std::fs;
use std::path::{Path, PathBuf};

use plumb_realsense::{Camera, RealsenseError, Settings, Target};
use tempfile::TempDir;

use crate::fixture::{Fixture, assert_shows_the_ball, quick};

/// Pairs in the recording.
const PAIRS: usize = 40;

/// Records [`PAIRS`] pairs, 1/30 s apart.
fn record(fixture: &Fixture, folder: &TempDir) -> PathBuf {
    let path = folder.path().join("recording.db3");
    let settings = Settings { record: Some(path.clone()), ..quick() };
    let mut camera = fixture.open(settings).unwrap();
    for number in 0..PAIRS {
        let time = 1000.0 + number as f64 / 30.0;
        fixture.send(time, time);
        assert!(camera.next_pair().unwrap().is_some());
    }
    path
}

fn play(fixture: &Fixture, path: &Path) -> Result<Camera, RealsenseError> {
    Camera::open(&fixture.library, &Target::Recording(path.to_owned()), quick())
}

/// Plays a recording to its end, or to the pair `leave`. Returns the number of its pairs.
fn play_pairs(fixture: &Fixture, path: &Path, leave: usize) -> usize {
    let mut camera = play(fixture, path).unwrap();
    assert_eq!(camera.opened().depth_unit, 0.001);
    for number in 0..leave {
        let Some(pair) = camera.next_pair().unwrap() else {
            assert_eq!(camera.next_pair(), Ok(None));
            return number;
        };
        assert!((pair.time - number as f64 / 30.0).abs() < 1e-4, "{number}: {}", pair.time);
        assert_shows_the_ball(&pair);
    }
    leave
}

#[test]
fn a_recording_plays_from_its_first_pair_each_time() {
    let Some(fixture) = Fixture::new("record") else { return };
    let folder = tempfile::tempdir().unwrap();
    let path = record(&fixture, &folder);
    // The library does not write the frames that wait when its recorder is closed.
    let whole = play_pairs(&fixture, &path, PAIRS + 1);
    assert!((PAIRS - 8..=PAIRS).contains(&whole), "{whole}");
    // Left in its middle, and played again.
    assert_eq!(play_pairs(&fixture, &path, 5), 5);
    // The library may also leave out frames at the end of a playback.
    let again = play_pairs(&fixture, &path, PAIRS + 1);
    assert!(again.abs_diff(whole) <= 8, "{again} after {whole}");
}

#[test]
fn what_is_no_recording_is_refused() {
    let Some(fixture) = Fixture::new("damaged") else { return };
    let folder = tempfile::tempdir().unwrap();
    let absent = play(&fixture, &folder.path().join("absent.bag")).unwrap_err().to_string();
    assert!(absent.contains("absent.bag") && absent.contains("No such file"), "{absent}");
    for name in ["text.bag", "text.db3"] {
        let path = folder.path().join(name);
        fs::write(&path, "no recording").unwrap();
        let error = play(&fixture, &path).unwrap_err();
        assert!(matches!(error, RealsenseError::Open { .. }), "{error}");
    }
}

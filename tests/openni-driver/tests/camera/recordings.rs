//! Recordings of the camera: whole, damaged and truncated ones.

use std::path::{Path, PathBuf};

use plumb_openni::{Camera, OpenniError, Pair, Settings, Target};
use plumb_openni_driver::Control;

use crate::fixture::{TestCamera, next, openni, seen};

/// Records at least `count` pairs at that rate and returns the file.
fn record(device: &mut TestCamera, count: usize) -> PathBuf {
    let path = device.path("recording.oni");
    let settings = Settings { record: Some(path.clone()), ..Settings::default() };
    let mut camera = device.open(settings).unwrap();
    for i in 0..count {
        next(&mut camera);
        let ball = Some([0.01 * i as f64, 0.0, 1.2]);
        device.file.write(&Control { ball, ..Control::default() }).unwrap();
    }
    camera.close().unwrap();
    path
}

/// Returns all pairs of a recording, and its end.
fn play(path: &Path) -> (Vec<Pair>, Vec<OpenniError>, Result<(), OpenniError>) {
    let settings = Settings::default();
    let mut camera =
        match Camera::open(openni().unwrap(), &Target::Recording(path.to_owned()), settings) {
            Ok(camera) => camera,
            Err(error) => return (Vec::new(), Vec::new(), Err(error)),
        };
    let (mut pairs, mut problems) = (Vec::new(), Vec::new());
    loop {
        match camera.next_pair() {
            Ok(Some(pair)) => pairs.push(pair),
            Ok(None) => return (pairs, problems, camera.close()),
            Err(error) if error.is_transient() => problems.push(error),
            Err(error) => return (pairs, problems, Err(error)),
        }
    }
}

#[test]
fn a_recording_is_played_completely() {
    if openni().is_none() {
        return;
    }
    let mut device = TestCamera::new(&Control::default());
    let path = record(&mut device, 20);
    let (pairs, problems, end) = play(&path);
    assert_eq!(end, Ok(()));
    assert_eq!(problems, []);
    assert!(pairs.len() >= 20, "{}", pairs.len());
    for (i, two) in pairs.windows(2).enumerate() {
        let (before, after) = (seen(&two[0], 640), seen(&two[1], 640));
        assert!(two[1].time > two[0].time && after.0 >= before.0 - 0.01, "picture {i}");
        assert!(
            (1159..1166).contains(&after.2),
            "picture {i}: colour and depth are apart ({after:?})"
        );
    }
    // A second time.
    assert_eq!(play(&path), (pairs, problems, end));
}

#[test]
fn a_damaged_recording_is_an_error_and_never_blocks() {
    if openni().is_none() {
        return;
    }
    let mut device = TestCamera::new(&Control::default());
    let path = record(&mut device, 10);
    let whole = std::fs::read(&path).unwrap();
    let (all, _, _) = play(&path);
    let cut = device.path("cut.oni");
    for part in
        [0, 3, 20, 200, 1000, whole.len() / 3, whole.len() / 2, whole.len() - 5000, whole.len() - 1]
    {
        std::fs::write(&cut, &whole[..part]).unwrap();
        let (pairs, _, end) = play(&cut);
        let error = end.unwrap_err().to_string();
        let says = if part < 4 { "no .oni recording" } else { "truncated" };
        assert!(
            pairs.is_empty() && error.contains(says) && error.contains("cut.oni"),
            "{part}: {error}"
        );
    }
    // A byte of a compressed depth frame.
    let mut flipped = whole.clone();
    flipped[2100] ^= 0x55;
    std::fs::write(&cut, &flipped).unwrap();
    let (pairs, problems, end) = play(&cut);
    assert_eq!(end, Ok(()));
    assert!(pairs.len() + problems.len() >= all.len(), "{} and {problems:?}", pairs.len());
    let (_, _, end) = play(&device.path("absent.oni"));
    assert!(end.unwrap_err().to_string().contains("absent.oni"));
    std::fs::write(&cut, b"# no recording").unwrap();
    let (_, _, end) = play(&cut);
    assert!(end.unwrap_err().to_string().contains("no .oni recording"));
}

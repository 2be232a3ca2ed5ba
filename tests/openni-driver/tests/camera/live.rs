//! The live camera: its modes, lost pictures and failures.

use std::time::Duration;

use plumb_openni::{Camera, OpenniError, Settings, Target, Timeouts};
use plumb_openni_driver::{Control, FOCAL_LENGTH};

use crate::fixture::{TestCamera, next, openni, quick, seen};

#[test]
fn a_live_camera_is_registered_unmirrored_and_of_the_requested_size() {
    if openni().is_none() {
        return;
    }
    let device = TestCamera::new(&Control { ball: Some([0.25, -0.1, 1.2]), ..Control::default() });
    let mut camera = device.open(Settings { latency: 0.0, ..Settings::default() }).unwrap();
    let opened = camera.opened().clone();
    assert_eq!((opened.mode.width, opened.mode.height, opened.mode.rate), (640, 480, 30));
    assert_eq!(opened.notes, [""; 0]);
    let (horizontal, vertical) = opened.field_of_view.unwrap();
    assert!((320.0 / (horizontal / 2.0).tan() - FOCAL_LENGTH).abs() < 0.01);
    assert!((240.0 / (vertical / 2.0).tan() - FOCAL_LENGTH).abs() < 0.01);
    let mut last = 0.0;
    for _ in 0..10 {
        let pair = next(&mut camera);
        // The principal point is (319.5, 239.5).
        let (u, v, z) = seen(&pair, 640);
        let k = FOCAL_LENGTH / 1.2;
        assert!(
            (u - 319.5 - 0.25 * k).abs() < 0.5 && (v - 239.5 + 0.1 * k).abs() < 0.5,
            "({u}, {v})"
        );
        assert!((1159..1166).contains(&z), "{z}");
        assert!(pair.time > last && pair.time <= camera.now(), "{} after {last}", pair.time);
        last = pair.time;
    }
    camera.close().unwrap();
}

#[test]
fn unsupported_features_are_reported() {
    if openni().is_none() {
        return;
    }
    let refused = |control: Control, settings: Settings| {
        TestCamera::new(&control).open(settings).map(|camera| camera.opened().clone())
    };
    let good = Control::default();
    let says = |result: Result<_, OpenniError>, parts: &[&str]| {
        let text = result.map(|_: plumb_openni::Opened| ()).unwrap_err().to_string();
        assert!(parts.iter().all(|part| text.contains(part)), "{parts:?} in {text}");
    };
    let wide = Settings { width: 1280, height: 1024, ..Settings::default() };
    says(
        refused(good, wide),
        &["colour", "1280x1024 at 30 Hz", "320x240 at 30 Hz, 640x480 at 30 Hz"],
    );
    let fast = Settings { rate: 60, ..Settings::default() };
    says(refused(good, fast), &["640x480 at 60 Hz", "320x240 at 30 Hz"]);
    says(
        refused(Control { no_registration: true, ..good }, Settings::default()),
        &["registration"],
    );
    let kept = refused(Control { keeps_mode: true, ..good }, Settings::default());
    says(kept, &["size and rate", "640x480", "320x240"]);
    says(
        refused(Control { keeps_mirroring: true, ..good }, Settings::default()),
        &["mirroring off", "still on"],
    );
    let opened = refused(Control { no_sync: true, ..good }, Settings::default()).unwrap();
    assert!(opened.notes[0].contains("synchronisation"), "{:?}", opened.notes);
    let slow = Settings {
        timeouts: Timeouts { open: Duration::from_millis(100), ..quick() },
        ..Settings::default()
    };
    says(refused(Control { slow: 1.0, ..good }, slow), &["does not return from opening it"]);
    let absent = Camera::open(
        openni().unwrap(),
        &Target::Uri("plumb-test:/no/such".to_owned()),
        Settings::default(),
    );
    says(
        absent.map(|camera| camera.opened().clone()),
        &["plumb-test:/no/such", "cannot be opened"],
    );
}

#[test]
fn frames_without_synchronisation_are_paired_by_time() {
    if openni().is_none() {
        return;
    }
    let device =
        TestCamera::new(&Control { no_sync: true, depth_late: 0.010, ..Control::default() });
    let mut camera = device.open(Settings::default()).unwrap();
    for _ in 0..5 {
        next(&mut camera);
    }
}

/// Returns the camera's first permanent error.
fn lasting(camera: &mut Camera) -> OpenniError {
    loop {
        match camera.next_pair() {
            Ok(pair) => assert!(pair.is_some()),
            Err(error) if error.is_transient() => {}
            Err(error) => return error,
        }
    }
}

#[test]
fn unplugging_is_a_permanent_error() {
    if openni().is_none() {
        return;
    }
    let mut device = TestCamera::new(&Control::default());
    let mut camera = device.open(Settings::default()).unwrap();
    next(&mut camera);
    device.file.write(&Control { plugged: false, ..Control::default() }).unwrap();
    let error = lasting(&mut camera);
    assert_eq!(error, OpenniError::Unplugged { uri: device.file.uri() });
    assert_eq!(camera.next_pair(), Err(error));
    camera.close().unwrap();
    // After plugging in, it is a new camera.
    device.file.write(&Control::default()).unwrap();
}

#[test]
fn a_silent_camera_is_an_error() {
    if openni().is_none() {
        return;
    }
    let mut device = TestCamera::new(&Control::default());
    let mut camera = device.open(Settings { timeouts: quick(), ..Settings::default() }).unwrap();
    next(&mut camera);
    device.file.write(&Control { silent: true, ..Control::default() }).unwrap();
    assert!(matches!(lasting(&mut camera), OpenniError::Silent { .. }));
    camera.close().unwrap();
}

#[test]
fn a_stopped_stream_and_unpaired_streams_are_errors() {
    if openni().is_none() {
        return;
    }
    for (depth_late, blind, no_sync, says) in [
        (0.016, false, false, "within 13 ms"),
        (0.030, false, false, "out of step"),
        (0.016, false, true, "within 13 ms"),
        (0.0, true, true, "within 13 ms"),
    ] {
        let device = TestCamera::new(&Control { depth_late, blind, no_sync, ..Control::default() });
        let mut camera = device.open(Settings::default()).unwrap();
        assert_eq!(camera.opened().notes.is_empty(), !no_sync);
        for _ in 0..5 {
            let error = camera.next_pair().map(|pair| pair.map(|pair| pair.time)).unwrap_err();
            assert!(error.is_transient() && error.to_string().contains(says), "{says} in {error}");
        }
    }
    // With pairing by the library, no frame arrives.
    let device = TestCamera::new(&Control { blind: true, ..Control::default() });
    let mut camera = device.open(Settings { timeouts: quick(), ..Settings::default() }).unwrap();
    assert!(matches!(lasting(&mut camera), OpenniError::Silent { .. }));
}

#[test]
fn a_frame_of_another_size_is_refused_and_the_next_accepted() {
    if openni().is_none() {
        return;
    }
    let mut device = TestCamera::new(&Control { rows_missing: 8, ..Control::default() });
    let mut camera = device.open(Settings::default()).unwrap();
    let error = camera.next_pair().unwrap_err();
    assert!(error.to_string().contains("640x472") && error.is_transient(), "{error}");
    device.file.write(&Control::default()).unwrap();
    next(&mut camera);
}

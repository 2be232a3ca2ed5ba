//! Libraries, cameras and settings that are refused.

use std::path::Path;

use plumb_realsense::{Camera, Mode, RealSense, RealsenseError, Settings, Target};

use plumb_realsense_device::{Fault, Model};

use crate::fixture::{Fixture, quick};

#[test]
fn an_absent_library_says_how_to_get_it() {
    let error = RealSense::load_from(Path::new("/no/such/librealsense2.so")).unwrap_err();
    assert!(matches!(error, RealsenseError::NoLibrary { .. }));
    let text = error.to_string();
    for part in ["Intel", "pip install pyrealsense2", "PLUMB_REALSENSE2", "/no/such"] {
        assert!(text.contains(part), "{part} in {text}");
    }
    let other = RealSense::load_from(Path::new("libc.so.6")).unwrap_err();
    assert!(matches!(other, RealsenseError::NotRealsense { .. }), "{other}");
}

#[test]
fn a_library_of_another_version_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let Some(path) = Fault::Version.compile(folder.path()).unwrap() else { return };
    let error = RealSense::load_from(&path).unwrap_err();
    assert!(matches!(error, RealsenseError::Version { .. }), "{error}");
    assert!(error.to_string().contains("3.0.1"), "{error}");
}

#[test]
fn a_camera_whose_second_sensor_does_not_start_is_stopped_before_its_queue_is_deleted() {
    let Some(fixture) = Fixture::with_fault(Fault::SecondSensor) else { return };
    let error = fixture.open(quick()).unwrap_err();
    assert!(matches!(error, RealsenseError::Open { .. }), "{error}");
}

#[test]
fn a_serial_number_that_no_camera_has_lists_the_cameras() {
    let Some(fixture) = Fixture::new("listed") else { return };
    let target = Target::Serial("0815".to_owned());
    let text = Camera::open(&fixture.library, &target, quick()).unwrap_err().to_string();
    assert!(text.contains("0815") && text.contains("listed (Plumb software camera)"), "{text}");
}

#[test]
fn a_mode_that_the_camera_lacks_lists_its_modes() {
    let Some(fixture) = Fixture::new("modes") else { return };
    for mode in
        [Mode { width: 1280, height: 720, rate: 30 }, Mode { width: 640, height: 480, rate: 60 }]
    {
        let text = fixture.open(Settings { mode, ..quick() }).unwrap_err().to_string();
        assert!(text.contains(&mode.to_string()), "{text}");
        assert!(text.contains("it has 640x480 at 30 Hz"), "{text}");
    }
}

#[test]
fn a_unit_of_depth_that_no_camera_has_is_refused() {
    for (serial, unit) in [("metres", 1.0), ("zero", 0.0)] {
        let Some(fixture) = Fixture::with_model(serial, Model { unit, ..Model::default() }) else {
            return;
        };
        let error = fixture.open(quick()).unwrap_err();
        assert!(matches!(error, RealsenseError::DepthUnit { .. }), "{error}");
    }
}

//! A camera that no node publishes. host/tests/it/ros2/ has cameras of another process.

#![allow(clippy::panic, reason = "a test stops at the first surprise")]

use std::net::{IpAddr, Ipv4Addr};
use std::time::Duration;

use plumb_cameras::camera_file;
use plumb_cameras::ros2::Ros2CameraSettings;
use plumb_frame::driver::IntrinsicsFrom;
use plumb_ros2::{Network, Ros2Camera, Ros2CameraError};

/// Domain of this test only, on this computer only.
const NETWORK: Network = Network { domain: 117, interface: Some(IpAddr::V4(Ipv4Addr::LOCALHOST)) };

/// Opens a camera that nobody publishes. Returns the error.
fn refusal(settings: &Ros2CameraSettings) -> Ros2CameraError {
    let Ok(camera) = camera_file::paper() else { panic!("no camera file") };
    let limit = Duration::from_millis(200);
    match Ros2Camera::open(settings, &NETWORK, camera.intrinsics, limit) {
        Ok(_) => panic!("a camera"),
        Err(error) => error,
    }
}

#[test]
fn topics_that_nobody_publishes_are_named() {
    let error = refusal(&Ros2CameraSettings::default()).to_string();
    for part in ["aligned_depth_to_color", "color/camera_info", "domain 117: none"] {
        assert!(error.contains(part), "{part}: {error}");
    }
    let plain = Ros2CameraSettings { depth: "none".to_owned(), ..Ros2CameraSettings::default() };
    let error = refusal(&plain).to_string();
    assert!(error.contains("color/image_raw") && !error.contains("depth"), "{error}");
}

#[test]
fn a_name_that_ros_refuses_is_refused() {
    let colour = "/camera//image".to_owned();
    let error = refusal(&Ros2CameraSettings { colour, ..Ros2CameraSettings::default() });
    assert!(error.to_string().contains("/camera//image"), "{error}");
}

#[test]
fn the_projection_of_rectified_pictures_and_the_camera_file_exclude_each_other() {
    let (rectified, intrinsics) = (true, IntrinsicsFrom::File);
    let settings = Ros2CameraSettings { rectified, intrinsics, ..Ros2CameraSettings::default() };
    let error = refusal(&settings).to_string();
    assert!(error.contains("exclude each other"), "{error}");
}

//! Table `[camera.webcam]` of a rig file: settings and driver of webcams through V4L2. A program
//! without the feature `videoio` lists webcams and cannot open them.

use std::fs;
use std::path::Path;

use plumb_config::book::page;
use plumb_config::quantity::{CameraGain, CameraTime, pixels, rate};
use plumb_frame::camera::Camera;
use plumb_frame::driver::{CameraDriver, DriverListing, FoundCamera, OpenedSource};
use plumb_frame::source::BoxedError;
use serde::Deserialize;
use thiserror::Error;

#[cfg(feature = "videoio")]
use crate::settings::{Mode, Settings, device_path};
#[cfg(feature = "videoio")]
use crate::source::WebcamSource;

/// Folder in which the kernel lists the video devices.
const DEVICES: &str = "/sys/class/video4linux";

/// Endings of the names of video files, in lower case.
pub const VIDEO_ENDINGS: [&str; 7] = ["avi", "mp4", "m4v", "mkv", "mov", "mpg", "webm"];

/// Settings of a webcam: table `[camera.webcam]` of a rig file. Every key may be left out.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct WebcamSettings {
    /// Number or path of the device, "0" or "/dev/video0". Default: "0".
    pub device: String,
    /// Columns of the picture, pixels, 1 to 65535. Default: 640.
    #[serde(deserialize_with = "pixels")]
    pub width: u16,
    /// Rows of the picture, pixels, 1 to 65535. Default: 480.
    #[serde(deserialize_with = "pixels")]
    pub height: u16,
    /// Frame rate, frames/s, 1 to 1000. Default: 30.
    #[serde(deserialize_with = "rate")]
    pub rate: u16,
    /// Pixel format of V4L2. Default: the driver's choice.
    pub format: Option<PixelFormat>,
    /// Exposure time, seconds, above 0, to 10. Default: as the camera has it, usually automatic.
    pub exposure: Option<CameraTime>,
    /// Gain, in the units of the camera's driver, within ±1e6. Default: as the camera has it.
    pub gain: Option<CameraGain>,
    /// Time from exposure to arrival of the fastest frame, seconds, above 0, to 10. Default:
    /// 0.05.
    pub latency: Option<CameraTime>,
}

impl Default for WebcamSettings {
    /// Returns the settings of the first webcam at 640x480 and 30 frames/s.
    fn default() -> Self {
        let (format, exposure, gain, latency) = (None, None, None, None);
        let (width, height, rate) = (640, 480, 30);
        Self { device: "0".to_owned(), width, height, rate, format, exposure, gain, latency }
    }
}

#[cfg(feature = "videoio")]
impl WebcamSettings {
    /// Returns what is to be set in the device.
    fn device_settings(&self) -> Settings {
        let usual = Settings::default();
        let [width, height] = [self.width, self.height].map(usize::from);
        Settings {
            device: device_path(&self.device),
            mode: Mode { width, height, rate: self.rate.into() },
            format: self.format.map(|format| format.0),
            exposure: self.exposure.map(CameraTime::get),
            gain: self.gain.map(CameraGain::get),
            latency: self.latency.map_or(usual.latency, CameraTime::get),
        }
    }
}

/// Pixel format of V4L2: four characters, "MJPG" or "YUYV".
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(try_from = "String")]
pub struct PixelFormat([u8; 4]);

/// Text that is no pixel format.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("`{0}` is no pixel format: it has four letters or digits, such as MJPG or YUYV")]
pub struct PixelFormatError(String);

impl TryFrom<String> for PixelFormat {
    type Error = PixelFormatError;

    fn try_from(text: String) -> Result<Self, PixelFormatError> {
        let bytes: Option<[u8; 4]> = text.as_bytes().try_into().ok();
        let known = bytes.filter(|bytes| bytes.iter().all(u8::is_ascii_alphanumeric));
        known.map(Self).ok_or(PixelFormatError(text))
    }
}

/// Refusal of a program that is built without OpenCV's module `videoio`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[error(
    "this program is built without webcams and video files: build one that has them, with `cargo \
     build --release -p plumb --features webcam` in its sources ({}); or let a script send the \
     pictures, as `stream` ({})",
    page("webcam"),
    page("stream")
)]
pub struct NotBuilt;

/// A program without the feature `videoio` lists webcams and cannot open them.
impl CameraDriver for WebcamSettings {
    fn list(&self) -> DriverListing {
        listing(list(Path::new(DEVICES)))
    }

    #[cfg(feature = "videoio")]
    fn open(&self, camera: &Camera, _: Option<&Path>) -> Result<OpenedSource, BoxedError> {
        let source = WebcamSource::open(&self.device_settings(), camera)?;
        let webcam = source.webcam();
        let description = Some(format!("{}, {}", webcam.path().display(), webcam.mode()));
        let (notes, intrinsics) = (webcam.notes().to_vec(), *source.intrinsics());
        Ok(OpenedSource { description, notes, ..OpenedSource::new(source, intrinsics) })
    }

    #[cfg(not(feature = "videoio"))]
    fn open(&self, _: &Camera, _: Option<&Path>) -> Result<OpenedSource, BoxedError> {
        Err(NotBuilt.into())
    }
}

/// Returns the listing of webcams that can be opened.
#[cfg(feature = "videoio")]
fn listing(cameras: Vec<FoundCamera>) -> DriverListing {
    DriverListing { cameras, ..DriverListing::default() }
}

/// Returns the listing of webcams that this program cannot open.
#[cfg(not(feature = "videoio"))]
fn listing(cameras: Vec<FoundCamera>) -> DriverListing {
    let missing = cameras.iter().map(|found| format!("{} ({}): {NotBuilt}", found.uri, found.name));
    DriverListing { missing: missing.collect(), ..DriverListing::default() }
}

/// Lists the video devices in the kernel's folder `devices`. A camera may have several devices; the
/// one with the index 0 delivers its pictures.
fn list(devices: &Path) -> Vec<FoundCamera> {
    let Ok(entries) = fs::read_dir(devices) else { return Vec::new() };
    let text = |path: &Path| fs::read_to_string(path).unwrap_or_default().trim().to_owned();
    let mut found: Vec<FoundCamera> = entries
        .filter_map(Result::ok)
        .filter(|entry| text(&entry.path().join("index")) == "0")
        .map(|entry| FoundCamera {
            uri: format!("/dev/{}", entry.file_name().to_string_lossy()),
            name: format!("{} (webcam)", text(&entry.path().join("name"))),
        })
        .collect();
    found.sort_by(|a, b| a.uri.cmp(&b.uri));
    found
}

#[cfg(test)]
mod tests {
    use plumb_config::toml_file::parse_toml;

    use super::*;

    fn settings(text: &str) -> Result<WebcamSettings, String> {
        parse_toml(Path::new("rig.toml"), text).map_err(|error| error.to_string())
    }

    #[test]
    fn every_key_may_be_left_out() {
        assert_eq!(settings("").unwrap(), WebcamSettings::default());
        let chosen = settings("device = '/dev/video2'\nformat = 'MJPG'\nexposure = 0.004").unwrap();
        assert_eq!(chosen.format, Some(PixelFormat(*b"MJPG")));
        assert_eq!(chosen.exposure.map(CameraTime::get), Some(0.004));
    }

    #[test]
    fn a_pixel_format_has_four_characters() {
        for text in ["", "MJPEG", "MJ G", "MJÖ"] {
            let error = settings(&format!("format = '{text}'")).unwrap_err();
            assert!(error.contains("no pixel format"), "{error}");
        }
    }

    #[cfg(feature = "videoio")]
    #[test]
    fn keys_that_are_left_out_have_the_drivers_defaults() {
        let settings = WebcamSettings::default().device_settings();
        assert_eq!(settings, Settings::default());
    }

    #[test]
    fn the_first_device_of_each_camera_is_listed() {
        let folder = tempfile::tempdir().unwrap();
        for (device, index, name) in
            [("video2", "0", "A"), ("video0", "0", "HD Webcam"), ("video1", "1", "HD Webcam")]
        {
            let device = folder.path().join(device);
            fs::create_dir(&device).unwrap();
            fs::write(device.join("index"), format!("{index}\n")).unwrap();
            fs::write(device.join("name"), format!("{name}\n")).unwrap();
        }
        let found = list(folder.path());
        let found: Vec<_> = found.iter().map(|it| (it.uri.as_str(), it.name.as_str())).collect();
        assert_eq!(found, [("/dev/video0", "HD Webcam (webcam)"), ("/dev/video2", "A (webcam)")]);
        assert_eq!(list(&folder.path().join("absent")), []);
    }

    #[cfg(not(feature = "videoio"))]
    #[test]
    fn a_program_without_webcams_says_how_to_build_them() {
        use plumb_frame::camera::Intrinsics;

        let (fx, fy, cx, cy) = (525.0, 525.0, 319.5, 239.5);
        let intrinsics = Intrinsics { fx, fy, cx, cy, depth_scale: 0.0, distortion: None };
        let camera = Camera::new(intrinsics, nalgebra::Isometry3::identity(), 0.06);
        let error = WebcamSettings::default().open(&camera, None).err().unwrap().to_string();
        assert!(error.contains("--features webcam"), "{error}");
        let (uri, name) = ("/dev/video0".to_owned(), "A (webcam)".to_owned());
        let listing = listing(vec![FoundCamera { uri, name }]);
        assert_eq!(listing.cameras, []);
        assert!(listing.missing[0].starts_with("/dev/video0 (A (webcam)): "), "{listing:?}");
        assert!(listing.missing[0].contains("--features webcam"), "{listing:?}");
    }
}

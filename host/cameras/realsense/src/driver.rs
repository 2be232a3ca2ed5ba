//! Table `[camera.realsense]` of a rig file: settings and driver of Intel RealSense cameras through
//! librealsense2, which is loaded at run time.

use std::path::Path;

use plumb_config::quantity::{CameraTime, pixels, rate};
use plumb_frame::camera::Camera;
use plumb_frame::driver::{
    CameraDriver, DriverListing, FoundCamera, IntrinsicsFrom, LibraryState, OpenedSource,
};
use plumb_frame::source::BoxedError;
use serde::Deserialize;

use crate::error::RealsenseError;
use crate::library::RealSense;
use crate::settings::{Mode, Settings, Target};
use crate::source::open_source;

/// Settings of an Intel RealSense camera: table `[camera.realsense]` of a rig file. Every key may
/// be left out.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RealsenseSettings {
    /// Serial number of the camera, as `plumb cameras` prints it. Default: the first camera.
    pub serial: Option<String>,
    /// Columns of both pictures, pixels, 1 to 65535. Default: 640.
    #[serde(deserialize_with = "pixels")]
    pub width: u16,
    /// Rows of both pictures, pixels, 1 to 65535. Default: 480.
    #[serde(deserialize_with = "pixels")]
    pub height: u16,
    /// Frame rate, frames/s, 1 to 1000. Default: 30.
    #[serde(deserialize_with = "rate")]
    pub rate: u16,
    /// Exposure time of the colour sensor, seconds, above 0, to 10. Default: automatic.
    pub exposure: Option<CameraTime>,
    /// Whether the infrared projector is on. Default: as the camera has it.
    pub emitter: Option<bool>,
    /// Time from exposure to arrival of the fastest frame, seconds, above 0, to 10. Default:
    /// 0.045.
    pub latency: Option<CameraTime>,
    /// Origin of the intrinsics. Default: `"device"`, which the maker calibrated.
    pub intrinsics: IntrinsicsFrom,
}

impl Default for RealsenseSettings {
    /// Returns the settings of the first camera at 640x480 and 30 frames/s, with the device's
    /// intrinsics.
    fn default() -> Self {
        let Mode { width, height, rate } = Settings::default().mode;
        let (serial, exposure, emitter, latency) = (None, None, None, None);
        let intrinsics = IntrinsicsFrom::Device;
        Self { serial, width, height, rate, exposure, emitter, latency, intrinsics }
    }
}

impl RealsenseSettings {
    /// Returns the camera to open.
    pub fn target(&self) -> Target {
        self.serial.clone().map_or(Target::First, Target::Serial)
    }

    /// Returns what is to be set in the device.
    pub fn device_settings(&self) -> Settings {
        let usual = Settings::default();
        Settings {
            mode: Mode { width: self.width, height: self.height, rate: self.rate },
            exposure: self.exposure.map(CameraTime::get),
            emitter: self.emitter,
            latency: self.latency.map_or(usual.latency, CameraTime::get),
            ..usual
        }
    }
}

impl CameraDriver for RealsenseSettings {
    fn list(&self) -> DriverListing {
        DriverListing::of_library("librealsense2", list())
    }

    fn open(&self, camera: &Camera, _: Option<&Path>) -> Result<OpenedSource, BoxedError> {
        let calibrated = match self.intrinsics {
            IntrinsicsFrom::File => Some(camera.into()),
            IntrinsicsFrom::Device => None,
        };
        let (library, settings) = (RealSense::load()?, self.device_settings());
        let source = open_source(&library, &self.target(), settings, calibrated)?;
        let opened = source.camera.opened();
        let description = Some(format!("{} ({}), {}", opened.name, opened.id, opened.mode));
        let intrinsics = source.intrinsics;
        Ok(OpenedSource { description, ..OpenedSource::new(source, intrinsics) })
    }
}

/// Lists the cameras that librealsense2 can open.
fn list() -> Result<(LibraryState, Vec<FoundCamera>), RealsenseError> {
    let library = RealSense::load()?;
    let found = library.devices()?.into_iter();
    let cameras = found.map(|device| FoundCamera { uri: device.serial, name: device.name });
    let (version, drivers) = (library.version(), Vec::new());
    Ok((LibraryState::Loaded { version, drivers }, cameras.collect()))
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use plumb_config::toml_file::parse_toml;

    use super::*;

    fn settings(text: &str) -> RealsenseSettings {
        parse_toml(Path::new("rig.toml"), text).unwrap()
    }

    #[test]
    fn keys_that_are_left_out_have_the_librarys_defaults() {
        let absent = settings("");
        assert_eq!(absent.target(), Target::First);
        assert_eq!(absent.device_settings(), Settings::default());
        let chosen = settings("serial = '1'\nrate = 60\nexposure = 0.008\nemitter = false");
        assert_eq!(chosen.target(), Target::Serial("1".to_owned()));
        let mode = Mode { rate: 60, ..Settings::default().mode };
        let expected =
            Settings { mode, exposure: Some(0.008), emitter: Some(false), ..Settings::default() };
        assert_eq!(chosen.device_settings(), expected);
    }
}

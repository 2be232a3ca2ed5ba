//! Table `[camera.openni]` of a rig file: settings and driver of cameras through OpenNI2, which is
//! loaded at run time.

use std::path::{Path, PathBuf};

use plumb_config::quantity::{CameraTime, pixels, rate};
use plumb_frame::camera::Camera;
use plumb_frame::driver::{
    CameraDriver, DriverListing, FoundCamera, IntrinsicsFrom, LibraryState, OpenedSource,
};
use plumb_frame::source::BoxedError;
use serde::Deserialize;

use crate::error::OpenniError;
use crate::library::{DeviceInfo, OpenNi};
use crate::settings::{Settings, Target};
use crate::source::{IntrinsicsSource, open_source};

/// Settings of a camera through OpenNI2: table `[camera.openni]` of a rig file. Every key may be
/// left out.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct OpenniSettings {
    /// URI of the camera, as `plumb cameras` prints it. Default: the first camera.
    pub uri: Option<String>,
    /// Columns of both images, pixels, 1 to 65535. Default: 640.
    #[serde(deserialize_with = "pixels")]
    pub width: u16,
    /// Rows of both images, pixels, 1 to 65535. Default: 480.
    #[serde(deserialize_with = "pixels")]
    pub height: u16,
    /// Frame rate, frames/s, 1 to 1000. Default: 30.
    #[serde(deserialize_with = "rate")]
    pub rate: u16,
    /// Time from exposure to arrival of the fastest frame, seconds, above 0, to 10. Default:
    /// 0.045.
    pub latency: Option<CameraTime>,
    /// Origin of the intrinsics. Default: `"file"`.
    pub intrinsics: IntrinsicsFrom,
}

impl Default for OpenniSettings {
    /// Returns the settings of the first camera at 640x480 and 30 frames/s, with the camera file's
    /// intrinsics.
    fn default() -> Self {
        let Settings { width, height, rate, .. } = Settings::default();
        Self { uri: None, width, height, rate, latency: None, intrinsics: IntrinsicsFrom::File }
    }
}

impl OpenniSettings {
    /// Returns the camera to open.
    pub fn target(&self) -> Target {
        self.uri.clone().map_or(Target::First, Target::Uri)
    }

    /// Returns the mode to set, and the `.oni` file that the device also records to.
    pub fn device_settings(&self, record: Option<PathBuf>) -> Settings {
        let usual = Settings::default();
        Settings {
            width: self.width,
            height: self.height,
            rate: self.rate,
            latency: self.latency.map_or(usual.latency, CameraTime::get),
            record,
            ..usual
        }
    }
}

impl CameraDriver for OpenniSettings {
    fn list(&self) -> DriverListing {
        DriverListing::of_library("OpenNI2", list())
    }

    fn open(&self, camera: &Camera, recording: Option<&Path>) -> Result<OpenedSource, BoxedError> {
        let intrinsics = match self.intrinsics {
            IntrinsicsFrom::File => IntrinsicsSource::Calibrated(camera.into()),
            IntrinsicsFrom::Device => IntrinsicsSource::FieldOfView,
        };
        let settings = self.device_settings(recording.map(Path::to_owned));
        let source = open_source(&OpenNi::load()?, &self.target(), settings, intrinsics)?;
        let opened = source.camera.opened();
        let description = Some(format!("{} ({}), {}", opened.name, opened.uri, opened.mode));
        let (notes, intrinsics) = (opened.notes.clone(), source.intrinsics);
        Ok(OpenedSource { description, notes, ..OpenedSource::new(source, intrinsics) })
    }
}

/// Lists the cameras that OpenNI2 can open.
fn list() -> Result<(LibraryState, Vec<FoundCamera>), OpenniError> {
    let openni = OpenNi::load()?;
    let cameras = openni.devices()?.into_iter().map(found).collect();
    let drivers = openni.drivers();
    let names = drivers.iter().filter_map(|path| path.file_name());
    let drivers = names.map(|name| name.to_string_lossy().into_owned()).collect();
    Ok((LibraryState::Loaded { version: openni.version(), drivers }, cameras))
}

fn found(device: DeviceInfo) -> FoundCamera {
    let name = format!("{} {}", device.vendor, device.name).trim().to_owned();
    FoundCamera { uri: device.uri, name }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use plumb_config::toml_file::parse_toml;

    use super::*;

    fn settings(text: &str) -> OpenniSettings {
        parse_toml(Path::new("rig.toml"), text).unwrap()
    }

    #[test]
    fn keys_that_are_left_out_have_the_librarys_defaults() {
        let absent = settings("");
        assert_eq!(absent.target(), Target::First);
        assert_eq!(absent.device_settings(None), Settings::default());
        let chosen = settings("rate = 60\nuri = 'x'\nlatency = 0.02");
        assert_eq!(chosen.target(), Target::Uri("x".to_owned()));
        let expected = Settings { rate: 60, latency: 0.02, ..Settings::default() };
        assert_eq!(chosen.device_settings(None), expected);
    }
}

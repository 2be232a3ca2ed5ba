//! Table `[camera.openni]` of a rig file.

use std::path::PathBuf;

use plumb_openni::{Settings, Target};
use serde::Deserialize;

use plumb_config::quantity::{CameraTime, pixels, rate};

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
    /// Time from exposure to the earliest arrival of a frame, seconds, above 0, to 10. Default:
    /// 0.045.
    pub latency: Option<CameraTime>,
    /// Origin of the intrinsics. Default: `"file"`.
    pub intrinsics: IntrinsicsFrom,
}

/// Origin of a camera's intrinsics.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum IntrinsicsFrom {
    /// The camera file: calibrated.
    #[default]
    File,
    /// The device: of OpenNI2 the field of view that it was designed for.
    Device,
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

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use plumb_config::toml_file::parse_toml;

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

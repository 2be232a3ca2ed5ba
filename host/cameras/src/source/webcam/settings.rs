//! Table `[camera.webcam]` of a rig file.

use serde::Deserialize;
use thiserror::Error;

use plumb_config::quantity::{CameraGain, CameraTime, pixels, rate};

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
    /// Time from exposure to the earliest arrival of a frame, seconds, above 0, to 10. Default:
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

#[cfg(feature = "webcam")]
impl WebcamSettings {
    /// Returns what is to be set in the device.
    pub(crate) fn device_settings(&self) -> plumb_webcam::Settings {
        let usual = plumb_webcam::Settings::default();
        let [width, height] = [self.width, self.height].map(usize::from);
        plumb_webcam::Settings {
            device: plumb_webcam::device_path(&self.device),
            mode: plumb_webcam::Mode { width, height, rate: self.rate.into() },
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

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use plumb_config::toml_file::parse_toml;

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

    #[cfg(feature = "webcam")]
    #[test]
    fn keys_that_are_left_out_have_the_drivers_defaults() {
        let settings = WebcamSettings::default().device_settings();
        assert_eq!(settings, plumb_webcam::Settings::default());
    }
}

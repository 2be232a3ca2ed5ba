//! Settings of webcams: table `[camera.webcam]` of a rig file.

use plumb_config::quantity::{CameraGain, CameraTime, ColourTemperature, pixels, rate};
use serde::Deserialize;

/// Settings of a webcam: table `[camera.webcam]` of a rig file. Every key may be left out.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct WebcamSettings {
    /// Path or number of the device, "/dev/v4l/by-id/..." or "0". Default: the only camera.
    pub device: Option<String>,
    /// Columns of the picture, pixels, 1 to 65535. Default: 640.
    #[serde(deserialize_with = "pixels")]
    pub width: u16,
    /// Rows of the picture, pixels, 1 to 65535. Default: 480.
    #[serde(deserialize_with = "pixels")]
    pub height: u16,
    /// Frame rate, frames/s, 1 to 1000. Default: 30.
    #[serde(deserialize_with = "rate")]
    pub rate: u16,
    /// Pixel format. Default: MJPG, or YUYV of a camera that has no MJPG.
    pub format: Option<PixelFormat>,
    /// Exposure time, seconds, above 0, to 10. Default: automatic.
    pub exposure: Option<CameraTime>,
    /// Gain, in the units of the camera's driver, within ±1e6. Default: as the camera has it.
    pub gain: Option<CameraGain>,
    /// Focus, in the units of the camera's driver, within ±1e6. Default: as the camera has it.
    pub focus: Option<CameraGain>,
    /// White balance, kelvin, 1000 to 20000. Default: what the camera finds when it is opened.
    pub white_balance: Option<ColourTemperature>,
    /// Frequency of the light. Default: as the camera has it.
    pub power_line: Option<PowerLine>,
    /// Time from exposure to arrival of the fastest frame, seconds, above 0, to 10. Default: the
    /// time of a frame is its time stamp.
    pub latency: Option<CameraTime>,
}

impl Default for WebcamSettings {
    /// Returns the settings of the only webcam at 640x480 and 30 frames/s.
    fn default() -> Self {
        Self {
            device: None,
            width: 640,
            height: 480,
            rate: 30,
            format: None,
            exposure: None,
            gain: None,
            focus: None,
            white_balance: None,
            power_line: None,
            latency: None,
        }
    }
}

/// Pixel format of V4L2 that is read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
pub enum PixelFormat {
    /// JPEG pictures.
    #[serde(rename = "MJPG")]
    Mjpg,
    /// Luma and chroma, 4:2:2.
    #[serde(rename = "YUYV")]
    Yuyv,
}

impl PixelFormat {
    /// Returns the four characters by which V4L2 names the format.
    pub(crate) fn code(self) -> [u8; 4] {
        match self {
            Self::Mjpg => *b"MJPG",
            Self::Yuyv => *b"YUYV",
        }
    }

    /// Returns the format of this name; `None` for one that is not read.
    pub(crate) fn of_code(code: [u8; 4]) -> Option<Self> {
        [Self::Mjpg, Self::Yuyv].into_iter().find(|format| format.code() == code)
    }
}

/// Frequency of the light, which flickers at twice as much.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
pub enum PowerLine {
    /// 50 Hz.
    #[serde(rename = "50 Hz")]
    Hz50 = 1,
    /// 60 Hz.
    #[serde(rename = "60 Hz")]
    Hz60,
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use plumb_config::toml_file::parse_toml;

    use super::*;

    fn settings(text: &str) -> Result<WebcamSettings, String> {
        parse_toml(Path::new("rig.toml"), text).map_err(|error| error.to_string())
    }

    #[test]
    fn every_key_may_be_left_out() {
        assert_eq!(settings("").unwrap(), WebcamSettings::default());
        let text = "device = '/dev/video2'\nformat = 'MJPG'\nexposure = 0.004\n\
                    power_line = '50 Hz'\nfocus = 30\nwhite_balance = 4000";
        let chosen = settings(text).unwrap();
        assert_eq!(chosen.format, Some(PixelFormat::Mjpg));
        assert_eq!(chosen.exposure.map(CameraTime::get), Some(0.004));
        assert_eq!(chosen.power_line, Some(PowerLine::Hz50));
    }

    #[test]
    fn a_pixel_format_is_one_that_is_read() {
        for text in ["", "MJPEG", "NV12"] {
            let error = settings(&format!("format = '{text}'")).unwrap_err();
            assert!(error.contains("`MJPG`") && error.contains("`YUYV`"), "{error}");
        }
    }
}

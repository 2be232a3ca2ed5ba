//! Settings of a webcam.

use std::fmt;
use std::path::PathBuf;

/// Size and rate of pictures.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mode {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Pictures per second; 0 where it is unknown.
    pub rate: f64,
}

impl fmt::Display for Mode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}x{}", self.width, self.height)?;
        if self.rate > 0.0 { write!(f, " at {} Hz", self.rate) } else { Ok(()) }
    }
}

/// Settings of a webcam.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Path of the device.
    pub device: PathBuf,
    /// Size and rate.
    pub mode: Mode,
    /// Pixel format of V4L2, "MJPG" or "YUYV"; `None` leaves the choice to the driver.
    pub format: Option<[u8; 4]>,
    /// Exposure time, seconds; `None` leaves it as it is.
    pub exposure: Option<f64>,
    /// Gain in the driver's units; `None` leaves it as it is.
    pub gain: Option<f64>,
    /// Time from exposure to arrival of the fastest picture, seconds; see
    /// [`HostClock`](plumb_frame::clock::HostClock).
    pub latency: f64,
}

impl Default for Settings {
    /// Returns the first device at 640x480 and 30 Hz with a latency of 50 ms, which is a guess: one
    /// and a half periods.
    fn default() -> Self {
        Self {
            device: device_path("0"),
            mode: Mode { width: 640, height: 480, rate: 30.0 },
            format: None,
            exposure: None,
            gain: None,
            latency: 0.05,
        }
    }
}

/// Returns the path of a device that is named by its number ("0" is `/dev/video0`) or by its path.
pub fn device_path(name: &str) -> PathBuf {
    match name.parse::<u16>() {
        Ok(number) => PathBuf::from(format!("/dev/video{number}")),
        Err(_) => PathBuf::from(name),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_device_is_named_by_number_or_path() {
        assert_eq!(device_path("2"), PathBuf::from("/dev/video2"));
        let path = "/dev/v4l/by-id/usb-046d_HD_Webcam-video-index0";
        assert_eq!(device_path(path), PathBuf::from(path));
    }
}

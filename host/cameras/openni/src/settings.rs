//! Settings of a camera, and the description of an open one.

use std::path::PathBuf;
use std::time::Duration;

use crate::mode::{DepthUnit, Mode};

/// Camera or recording to open.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Target {
    /// The first camera that is plugged in.
    First,
    /// The camera of this URI, as [`OpenNi::devices`](crate::OpenNi::devices) lists them.
    Uri(String),
    /// An `.oni` file, which is read once, picture by picture.
    Recording(PathBuf),
}

impl Target {
    /// Returns the name of the target for messages.
    pub(crate) fn name(&self) -> String {
        match self {
            Self::First => "the first camera".to_owned(),
            Self::Uri(uri) => uri.clone(),
            Self::Recording(path) => path.display().to_string(),
        }
    }

    /// Returns whether the target is a recording.
    pub(crate) fn is_recording(&self) -> bool {
        matches!(self, Self::Recording(_))
    }
}

/// Timeouts of a camera.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Timeouts {
    /// Longest time to open and start a camera.
    pub open: Duration,
    /// Longest time to the next picture.
    pub picture: Duration,
    /// Longest time to stop and close a camera.
    pub close: Duration,
}

impl Default for Timeouts {
    /// Returns 20 s, 2 s and 5 s: a Carmine's firmware may take seconds to start.
    fn default() -> Self {
        Self {
            open: Duration::from_secs(20),
            picture: Duration::from_secs(2),
            close: Duration::from_secs(5),
        }
    }
}

/// Settings of a camera. Of a recording only the timeouts count.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Columns of both pictures.
    pub width: u16,
    /// Rows of both pictures.
    pub height: u16,
    /// Pairs per second.
    pub rate: u16,
    /// Time from exposure to the earliest arrival of a picture, seconds; see
    /// [`HostClock`](plumb_timing::HostClock).
    pub latency: f64,
    /// File for the device's own `.oni` recording.
    pub record: Option<PathBuf>,
    /// Timeouts.
    pub timeouts: Timeouts,
}

impl Default for Settings {
    /// Returns 640x480 at 30 Hz with a latency of 45 ms, not recorded. The latency is the one
    /// reported for PrimeSense cameras; it has not been measured.
    fn default() -> Self {
        let (record, timeouts) = (None, Timeouts::default());
        Self { width: 640, height: 480, rate: 30, latency: 0.045, record, timeouts }
    }
}

/// Description of an open camera or recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Opened {
    /// URI of the camera, path of the recording.
    pub uri: String,
    /// Maker and model.
    pub name: String,
    /// Size and rate of the pictures.
    pub mode: Mode,
    /// Unit of depth.
    pub unit: DepthUnit,
    /// Horizontal and vertical field of view of the colour picture, radians; `None` where the
    /// device does not state it.
    pub field_of_view: Option<(f64, f64)>,
    /// Settings that the device does not support, and their consequences.
    pub notes: Vec<String>,
}

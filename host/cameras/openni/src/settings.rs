//! Settings of a camera, the modes of its streams, and the description of an open one.

use core::ffi::c_int;
use std::fmt;
use std::path::PathBuf;
use std::time::Duration;

use plumb_frame::image::ImageSize;
use plumb_frame::pairing::Sensor;

use crate::sys;

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
    /// Longest time to stop and close a camera, since its recording has grown last.
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
    /// Time from exposure to arrival of the fastest picture, seconds; see
    /// [`HostClock`](plumb_frame::clock::HostClock).
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

/// Returns the library's number of `sensor`.
pub(crate) fn sensor_number(sensor: Sensor) -> c_int {
    match sensor {
        Sensor::Colour => sys::SENSOR_COLOUR,
        Sensor::Depth => sys::SENSOR_DEPTH,
    }
}

/// Returns the library's numbers of the supported pixel formats of `sensor`, the preferred one
/// first.
pub(crate) fn formats(sensor: Sensor) -> &'static [c_int] {
    match sensor {
        Sensor::Colour => &[sys::FORMAT_RGB888],
        Sensor::Depth => &[sys::FORMAT_DEPTH_1_MM, sys::FORMAT_DEPTH_100_UM],
    }
}

/// Unit of depth.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DepthUnit {
    /// A millimetre.
    Millimetre,
    /// A tenth of a millimetre.
    Tenth,
}

impl DepthUnit {
    /// Returns the units in a metre.
    pub fn per_metre(self) -> f64 {
        match self {
            Self::Millimetre => 1_000.0,
            Self::Tenth => 10_000.0,
        }
    }
}

/// Size, rate and format of a stream.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Mode {
    /// Columns.
    pub width: u16,
    /// Rows.
    pub height: u16,
    /// Pictures per second.
    pub rate: u16,
    /// The library's number of the pixel format.
    pub format: i32,
}

impl Mode {
    /// Returns the size of the pictures.
    pub fn size(&self) -> ImageSize {
        ImageSize { width: self.width.into(), height: self.height.into() }
    }

    /// Returns the library's form of the mode.
    pub(crate) fn raw(&self) -> sys::OniVideoMode {
        sys::OniVideoMode {
            pixel_format: self.format,
            resolution_x: self.width.into(),
            resolution_y: self.height.into(),
            fps: self.rate.into(),
        }
    }

    /// Converts the library's form; `None` where it has no pixels or a rate out of range.
    pub(crate) fn from_raw(raw: &sys::OniVideoMode) -> Option<Self> {
        let size = |value: i32| u16::try_from(value).ok().filter(|&value| value > 0);
        Some(Self {
            width: size(raw.resolution_x)?,
            height: size(raw.resolution_y)?,
            rate: u16::try_from(raw.fps).ok()?,
            format: raw.pixel_format,
        })
    }

    /// Returns the bytes of a pixel; `None` for an unsupported format.
    pub(crate) fn bytes_per_pixel(&self) -> Option<usize> {
        match self.format {
            sys::FORMAT_RGB888 => Some(3),
            sys::FORMAT_DEPTH_1_MM | sys::FORMAT_DEPTH_100_UM => Some(2),
            _ => None,
        }
    }

    /// Returns whether pictures of `other` have the same number of rows and columns.
    pub fn same_size(&self, other: &Self) -> bool {
        (self.width, self.height) == (other.width, other.height)
    }
}

impl fmt::Display for Mode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}x{} at {} Hz", self.width, self.height, self.rate)?;
        match self.format {
            sys::FORMAT_RGB888 | sys::FORMAT_DEPTH_1_MM => Ok(()),
            sys::FORMAT_DEPTH_100_UM => f.write_str(" in 0.1 mm"),
            201 | 205 => f.write_str(" in YUV"),
            202 | 203 => f.write_str(" in grey"),
            204 => f.write_str(" in JPEG"),
            102 | 103 => f.write_str(" in shifts"),
            other => write!(f, " in format {other}"),
        }
    }
}

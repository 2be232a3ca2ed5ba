//! Errors of cameras and recordings.

use std::path::PathBuf;

use plumb_frame::pairing::Sensor;
use thiserror::Error;

use crate::settings::Mode;
use crate::sys::LIBRARY_VARIABLE;

/// Failure to load librealsense2, to open a camera or a recording, or to read it.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum RealsenseError {
    /// The library is not installed.
    #[error(
        "librealsense2 is not installed: install the package librealsense2 from Intel's \
         repository, or fetch the Python wheel (pip install pyrealsense2) and give the path of \
         its pyrealsense2.*.so in the environment variable {LIBRARY_VARIABLE} ({}: {error})",
        .path.display()
    )]
    NoLibrary {
        /// Path or name that was loaded.
        path: PathBuf,
        /// Error of the system.
        error: String,
    },
    /// The file is another library, or lacks a function.
    #[error("{}: this is not librealsense 2.50 or later: it has no {function}", .path.display())]
    NotRealsense {
        /// The library.
        path: PathBuf,
        /// Function that it lacks.
        function: String,
    },
    /// The library has an interface that this program does not know.
    #[error(
        "{}: this is librealsense {version}, but Plumb needs 2.50 or a later version of 2",
        .path.display()
    )]
    Version {
        /// The library.
        path: PathBuf,
        /// Its version.
        version: String,
    },
    /// The library cannot be initialised or cannot list its cameras.
    #[error("librealsense2 fails: {error}")]
    Library {
        /// Message of the library.
        error: String,
    },
    /// No camera is plugged in.
    #[error(
        "no RealSense camera is plugged in; `plumb cameras` lists what is there and what is \
         missing"
    )]
    NoDevice,
    /// No camera has this serial number.
    #[error("no RealSense camera with the serial number {serial} is plugged in; {found}")]
    NoSerial {
        /// Serial number that was asked for.
        serial: String,
        /// Cameras that are plugged in.
        found: String,
    },
    /// The camera or recording cannot be opened.
    #[error("{id}: cannot be opened: {error}")]
    Open {
        /// Serial number of the camera, or path of the recording.
        id: String,
        /// Reason.
        error: String,
    },
    /// The library does not return from opening the camera.
    #[error(
        "{id}: librealsense2 did not open it within {seconds:.0} s; unplug the camera, plug it \
         into a USB 3 port and start again"
    )]
    Hangs {
        /// Serial number of the camera, or path of the recording.
        id: String,
        /// Time limit, seconds.
        seconds: f64,
    },
    /// The camera or recording lacks a sensor with a supported format.
    #[error("{id}: has no {sensor} pictures as {format}")]
    NoSensor {
        /// Serial number of the camera, or path of the recording.
        id: String,
        /// Sensor that is missing.
        sensor: Sensor,
        /// Format that it must have.
        format: &'static str,
    },
    /// The sensor does not have the mode that was asked for.
    #[error("{id}: has no {sensor} pictures of {wanted}; it has {}", list(.has))]
    NoMode {
        /// Serial number of the camera.
        id: String,
        /// Sensor.
        sensor: Sensor,
        /// Mode that was asked for.
        wanted: Mode,
        /// Modes that the sensor has.
        has: Vec<Mode>,
    },
    /// The camera does not accept a setting.
    #[error("{id}: {what}: {error}")]
    Setting {
        /// Serial number of the camera.
        id: String,
        /// Setting.
        what: &'static str,
        /// Reason.
        error: String,
    },
    /// The camera states a unit of depth that no camera has.
    #[error(
        "{id}: its unit of depth is {unit} m, which is not between 1 µm and 10 mm; set the \
         camera's depth units in realsense-viewer"
    )]
    DepthUnit {
        /// Serial number of the camera, or path of the recording.
        id: String,
        /// Stated unit, metres.
        unit: f64,
    },
    /// A picture has another unit of depth than its camera.
    #[error(
        "a depth picture is in units of {unit} m, but the camera stated {expected} m when it was \
         opened: did another program change its settings?"
    )]
    OtherDepthUnit {
        /// Unit of the picture, metres.
        unit: f64,
        /// Unit of the camera, metres.
        expected: f64,
    },
    /// A picture has another size than the mode that was set.
    #[error("a {sensor} picture is {width}x{height}, not {expected}")]
    Picture {
        /// Sensor of the picture.
        sensor: Sensor,
        /// Its columns.
        width: i32,
        /// Its rows.
        height: i32,
        /// Mode that was set.
        expected: Mode,
    },
    /// Colour and depth are stamped by different clocks.
    #[error(
        "colour and depth pictures are stamped by different clocks, so that they cannot be \
         paired"
    )]
    Clocks,
    /// A picture has no counterpart.
    #[error("a {sensor} picture has no {} picture within {:.0} ms", .sensor.other(), 1e3 * .within)]
    Unpaired {
        /// Sensor of the picture.
        sensor: Sensor,
        /// Time stamp, seconds on the clock of the pairs.
        time: f64,
        /// Largest difference of the time stamps of a pair, seconds.
        within: f64,
    },
    /// A call failed while the camera was read.
    #[error("{id}: {what}: {error}")]
    Read {
        /// Serial number of the camera, or path of the recording.
        id: String,
        /// What failed.
        what: &'static str,
        /// Message of the library.
        error: String,
    },
    /// The camera was unplugged.
    #[error("{id}: the camera was unplugged")]
    Unplugged {
        /// Serial number.
        id: String,
    },
    /// No picture came for too long.
    #[error("{id}: no picture for {seconds:.1} s; check the cable and the USB port (USB 3)")]
    Silent {
        /// Serial number of the camera, or path of the recording.
        id: String,
        /// Time without a picture.
        seconds: f64,
    },
}

impl RealsenseError {
    /// Returns whether the next picture may come all the same.
    pub fn is_transient(&self) -> bool {
        matches!(
            self,
            Self::Unpaired { .. }
                | Self::Clocks
                | Self::Picture { .. }
                | Self::OtherDepthUnit { .. }
        )
    }
}

/// Lists modes for a message.
fn list(modes: &[Mode]) -> String {
    let modes: Vec<String> = modes.iter().map(Mode::to_string).collect();
    if modes.is_empty() { "none".to_owned() } else { modes.join(", ") }
}

//! Errors of cameras and recordings.

use std::path::PathBuf;

use plumb_frame::pairing::Sensor;
use thiserror::Error;

use crate::settings::Mode;
use crate::sys::LIBRARY_VARIABLE;

/// Failure to load OpenNI2, to open a camera or a recording, or to read it.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum OpenniError {
    /// The library is not installed.
    #[error(
        "OpenNI2 is not installed: on Debian and Ubuntu install the package libopenni2-0 \
         (apt-get install libopenni2-0), elsewhere give the path of libOpenNI2.so.0 in the \
         environment variable {LIBRARY_VARIABLE} ({}: {error})",
        .path.display()
    )]
    NoLibrary {
        /// Path or name that was loaded.
        path: PathBuf,
        /// Error of the system.
        error: String,
    },
    /// The file is another library, or an older version.
    #[error("{}: this is not OpenNI 2.2 or later: {error}", .path.display())]
    NotOpenni {
        /// The library.
        path: PathBuf,
        /// Function that it lacks.
        error: String,
    },
    /// The library cannot be initialised, mostly because it finds no drivers.
    #[error(
        "{}: OpenNI2 cannot be initialised: {error}. Its drivers belong into the folder \
         OpenNI2/Drivers beside it",
        .path.display()
    )]
    Initialize {
        /// The library.
        path: PathBuf,
        /// Message of the library.
        error: String,
    },
    /// No camera is plugged in that has a driver.
    #[error(
        "no camera is plugged in that OpenNI2 has a driver for; `plumb cameras` lists what \
         is there and what is missing"
    )]
    NoDevice,
    /// The camera or recording cannot be opened.
    #[error("{uri}: cannot be opened: {error}")]
    Open {
        /// URI of the camera, or path of the recording.
        uri: String,
        /// Reason.
        error: String,
    },
    /// The camera or recording lacks a sensor.
    #[error("{uri}: has no {sensor} picture")]
    NoSensor {
        /// URI of the camera, or path of the recording.
        uri: String,
        /// Missing sensor.
        sensor: Sensor,
    },
    /// The camera lacks the mode of the settings.
    #[error("{uri}: its {sensor} camera has no mode {wanted}; it has {}", list(.has))]
    NoMode {
        /// URI of the camera, or path of the recording.
        uri: String,
        /// Sensor of the picture.
        sensor: Sensor,
        /// Mode of the settings.
        wanted: Mode,
        /// Modes of the camera.
        has: Vec<Mode>,
    },
    /// A setting failed.
    #[error("{uri}: {what} could not be set: {error}")]
    Setting {
        /// URI of the camera, or path of the recording.
        uri: String,
        /// The setting.
        what: &'static str,
        /// Result of the attempt.
        error: String,
    },
    /// Colour and depth of a recording differ in size.
    #[error(
        "{uri}: colour is {colour} but depth {depth}: depth must be registered to colour, and \
         of its size"
    )]
    Sizes {
        /// URI of the camera, or path of the recording.
        uri: String,
        /// Mode of the colour stream.
        colour: Mode,
        /// Mode of the depth stream.
        depth: Mode,
    },
    /// A picture does not have the stream's mode.
    #[error(
        "a {sensor} picture of {width}x{height} pixels and {bytes} bytes where {expected} was set"
    )]
    Picture {
        /// Sensor of the picture.
        sensor: Sensor,
        /// Columns of the picture.
        width: i32,
        /// Rows of the picture.
        height: i32,
        /// Bytes of the picture.
        bytes: i32,
        /// Mode of the stream.
        expected: Mode,
    },
    /// A picture has no counterpart in time.
    #[error(
        "a {sensor} picture at {time:.6} s without {} within {:.0} ms: colour and depth are out of \
         step or one of them is lost",
        .sensor.other(),
        .within * 1e3
    )]
    Unpaired {
        /// Sensor of the picture.
        sensor: Sensor,
        /// Time stamp of the picture, seconds.
        time: f64,
        /// Largest difference of the time stamps of a pair, seconds.
        within: f64,
    },
    /// Colour and depth of a pair have different numbers: they are of different moments.
    #[error(
        "colour picture {colour} and depth picture {depth} at {time:.6} s: colour and \
         depth are out of step"
    )]
    OutOfStep {
        /// Number of the colour picture.
        colour: i32,
        /// Number of the depth picture.
        depth: i32,
        /// Time stamp of the colour picture, seconds.
        time: f64,
    },
    /// Pictures of a recording are missing.
    #[error("{count} {sensor} pictures of the recording before {time:.6} s were lost on the way")]
    Skipped {
        /// Sensor of the picture.
        sensor: Sensor,
        /// Number of missing pictures.
        count: i32,
        /// Time stamp of the next picture, seconds.
        time: f64,
    },
    /// The camera was unplugged.
    #[error("{uri}: the camera was unplugged")]
    Unplugged {
        /// URI of the camera, or path of the recording.
        uri: String,
    },
    /// The camera delivers no pictures any more.
    #[error("{uri}: no picture for {seconds:.1} s")]
    Silent {
        /// URI of the camera, or path of the recording.
        uri: String,
        /// Time without a picture, seconds.
        seconds: f64,
    },
    /// A recording has fewer pictures than its header states.
    #[error("{uri}: damaged: {got} of {promised} {sensor} pictures could be read")]
    Truncated {
        /// URI of the camera, or path of the recording.
        uri: String,
        /// Sensor of the picture.
        sensor: Sensor,
        /// Pictures that were read.
        got: i32,
        /// Pictures that its header states.
        promised: i32,
    },
    /// A call into the library does not return.
    #[error(
        "{uri}: OpenNI2 does not return from {what} ({seconds:.0} s); unplug the camera and \
         plug it in again"
    )]
    Unresponsive {
        /// URI of the camera, or path of the recording.
        uri: String,
        /// The call.
        what: &'static str,
        /// Time waited, seconds.
        seconds: f64,
    },
    /// The device's own recording failed.
    #[error("{}: cannot be recorded to: {error}", .path.display())]
    Record {
        /// The file.
        path: PathBuf,
        /// Reason.
        error: String,
    },
}

impl OpenniError {
    /// Returns whether only single pictures are lost: the next one may be good.
    pub fn is_transient(&self) -> bool {
        matches!(
            self,
            Self::Picture { .. }
                | Self::Unpaired { .. }
                | Self::OutOfStep { .. }
                | Self::Skipped { .. }
        )
    }
}

/// Formats modes as "640x480 at 30 Hz, 320x240 at 30 Hz", or "none".
fn list(modes: &[Mode]) -> String {
    let texts: Vec<String> = modes.iter().map(Mode::to_string).collect();
    if texts.is_empty() { "none".to_owned() } else { texts.join(", ") }
}

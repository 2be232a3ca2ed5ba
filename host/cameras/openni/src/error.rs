//! What can go wrong with a camera or a recording.

use std::path::PathBuf;

use thiserror::Error;

use crate::{Mode, Sensor};

/// Why there is no camera, or no picture of it.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum OpenniError {
    /// The library is not installed.
    #[error("OpenNI2 is not there: on Debian and Ubuntu install the package libopenni2-0 (apt-get install libopenni2-0), elsewhere give the path of libOpenNI2.so.0 in the environment variable {} ({}: {error})", crate::LIBRARY_VARIABLE, .path.display())]
    NoLibrary {
        /// What was looked for.
        path: PathBuf,
        /// What the system said.
        error: String,
    },
    /// The library is another one, or too old.
    #[error("{}: this is not OpenNI 2.2 or later: {error}", .path.display())]
    NotOpenni {
        /// The library.
        path: PathBuf,
        /// What it lacks.
        error: String,
    },
    /// The library does not begin: mostly, it has no drivers.
    #[error("{}: OpenNI2 does not begin: {error}. Its drivers belong into the folder OpenNI2/Drivers beside it", .path.display())]
    Initialize {
        /// The library.
        path: PathBuf,
        /// What it said.
        error: String,
    },
    /// Nothing is plugged in that a driver knows.
    #[error(
        "no camera is plugged in that OpenNI2 has a driver for; `plumb cameras` says what is there and what is missing"
    )]
    NoDevice,
    /// A camera or a recording cannot be opened.
    #[error("{uri}: cannot be opened: {error}")]
    Open {
        /// Which.
        uri: String,
        /// Why not.
        error: String,
    },
    /// It has no such sensor.
    #[error("{uri}: has no {sensor} picture")]
    NoSensor {
        /// Which.
        uri: String,
        /// What it lacks.
        sensor: Sensor,
    },
    /// It cannot give what was asked for.
    #[error("{uri}: its {sensor} camera has no mode {wanted}; it has {}", list(.has))]
    NoMode {
        /// Which.
        uri: String,
        /// Of which sensor.
        sensor: Sensor,
        /// What was asked for.
        wanted: Mode,
        /// What there is.
        has: Vec<Mode>,
    },
    /// It does not do what it was told.
    #[error("{uri}: {what} could not be set: {error}")]
    Setting {
        /// Which.
        uri: String,
        /// What was to be set.
        what: &'static str,
        /// What came of it.
        error: String,
    },
    /// Colour and depth of a recording do not belong together.
    #[error(
        "{uri}: colour is {colour} but depth {depth}: depth must be registered to colour, and of its size"
    )]
    Sizes {
        /// Which.
        uri: String,
        /// The colour stream.
        colour: Mode,
        /// The depth stream.
        depth: Mode,
    },
    /// A picture that is not of the stream's size.
    #[error(
        "a {sensor} picture of {width}x{height} pixels and {bytes} bytes where {expected} was set"
    )]
    Picture {
        /// Of which sensor.
        sensor: Sensor,
        /// Its columns.
        width: i32,
        /// Its rows.
        height: i32,
        /// Its bytes.
        bytes: i32,
        /// What was set.
        expected: Mode,
    },
    /// A picture without its counterpart.
    #[error("a {sensor} picture at {time:.6} s without {} within {:.0} ms: colour and depth are out of step or one of them is lost", .sensor.other(), .within * 1e3)]
    Alone {
        /// Of which sensor.
        sensor: Sensor,
        /// When it was taken, seconds.
        time: f64,
        /// How far apart a pair may be, seconds.
        within: f64,
    },
    /// A colour picture with the depth of another moment.
    #[error(
        "colour picture {colour} and depth picture {depth} at {time:.6} s: colour and depth are out of step"
    )]
    OutOfStep {
        /// Number of the colour picture.
        colour: i32,
        /// Number of the depth picture.
        depth: i32,
        /// When the colour picture was taken, seconds.
        time: f64,
    },
    /// Frames of a recording that were not handed over.
    #[error("{count} {sensor} pictures of the recording before {time:.6} s were lost on the way")]
    Skipped {
        /// Of which sensor.
        sensor: Sensor,
        /// How many.
        count: i32,
        /// When the next one was taken, seconds.
        time: f64,
    },
    /// The camera is gone.
    #[error("{uri}: the camera was unplugged")]
    Unplugged {
        /// Which.
        uri: String,
    },
    /// It gives nothing any more.
    #[error("{uri}: no picture for {seconds:.1} s")]
    Silent {
        /// Which.
        uri: String,
        /// How long.
        seconds: f64,
    },
    /// A recording ends before its end.
    #[error("{uri}: damaged: {got} of {promised} {sensor} pictures could be read")]
    Truncated {
        /// Which.
        uri: String,
        /// Of which sensor.
        sensor: Sensor,
        /// Pictures read.
        got: i32,
        /// Pictures that its header promises.
        promised: i32,
    },
    /// A call into the library does not come back.
    #[error(
        "{uri}: OpenNI2 does not come back from {what} ({seconds:.0} s); unplug the camera and plug it in again"
    )]
    Stuck {
        /// Which.
        uri: String,
        /// From what.
        what: &'static str,
        /// How long it was waited for.
        seconds: f64,
    },
    /// A recording could not be made.
    #[error("{}: cannot be recorded to: {error}", .path.display())]
    Record {
        /// The file.
        path: PathBuf,
        /// Why not.
        error: String,
    },
}

impl OpenniError {
    /// Whether it is about one picture, and the next may come as if nothing had been.
    pub fn is_passing(&self) -> bool {
        matches!(
            self,
            Self::Picture { .. }
                | Self::Alone { .. }
                | Self::OutOfStep { .. }
                | Self::Skipped { .. }
        )
    }
}

/// "640x480 at 30 Hz, 320x240 at 30 Hz", or "none".
fn list(modes: &[Mode]) -> String {
    let texts: Vec<String> = modes.iter().map(Mode::to_string).collect();
    if texts.is_empty() { "none".to_owned() } else { texts.join(", ") }
}

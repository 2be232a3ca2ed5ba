//! Errors of webcams and video files.

use std::io;
use std::path::PathBuf;

use thiserror::Error;

use crate::settings::Mode;

/// Failed call of OpenCV, without its types.
#[derive(Debug, Error)]
#[error(transparent)]
pub struct LibraryError(Box<dyn std::error::Error + Send + Sync>);

impl From<opencv::Error> for LibraryError {
    fn from(error: opencv::Error) -> Self {
        Self(error.into())
    }
}

/// Failure to open a webcam or a video file, or to read it.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum WebcamError {
    /// The device or the file cannot be opened for reading.
    #[error(
        "{}: cannot be opened{}", .path.display(),
        match .source.kind() {
            io::ErrorKind::NotFound => ": list the cameras with `plumb cameras`",
            io::ErrorKind::PermissionDenied =>
                ": this user may not read it; add the user to its group (video)",
            _ => "",
        }
    )]
    Open {
        /// The device or the file.
        path: PathBuf,
        /// Error of the operating system.
        source: io::Error,
    },
    /// The path of a webcam is no device.
    #[error(
        "{}: is no video device; a video file is a recording (`recording = \"FILE\"` in [camera])",
        .path.display()
    )]
    NoDevice {
        /// The path.
        path: PathBuf,
    },
    /// OpenCV does not take the device or the file.
    #[error(
        "{}: OpenCV cannot read it: {}", .path.display(),
        if *.is_device {
            "another program uses the camera, or the device delivers no pictures (a camera may \
             have several; `plumb cameras` lists those that do)"
        } else {
            "the file is damaged, or of a format that it does not know"
        }
    )]
    Refused {
        /// The device or the file.
        path: PathBuf,
        /// Whether it is a device.
        is_device: bool,
    },
    /// The camera has no picture of this size.
    #[error(
        "{}: its pictures are {given} where {wanted} was set: choose a size and a rate that it \
         has (v4l2-ctl --list-formats-ext)", .path.display()
    )]
    Mode {
        /// The device.
        path: PathBuf,
        /// What was set.
        wanted: Mode,
        /// What the camera gives.
        given: Mode,
    },
    /// The camera does not have the pixel format.
    #[error(
        "{}: it does not deliver pictures as {wanted}: choose a format that it has \
         (v4l2-ctl --list-formats-ext)", .path.display()
    )]
    Format {
        /// The device.
        path: PathBuf,
        /// What was set.
        wanted: String,
    },
    /// The camera does not have an option.
    #[error("{}: its {option} cannot be set: leave the key out", .path.display())]
    Option {
        /// The device.
        path: PathBuf,
        /// The option, "exposure".
        option: &'static str,
    },
    /// A picture differs in size from the first one.
    #[error("{}: a picture is {width}x{height} where the first one was of another size",
        .path.display())]
    OtherSize {
        /// The device or the file.
        path: PathBuf,
        /// Columns of the picture.
        width: usize,
        /// Rows of the picture.
        height: usize,
    },
    /// OpenCV states no time for a picture of a file whose times are uneven.
    #[error("{}: a picture without a time, in a file of uneven times: not used", .path.display())]
    NoTime {
        /// The file.
        path: PathBuf,
    },
    /// A picture has come that cannot be read. The next one may be whole.
    #[error("{}: a damaged picture; check cable and hub if there are more", .path.display())]
    Damaged {
        /// The device.
        path: PathBuf,
        /// Error of OpenCV, where it states one.
        source: Option<LibraryError>,
    },
    /// No picture comes any more.
    #[error("{}: no picture comes any more: the camera is unplugged, or does not answer",
        .path.display())]
    Lost {
        /// The device.
        path: PathBuf,
    },
    /// A call of OpenCV failed.
    #[error("{}: OpenCV failed", .path.display())]
    Library {
        /// The device or the file.
        path: PathBuf,
        /// Error of OpenCV.
        source: LibraryError,
    },
}

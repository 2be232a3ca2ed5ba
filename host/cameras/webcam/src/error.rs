//! Errors of webcams.

use std::io;
use std::path::PathBuf;

use nix::errno::Errno;
use plumb_frame::file_intrinsics::UnfitIntrinsics;
use plumb_pictures::decode::DecodeError;
use thiserror::Error;

use crate::mode::Mode;

/// Failure to open a webcam, or to read it.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum WebcamError {
    /// No camera is plugged in.
    #[error("no webcam is plugged in (`plumb cameras` lists them)")]
    NoCamera,
    /// The device that is named may be any of these.
    #[error(
        "there are several cameras, and their numbers change with a restart: choose one, \
         `device = \"PATH\"` in [camera.webcam], of {}",
        .paths.iter().map(|path| path.display().to_string()).collect::<Vec<_>>().join(", ")
    )]
    Several {
        /// Their paths, which stay.
        paths: Vec<PathBuf>,
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
    /// The device cannot be opened, set or started.
    #[error("{}: {}", .path.display(), advice(.source))]
    Device {
        /// The device.
        path: PathBuf,
        /// Error of the operating system.
        source: io::Error,
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
        "{}: it does not deliver pictures as {wanted} (v4l2-ctl --list-formats-ext lists its \
         formats); Plumb reads MJPG and YUYV", .path.display()
    )]
    Format {
        /// The device.
        path: PathBuf,
        /// What was set.
        wanted: String,
    },
    /// A picture has come that cannot be read. The next one may be whole.
    #[error("{}: a damaged picture; check cable and hub if there are more", .path.display())]
    Damaged {
        /// The device.
        path: PathBuf,
        /// Damage of the JPEG picture; `None` where the driver says that data is missing.
        source: Option<DecodeError>,
    },
    /// A picture is not newer than the one before it.
    #[error(
        "{}: a picture is dropped: its time stamp {stamp} s is not after the last one, {last} s",
        .path.display()
    )]
    NotNewer {
        /// The device.
        path: PathBuf,
        /// Time stamp, seconds.
        stamp: f64,
        /// Time stamp of the picture before, seconds.
        last: f64,
    },
    /// No picture comes any more.
    #[error("{}: no picture comes any more: the camera is unplugged, or does not answer",
        .path.display())]
    Lost {
        /// The device.
        path: PathBuf,
        /// Error of the operating system.
        source: io::Error,
    },
    /// The intrinsics do not fit the pictures.
    #[error(transparent)]
    UnfitIntrinsics(#[from] UnfitIntrinsics),
}

/// Returns what an error of the kernel means for a person.
fn advice(error: &io::Error) -> &'static str {
    match error.raw_os_error().map(Errno::from_raw) {
        Some(Errno::ENOENT) => "cannot be opened: list the cameras with `plumb cameras`",
        Some(Errno::EACCES | Errno::EPERM) => {
            "cannot be opened: this user may not read it; add the user to its group (video)"
        }
        Some(Errno::EBUSY) => "another program uses the camera",
        Some(Errno::ENOSPC) => {
            "the USB has no room for its pictures beside those of other devices: use another \
             socket of the computer, without a hub, format MJPG, or a smaller size or rate"
        }
        Some(Errno::ENOTTY) => {
            "it is no camera, or delivers no pictures (a camera may have several devices; \
             `plumb cameras` lists those that do)"
        }
        _ => "it cannot be set up",
    }
}

//! Where pictures come from.

use std::error::Error as StdError;
use std::path::PathBuf;

use plumb_vision::frame::{FrameError, RgbdFrame};
use plumb_vision::image::{ImageError, ImageSize};
use thiserror::Error;

use crate::bounded_read::ReadError;

mod open;
pub mod openni;
pub mod paced;
pub mod picture_file;
pub mod recorded;
pub mod tum;

pub use open::{OpenedRecording, open_recording};

/// Why a source could not give its next picture.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum SourceError {
    /// What was read does not make a frame.
    #[error("{what}: {error}")]
    Frame {
        /// Which picture.
        what: String,
        /// What is wrong with it.
        #[source]
        error: FrameError,
    },
    /// A file could not be read, or is too large.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// A file is no picture that OpenCV can decode.
    #[error("{}: not a picture (PNG or JPEG), or a damaged one", .path.display())]
    Decode {
        /// The file.
        path: PathBuf,
    },
    /// A picture has more pixels than [`picture_file::MAX_PIXELS`].
    #[error("{}: {width}x{height} pixels; at most {} are decoded", .path.display(), picture_file::MAX_PIXELS)]
    TooManyPixels {
        /// The file.
        path: PathBuf,
        /// Its columns.
        width: u32,
        /// Its rows.
        height: u32,
    },
    /// A list of pictures has more lines than [`tum::MAX_LINES`].
    #[error("{}: it has more than {} lines; split the recording", .path.display(), tum::MAX_LINES)]
    TooManyLines {
        /// The list.
        path: PathBuf,
    },
    /// A line of a list of pictures is not `timestamp path`.
    #[error("{}:{line}: {text:?} is not `timestamp path` (seconds, of at most 1e10, then a file)", .path.display())]
    Line {
        /// The list.
        path: PathBuf,
        /// The line, from 1.
        line: usize,
        /// The beginning of what stands there.
        text: String,
    },
    /// A picture file has pixels of another type than the frame needs.
    #[error("{}: {must}", .path.display())]
    PixelType {
        /// The file.
        path: PathBuf,
        /// What it must be.
        must: &'static str,
    },
    /// A picture of another size than those before it, which the intrinsics cannot hold for.
    #[error("{}: {size}, but the recording's first picture is {first}", .path.display())]
    OtherSize {
        /// The picture.
        path: PathBuf,
        /// Its size, pixels.
        size: ImageSize,
        /// Size of the recording's first picture, pixels.
        first: ImageSize,
    },
    /// A camera through OpenNI2.
    #[error(transparent)]
    Openni(#[from] plumb_openni::OpenniError),
    /// A camera's own intrinsics are to be used, but it does not tell them.
    #[error(
        "{uri}: it does not tell its field of view: write the intrinsics into the camera file, and leave out `intrinsics = \"device\"`"
    )]
    NoIntrinsics {
        /// The camera.
        uri: String,
    },
    /// The intrinsics are those of a picture of another size.
    #[error(
        "{uri}: its pictures are {width}x{height}, but the principal point of the camera file's intrinsics, ({cx}, {cy}), is far from their middle: was it calibrated at another resolution?"
    )]
    OtherIntrinsics {
        /// The camera or recording.
        uri: String,
        /// Columns of its pictures.
        width: u16,
        /// Rows of its pictures.
        height: u16,
        /// The principal point's column.
        cx: f64,
        /// The principal point's row.
        cy: f64,
    },
    /// A camera's picture has another number of pixels than its mode says.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// A recording that is played as a camera has no picture for longer than
    /// [`paced::LONGEST_GAP`].
    #[error(
        "the frame at {time:.6} s was taken {gap:.3} s after the one before; a recording that is played as a camera may have gaps of at most {} s",
        paced::LONGEST_GAP.as_secs()
    )]
    Gap {
        /// The frame's time stamp, seconds on the recording's clock.
        time: f64,
        /// The time since the frame before it, seconds.
        gap: f64,
    },
    /// A time stamp is before the one of the frame before.
    #[error(
        "the frame at {time:.6} s is out of order: the one before it was taken at {before:.6} s"
    )]
    Backwards {
        /// The frame's time stamp, seconds on the recording's clock.
        time: f64,
        /// The time stamp of the frame before it, likewise.
        before: f64,
    },
    /// A frame is lost, but it is known when it was taken.
    #[error("the frame at {time:.6} s: {error}")]
    At {
        /// Its time stamp, seconds on the source's clock.
        time: f64,
        /// Why it is lost.
        #[source]
        error: Box<SourceError>,
    },
    /// A source of another crate has its own errors.
    #[error("{error}")]
    Other {
        /// Whether no picture will come any more.
        is_final: bool,
        /// What is wrong.
        #[source]
        error: Box<dyn StdError + Send + Sync>,
    },
}

impl SourceError {
    /// When the frame that is lost was taken, seconds on the source's clock; `None` where no frame
    /// is lost or its time is not known.
    pub fn time(&self) -> Option<f64> {
        match self {
            Self::At { time, .. } => Some(*time),
            _ => None,
        }
    }

    /// Whether no picture will come any more: the camera is gone, a recording has a gap, or a
    /// source of another crate says so.
    pub fn is_final(&self) -> bool {
        match self {
            Self::Gap { .. } => true,
            Self::Other { is_final, .. } => *is_final,
            Self::Openni(error) => !error.is_passing(),
            _ => false,
        }
    }
}

/// Something that gives pictures with depth, one after the other.
pub trait Source {
    /// The next picture, or `None` at the end of a recording.
    ///
    /// # Errors
    /// Where it could not be had; the source may go on after that with the next one.
    fn next_frame(&mut self) -> Result<Option<RgbdFrame>, SourceError>;
}

/// A source whose pictures are of now.
pub trait Live: Source {
    /// The time on the clock that stamps the pictures, seconds.
    fn now(&self) -> f64;
}

impl<S: Source + ?Sized> Source for Box<S> {
    fn next_frame(&mut self) -> Result<Option<RgbdFrame>, SourceError> {
        (**self).next_frame()
    }
}

impl<S: Live + ?Sized> Live for Box<S> {
    fn now(&self) -> f64 {
        (**self).now()
    }
}

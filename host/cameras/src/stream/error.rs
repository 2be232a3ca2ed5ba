//! Errors of streams.

use std::io;
use std::time::Duration;

use plumb_frame::clock::SenderClockError;
use plumb_frame::file_intrinsics::UnfitIntrinsics;
use plumb_frame::image::ImageSize;
use plumb_frame::source::BoxedError;
use plumb_pictures::decode::DecodeError;
use thiserror::Error;

use super::arrival::{SILENCE, Stranger};
use super::header::{HeaderError, Part};

/// Failure of a stream.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum StreamError {
    /// The socket cannot be opened.
    #[error("{address}: cannot listen")]
    Listen {
        /// Address of the stream.
        address: String,
        /// The operating system's error.
        #[source]
        error: io::Error,
    },
    /// Another program listens at the address.
    #[error("{address}: another program listens there; end it, or choose another address")]
    InUse {
        /// Address of the stream.
        address: String,
    },
    /// The standard input is a terminal.
    #[error(
        "the standard input is a terminal; send into it from a program: `sender.py | plumb ...`"
    )]
    Terminal,
    /// No thread can be started, or no sender can be received.
    #[error("the stream cannot be received")]
    Io(#[source] io::Error),
    /// No sender has delivered a frame since the stream was opened.
    #[error(
        "{address}: no frame came within {} s; start the program that sends them",
        .waited.as_secs()
    )]
    NoSender {
        /// Address of the stream.
        address: String,
        /// Time that was waited.
        waited: Duration,
        /// Reason why the last connection has ended, where there was one.
        #[source]
        last: Option<BoxedError>,
    },
    /// Standard input has ended before the first frame.
    #[error("the standard input has ended before the first frame")]
    Empty,
    /// No frame has come for a while.
    #[error("no frame for {:.0} s; does the program that sends them run?", .0.as_secs_f64())]
    Silent(Duration),
    /// The sender has disconnected between two frames.
    #[error("the sender has disconnected; another one may connect")]
    Disconnected,
    /// The sender was silent, and another one has begun to send.
    #[error(
        "the sender has sent nothing for {} s, and another one has connected",
        SILENCE.as_secs()
    )]
    GaveWay,
    /// A connection begins with something that is no stream.
    #[error(
        "a connection is ended: its first line is no header of a frame (is it a browser or \
         another program?)"
    )]
    Stranger(#[source] Stranger),
    /// The sender has ended or disconnected within a frame.
    #[error("the sender has ended in the middle of frame {number}")]
    Truncated {
        /// Number of the frame, from 1.
        number: u64,
    },
    /// The sender has stopped within a frame.
    #[error(
        "the sender has stopped for {} s in the middle of frame {number}",
        .waited.as_secs()
    )]
    Stalled {
        /// Number of the frame, from 1.
        number: u64,
        /// Time without a byte.
        waited: Duration,
    },
    /// A header is refused. What follows it cannot be read.
    #[error("the header of frame {number} is refused")]
    Header {
        /// Number of the frame, from 1.
        number: u64,
        /// Violated condition.
        #[source]
        error: HeaderError,
    },
    /// The time of a frame is unknown.
    #[error("key `t`")]
    Time(#[from] SenderClockError),
    /// A picture cannot be decoded.
    #[error("the {part} picture cannot be decoded")]
    Decode {
        /// Picture.
        part: Part,
        /// Violated condition.
        #[source]
        error: DecodeError,
    },
    /// The size differs from that of the first frame. The intrinsics hold for one size only.
    #[error("a frame of {size}, but the first one was {first}")]
    OtherSize {
        /// Size of the frame.
        size: ImageSize,
        /// Size of the first frame.
        first: ImageSize,
    },
    /// The depth scale differs from that of the first frame.
    #[error("`depth_scale` is {scale}, but was {first} at the beginning")]
    OtherScale {
        /// Depth units in a metre.
        scale: f64,
        /// Depth units in a metre of the first frame.
        first: f64,
    },
    /// The intrinsics do not fit the images.
    #[error(transparent)]
    UnfitIntrinsics(#[from] UnfitIntrinsics),
}

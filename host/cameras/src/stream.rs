//! Frames from any program: a Unix socket, a TCP port of this computer, or standard input.
//!
//! Each frame is one line of JSON, then the bytes of colour, then those of depth:
//!
//! ```json
//! {"t": 12.345, "width": 640, "height": 480, "colour": "rgb8", "colour_bytes": 921600,
//!  "depth": "z16", "depth_bytes": 614400, "depth_scale": 1000.0, "age": 0.02}
//! ```
//!
//! (in one line). docs/use/stream.md describes the keys. A thread takes every frame as soon as it
//! comes, so that no sender waits; a second one, which [`Capture`](crate::capture::Capture) starts,
//! decodes the newest. Memory is bounded by [`MAX_PIXELS`] and [`MAX_HEADER_BYTES`].

mod address;
mod arrival;
mod connection;
mod endpoint;
mod error;
mod header;
mod picture;
mod receiver;

use std::error::Error;
use std::path::Path;
use std::time::{Duration, Instant};

use plumb_frame::camera::{Camera, Intrinsics};
use plumb_frame::clock::LiveClock;
use plumb_frame::driver::{CameraDriver, OpenedSource};
use plumb_frame::file_intrinsics::FileIntrinsics;
use plumb_frame::frame::RgbdFrame;
use plumb_frame::source::{BoxedError, CameraSource, SourceError};

use crate::capture::slot::Item;
use receiver::{RawFrame, Reception};

pub use address::{AddressError, StreamAddress};
pub use arrival::{Arrival, Stranger};
pub use connection::{Connection, Interruption};
pub use endpoint::Endpoint;
pub use error::StreamError;
pub use header::{
    ColourEncoding, DepthEncoding, HeaderError, MAX_HEADER_BYTES, MAX_PIXELS, MAX_SIDE, Part,
};
pub use picture::Format;

/// Longest wait for the first frame of a stream.
pub const FIRST_FRAME: Duration = Duration::from_secs(30);

/// Longest wait for a further frame, below that of a capture.
const SILENCE: Duration = Duration::from_secs(1);

/// Stream of frames from another program.
///
/// Time stamps are in seconds on the host's clock since the stream was opened. A sender may
/// disconnect, and another one connect: each loss is an error, but not the end. Standard input
/// ends with its sender.
#[derive(Debug)]
pub struct StreamSource {
    reception: Reception,
    clock: LiveClock,
    format: Format,
    /// The first frame, until it is taken.
    first: Option<RgbdFrame>,
    last_frame: Instant,
}

impl StreamSource {
    /// Listens at `address` and waits for the first frame, for `limit` at most. The frames have
    /// `intrinsics`, with the depth scale of the stream.
    ///
    /// # Errors
    /// Where the address cannot be used, no frame comes, the first one is refused, or the
    /// intrinsics belong to pictures of another size.
    pub fn open(
        address: &StreamAddress,
        intrinsics: impl Into<FileIntrinsics>,
        limit: Duration,
    ) -> Result<Self, BoxedError> {
        let clock = LiveClock::since(Instant::now());
        let reception = Reception::start(address, clock.clone())?;
        let raw = first_frame(&reception, address, limit)?;
        let intrinsics = intrinsics.into().of_pictures(raw.header.size(), address);
        let format = Format::of(&raw.header, intrinsics.map_err(StreamError::from)?);
        let first = Some(format.frame(raw)?);
        Ok(Self { reception, clock, format, first, last_frame: Instant::now() })
    }

    /// Returns the format of all frames.
    pub fn format(&self) -> &Format {
        &self.format
    }
}

/// The senders of a stream are unknown before they connect: none is listed.
impl CameraDriver for StreamAddress {
    fn open(&self, camera: &Camera, _: Option<&Path>) -> Result<OpenedSource, BoxedError> {
        let source = StreamSource::open(self, camera, FIRST_FRAME)?;
        let description = Some(format!("{self}, {}", source.format()));
        let intrinsics = source.format().intrinsics;
        Ok(OpenedSource { description, ..OpenedSource::new(source, intrinsics) })
    }
}

/// Waits for the first frame, for `limit` at most.
fn first_frame(
    reception: &Reception,
    address: &StreamAddress,
    limit: Duration,
) -> Result<RawFrame, BoxedError> {
    let begin = Instant::now();
    let mut last = None;
    while reception.slot().wait(limit.saturating_sub(begin.elapsed())) {
        match reception.slot().take() {
            Some(Item::Frame(frame)) => return Ok(frame),
            Some(Item::Lost(error)) if is_of_another(&error) => last = Some(error.into_cause()),
            Some(Item::Lost(error) | Item::End(Some(error))) => return Err(error.into()),
            Some(Item::End(None)) | None => return Err(StreamError::Empty.into()),
        }
    }
    Err(StreamError::NoSender { address: address.to_string(), waited: limit, last }.into())
}

/// Reads `bytes` as a sender's frames of any size, up to their end or the first error, and decodes
/// them. Returns the number of frames without an error.
pub(crate) fn decode_all(mut bytes: &[u8], intrinsics: Intrinsics) -> u64 {
    let mut decoded = 0;
    for number in 1.. {
        let Ok(raw) = receiver::read_frame(&mut bytes, number) else { break };
        decoded += u64::from(Format::of(&raw.header, intrinsics).frame(raw).is_ok());
    }
    decoded
}

/// Returns whether a connection has ended that may have been none of the camera: that of a browser,
/// or a dead one.
fn is_of_another(error: &SourceError) -> bool {
    let cause = error.source().and_then(|cause| cause.downcast_ref());
    matches!(cause, Some(StreamError::GaveWay | StreamError::Stranger(_)))
}

impl CameraSource for StreamSource {
    fn next_frame(&mut self) -> Result<Option<RgbdFrame>, SourceError> {
        if let Some(first) = self.first.take() {
            return Ok(Some(first));
        }
        let slot = self.reception.slot();
        if !slot.wait(SILENCE) {
            return Err(SourceError::new(StreamError::Silent(self.last_frame.elapsed())));
        }
        match slot.take() {
            Some(Item::Frame(raw)) => {
                self.last_frame = Instant::now();
                self.format.frame(raw).map(Some)
            }
            Some(Item::Lost(error) | Item::End(Some(error))) => Err(error),
            Some(Item::End(None)) | None => Ok(None),
        }
    }

    fn now(&self) -> f64 {
        self.clock.now()
    }

    fn clock(&self) -> Option<LiveClock> {
        Some(self.clock.clone())
    }

    fn skipped(&self) -> u64 {
        self.reception.slot().skipped()
    }
}

#[cfg(test)]
mod tests;

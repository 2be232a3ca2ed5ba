//! A camera in the network: JPEG pictures over HTTP (`multipart/x-mixed-replace`), as telephones
//! and IP cameras send them.
//!
//! A thread takes each picture as it comes and keeps the newest; a second one, which
//! [`Capture`](crate::capture::Capture) starts, decodes it. Pictures have no depth. No picture
//! states when it was taken: its time is its arrival, less the latency of the settings.

mod body;
mod error;
mod limits;
mod reception;
mod url;

use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use plumb_config::quantity::CameraTime;
use plumb_frame::camera::{Camera, Intrinsics};
use plumb_frame::clock::LiveClock;
use plumb_frame::driver::{CameraDriver, OpenedSource};
use plumb_frame::file_intrinsics::FileIntrinsics;
use plumb_frame::frame::RgbdFrame;
use plumb_frame::image::{Image, ImageSize};
use plumb_frame::source::{BoxedError, CameraSource, InvalidFrame, SourceError};
use plumb_pictures::decode::{self, DecodeError};
use serde::Deserialize;

use crate::capture::slot::{Item, Slot};
use reception::{Picture, Receiver};

pub use error::HttpError;
pub use url::{HttpUrl, UrlError};

/// Longest wait for the first picture: the camera is found, connected, and answers.
const FIRST_PICTURE: Duration = Duration::from_secs(20);

/// Longest wait for a further frame, below that of a capture.
const SILENCE: Duration = Duration::from_secs(1);

/// Settings of a camera in the network: table `[camera.http]` of a rig file.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct HttpSettings {
    /// Address of the pictures, `http://HOST:PORT/PATH`.
    pub url: Option<HttpUrl>,
    /// Time from exposure to arrival, seconds, above 0, to 10. Default: the time of a frame is its
    /// arrival.
    pub latency: Option<CameraTime>,
}

/// Camera in the network. Its frames have no depth; their time stamps are seconds since it was
/// opened. A lost connection is an error, but not the end.
pub struct HttpSource {
    reception: Reception,
    clock: LiveClock,
    latency: f64,
    intrinsics: Intrinsics,
    size: ImageSize,
    /// Address, for messages.
    url: String,
    last_frame: Instant,
}

/// Place of the newest picture. Dropping it ends the thread that receives them.
struct Reception(Arc<Slot<Picture>>);

impl Drop for Reception {
    fn drop(&mut self) {
        self.0.close();
    }
}

impl HttpSource {
    /// Connects to a camera and waits for its first picture. The frames have `intrinsics`, without
    /// depth.
    ///
    /// # Errors
    /// Where no camera is named, it cannot be reached, its reply has no JPEG pictures, or the
    /// intrinsics belong to pictures of another size.
    pub fn open(
        settings: &HttpSettings,
        intrinsics: impl Into<FileIntrinsics>,
    ) -> Result<Self, BoxedError> {
        let url = settings.url.clone().ok_or(HttpError::NoUrl)?;
        let (shown, clock) = (url.to_string(), LiveClock::since(Instant::now()));
        let reception = Reception(Arc::default());
        let slot = Arc::clone(&reception.0);
        Receiver { url, clock: clock.clone(), slot }.start().map_err(HttpError::Io)?;
        if !reception.0.wait(FIRST_PICTURE) {
            return Err(HttpError::Silent(FIRST_PICTURE).into());
        }
        let first = match reception.0.take() {
            Some(Item::Frame(picture)) => picture,
            Some(Item::Lost(error) | Item::End(Some(error))) => return Err(error.into_cause()),
            Some(Item::End(None)) | None => return Err(HttpError::Ended.into()),
        };
        let size = decode::size(&first.bytes).ok_or(HttpError::Decode(DecodeError::Damaged))?;
        let intrinsics = intrinsics.into().of_pictures(size, &shown)?;
        let intrinsics = Intrinsics { depth_scale: 0.0, ..intrinsics };
        let latency = settings.latency.map_or(0.0, CameraTime::get);
        let last_frame = Instant::now();
        Ok(Self { reception, clock, latency, intrinsics, size, url: shown, last_frame })
    }
}

/// Reads `bytes` as the reply of a camera, up to its end or the first error. Returns the number of
/// pictures, decoded or not.
pub(crate) fn count_pictures(mut bytes: &[u8]) -> Result<u64, BoxedError> {
    let (mut body, mut parts) = reception::reply(&mut bytes, &"http://camera/".parse()?)?;
    Ok((0..).take_while(|_| parts.next(&mut body).is_ok()).count() as u64)
}

/// Cameras in the network are unknown before they are named: none is listed.
impl CameraDriver for HttpSettings {
    fn open(&self, camera: &Camera, _: Option<&Path>) -> Result<OpenedSource, BoxedError> {
        let source = HttpSource::open(self, camera)?;
        let description = Some(format!("{}, {}", source.url, source.size));
        let intrinsics = source.intrinsics;
        Ok(OpenedSource { description, ..OpenedSource::new(source, intrinsics) })
    }
}

impl CameraSource for HttpSource {
    fn next_frame(&mut self) -> Result<Option<RgbdFrame>, SourceError> {
        let Reception(slot) = &self.reception;
        if !slot.wait(SILENCE) {
            return Err(SourceError::new(HttpError::Silent(self.last_frame.elapsed())));
        }
        let Picture { arrival, bytes } = match slot.take() {
            Some(Item::Frame(picture)) => picture,
            Some(Item::Lost(error) | Item::End(Some(error))) => return Err(error),
            Some(Item::End(None)) | None => return Ok(None),
        };
        self.last_frame = Instant::now();
        let ImageSize { width, height } = self.size;
        let colour = decode::of_size(&bytes, self.size, decode::colour);
        let colour = colour.map_err(|error| SourceError::new(HttpError::Decode(error)))?;
        let depth = Image::filled(width, height, 0);
        let frame = RgbdFrame::new(arrival - self.latency, colour, depth, self.intrinsics);
        Ok(Some(frame.map_err(InvalidFrame::of(&self.url))?))
    }

    fn now(&self) -> f64 {
        self.clock.now()
    }

    fn clock(&self) -> Option<LiveClock> {
        Some(self.clock.clone())
    }

    fn skipped(&self) -> u64 {
        self.reception.0.skipped()
    }
}

#[cfg(test)]
mod tests;

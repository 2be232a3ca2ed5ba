//! The live picture: JPEG, encoded once for all clients.

use plumb_cameras::jpeg;
use tungstenite::Bytes;

use crate::feed::Feed;
use crate::message::FrameView;

/// Quality of the JPEG: about 60 kB at 640x480.
const QUALITY: u8 = 75;

/// An encoded frame.
#[derive(Debug, Clone)]
pub(crate) struct Picture {
    pub(crate) frame: FrameView,
    pub(crate) jpeg: Bytes,
}

/// Encoder that remembers its last picture.
#[derive(Default)]
pub(crate) struct Encoder {
    newest: Option<Picture>,
}

impl Encoder {
    /// Returns the newest picture; `None` if there is none. Encodes it if that was not done yet.
    pub(crate) fn newest(&mut self, feed: &Feed) -> Option<&Picture> {
        let (frame, image) = feed.image()?;
        if self.newest.as_ref().is_none_or(|picture| picture.frame.number != frame.number) {
            let jpeg = jpeg::encode(image.colour(), QUALITY).ok()?.into();
            self.newest = Some(Picture { frame, jpeg });
        }
        self.newest.as_ref()
    }
}

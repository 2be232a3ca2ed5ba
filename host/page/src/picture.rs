//! The live picture: JPEG, encoded once for all clients.

use plumb_pictures::jpeg;
use tungstenite::Bytes;

use crate::message::FrameView;
use crate::subject::Subject;

/// Quality of the JPEG: about 60 kB at 640x480.
const QUALITY: u8 = 75;

/// An encoded picture.
#[derive(Debug, Clone)]
pub(crate) struct EncodedPicture {
    pub(crate) frame: FrameView,
    pub(crate) jpeg: Bytes,
}

/// Encoder that remembers its last picture.
#[derive(Default)]
pub(crate) struct Encoder {
    newest: Option<EncodedPicture>,
}

impl Encoder {
    /// Returns the newest picture; `None` if there is none. Encodes it if that was not done yet.
    pub(crate) fn newest(&mut self, subject: &dyn Subject) -> Option<&EncodedPicture> {
        let (frame, picture) = subject.picture()?;
        if self.newest.as_ref().is_none_or(|newest| newest.frame.number != frame.number) {
            let jpeg = jpeg::encode(picture.colour(), QUALITY).ok()?.into();
            self.newest = Some(EncodedPicture { frame, jpeg });
        }
        self.newest.as_ref()
    }
}

//! Interface between the server and what a page shows: a run, or a calibration.

use std::net::SocketAddr;
use std::sync::Arc;

use plumb_frame::frame::RgbdFrame;
use plumb_frame::image::ColourImage;

use crate::assets::Asset;
use crate::files::RunFile;
use crate::message::FrameView;
use crate::signal::Signal;

/// Number of a client's connection.
pub(crate) type ClientId = usize;

/// Message of a page, as the server sees it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Received {
    /// The update with this number has arrived; the client is ready for the next one.
    Seen(u64),
    /// A command, which is handled.
    Command,
    /// A question. This is the answer to it, as JSON.
    Answered(String),
}

/// What a client has been sent so far: the number of the next sample and the next event; `None` at
/// its beginning.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Cursor {
    pub(crate) next: Option<(u64, u64)>,
}

/// Picture to show.
#[derive(Clone)]
pub(crate) enum Picture {
    /// Frame of the camera.
    Frame(Arc<RgbdFrame>),
    /// Picture with something drawn in.
    Drawn(Arc<ColourImage>),
}

impl Picture {
    pub(crate) fn colour(&self) -> &ColourImage {
        match self {
            Self::Frame(frame) => frame.colour(),
            Self::Drawn(image) => image,
        }
    }
}

/// Subject of a page. One thread writes its news, the server thread reads them.
pub(crate) trait Subject: Send + Sync {
    /// Returns the files of the page.
    fn assets(&self) -> &'static [Asset];

    /// Returns the file of the run at a path of the page's address.
    fn file(&self, _path: &str) -> Option<RunFile> {
        None
    }

    /// Returns the first message to every page.
    fn hello(&self) -> &str;

    fn signal(&self) -> &Signal;

    /// Returns the number of changes so far.
    fn version(&self) -> u64;

    /// Returns the update number `number` for a client as JSON, and advances its cursor. `picture`
    /// is the frame whose picture follows.
    ///
    /// # Errors
    /// Where the update cannot be written as JSON.
    fn update(
        &self,
        number: u64,
        picture: Option<FrameView>,
        cursor: &mut Cursor,
    ) -> serde_json::Result<String>;

    /// Returns the newest picture, if there is one. Another picture has another number.
    fn picture(&self) -> Option<(FrameView, Picture)>;

    /// Notes a client that has come from `address`.
    fn arrive(&self, _client: ClientId, _address: SocketAddr) {}

    /// Handles a message of a client.
    ///
    /// # Errors
    /// A message for the person, where it is not understood or cannot be carried out.
    fn take(&self, text: &str, client: ClientId) -> Result<Received, String>;

    /// Ends what only lasts while its client is there. `is_present` tells whether a client is.
    fn release_absent(&self, is_present: &dyn Fn(ClientId) -> bool);
}

/// Returns what to tell a person whose message cannot be read.
pub(crate) fn not_understood(error: &serde_json::Error) -> String {
    format!("the program does not understand this: {error}")
}

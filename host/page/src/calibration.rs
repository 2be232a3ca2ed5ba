//! The page of a calibration: a person chooses points in the live picture and accepts the pose.
//!
//! The page knows nothing of poses. The caller reads the commands, decides, and shows the state:
//!
//! ```text
//! caller -> CalibrationPage::show (picture, state) -> server thread <-> browsers
//!        <- CalibrationPage::command               <-
//! ```

mod feed;
mod message;

use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, sync_channel};
use std::time::Duration;

use plumb_frame::image::ColourImage;

pub use message::{CalibrationCommand, CalibrationState, MarkView, ResultView};

use crate::PageError;
use crate::limits::Limits;
use crate::running_server::RunningServer;
pub(crate) use feed::CalibrationFeed;

/// Number of commands that may wait.
const MAX_WAITING: usize = 16;

/// Settings of a calibration's page.
pub struct CalibrationPageSettings {
    /// Address to listen at. Port 0 takes any free port.
    pub address: SocketAddr,
    /// Names of the points to choose, in their order.
    pub names: Vec<String>,
    /// File that gets the pose, for people.
    pub file: String,
    /// Limits of the server.
    pub limits: Limits,
}

/// A calibration's page that is being served.
///
/// Dropping it sends the last state to the browsers and ends the server, within a second.
pub struct CalibrationPage {
    feed: Arc<CalibrationFeed>,
    serving: RunningServer,
    commands: Receiver<CalibrationCommand>,
}

impl CalibrationPage {
    /// Begins to serve the page.
    ///
    /// # Errors
    /// Where the address cannot be used, or the operating system lacks threads or random numbers.
    pub fn start(settings: CalibrationPageSettings) -> Result<Self, PageError> {
        let CalibrationPageSettings { address, names, file, limits } = settings;
        let (sender, commands) = sync_channel(MAX_WAITING);
        let feed = |signal| Ok(CalibrationFeed::new(signal, names, file, sender)?);
        let (feed, serving) = RunningServer::start(address, limits, feed)?;
        Ok(Self { feed, serving, commands })
    }

    /// Returns the address to open, with the token if there is one.
    pub fn address(&self) -> &str {
        self.serving.address()
    }

    /// Shows the state, with a picture that was taken at `time` (s).
    pub fn show(&self, time: f64, picture: ColourImage, state: CalibrationState) {
        self.feed.show(time, picture, state);
    }

    /// Returns the next command of a person; `None` if none comes within `wait`.
    pub fn command(&self, wait: Duration) -> Option<CalibrationCommand> {
        self.commands.recv_timeout(wait).ok()
    }

    /// Tells the browsers how the calibration ended, and ends the server.
    pub fn end(self, text: &str) {
        self.feed.end(text);
    }
}

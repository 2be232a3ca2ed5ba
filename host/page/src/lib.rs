//! The page: a run in a browser, with its picture, its rig, its curves and its controls. Another
//! page, [`CalibrationPage`], lets a person choose points in the picture.
//!
//! [`Page::start`] listens at an address and returns an observer for the run. Files and socket are
//! served by one thread. The run only writes into a bounded memory, so that a slow or dead browser
//! never delays a position:
//!
//! ```text
//! run -> Page (observer) -> newest frame, ring of samples, ring of events
//!     <- commands        <-   server thread <-> browsers
//! ```
//!
//! A loopback address is open to the programs of this computer. Any other address needs a token,
//! which is part of [`Page::address`]. Requests of other sites' pages are refused. docs/use/page.md
//! describes the page and its messages.

#![forbid(unsafe_code)]
#![deny(missing_docs)]

mod access;
mod assets;
mod calibration;
mod feed;
mod files;
#[doc(hidden)]
pub mod fuzzing;
mod http;
mod limits;
mod message;
mod picture;
mod running_server;
mod server;
mod shared;
mod sight;
mod signal;
mod subject;

use std::net::SocketAddr;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};
use std::{io, thread};

use plumb_runtime::listening::other_address;
use plumb_runtime::observer::{EventRecord, FrameRecord, Observer};
use plumb_runtime::operator::OperatorSender;
use plumb_runtime::run::Summary;
use thiserror::Error;

use feed::Feed;
use running_server::RunningServer;

pub use access::Token;
pub use calibration::{
    CalibrationCommand, CalibrationPage, CalibrationPageSettings, CalibrationState, MarkView,
    ResultView,
};
pub use limits::{Limits, Rate};
pub use message::{RigView, VERSION};
pub use sight::Sight;

/// Address of the page if none is given. The port spells "PLUM" on a telephone.
pub const DEFAULT_ADDRESS: &str = "127.0.0.1:7586";

/// Longest time that the browsers have to take the files of a run.
const TAKE_FILES: Duration = Duration::from_secs(3);

/// Settings of a page.
pub struct PageSettings {
    /// Address to listen at. Port 0 takes any free port.
    pub address: SocketAddr,
    /// The rig as the page shows it.
    pub rig: RigView,
    /// Sender of the page's commands; `None` for a page that only shows.
    pub operator: Option<OperatorSender>,
    /// Limits of the server.
    pub limits: Limits,
}

/// Failure to start a page.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum PageError {
    /// The address cannot be listened at.
    #[error("the page cannot use the address {address}; {}", other_address(.source))]
    Listen {
        /// The address.
        address: SocketAddr,
        /// Cause.
        source: io::Error,
    },
    /// The operating system has no random numbers for the token.
    #[error("the page has no token: no random numbers")]
    Token(#[source] getrandom::Error),
    /// The operating system starts no thread or watches no sockets.
    #[error("the page cannot be served")]
    Serve(#[from] io::Error),
    /// The description of the rig cannot be written as JSON.
    #[error("the page's description of the rig")]
    Rig(#[from] serde_json::Error),
}

/// A page that is being served, as an observer of the run.
///
/// Dropping it sends the last state to the browsers and ends the server, within a second.
pub struct Page {
    feed: Arc<Feed>,
    serving: RunningServer,
}

impl Page {
    /// Begins to serve the page.
    ///
    /// # Errors
    /// Where the address cannot be used, or the operating system lacks threads or random numbers.
    pub fn start(settings: PageSettings) -> Result<Self, PageError> {
        let PageSettings { address, rig, operator, limits } = settings;
        let feed = |signal| Ok(Feed::new(signal, rig, operator)?);
        let (feed, serving) = RunningServer::start(address, limits, feed)?;
        Ok(Self { feed, serving })
    }

    /// Returns the address to open, with the token if there is one.
    pub fn address(&self) -> &str {
        self.serving.address()
    }

    /// Offers the files that a run has written into `folder` to the open pages, and ends the
    /// server once each page has taken them, within 3 s. For the run's end, with its files closed.
    pub fn finish(self, folder: &Path) {
        self.feed.offer(folder);
        let end = Instant::now() + TAKE_FILES;
        while self.feed.is_wanted() && Instant::now() < end {
            thread::sleep(Duration::from_millis(10));
        }
    }
}

impl Observer for Page {
    fn frame(&mut self, record: &FrameRecord) {
        self.feed.frame(record);
    }

    fn event(&mut self, event: &EventRecord) {
        self.feed.event(event);
    }

    fn end(&mut self, summary: &Summary) {
        self.feed.end(summary);
    }
}

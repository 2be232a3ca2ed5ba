//! The page: a run in a browser, with its picture, its rig, its curves and its controls.
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
mod feed;
mod http;
mod limits;
mod message;
mod picture;
mod server;

use std::io;
use std::net::{IpAddr, SocketAddr, UdpSocket};
use std::sync::Arc;
use std::thread::{self, JoinHandle};

use mio::net::TcpListener;
use mio::{Poll, Waker};
use plumb_runtime::observer::{FrameRecord, Observer, RunEvent};
use plumb_runtime::operator::OperatorSender;
use plumb_runtime::run::Summary;
use thiserror::Error;

pub use access::Token;
pub use limits::{Limits, Rate};
pub use message::{RigView, VERSION};

use access::Access;
use feed::Feed;
use message::{Hello, ToPage};
use server::{Server, Site, WAKER};

/// Address of the page if none is given. The port spells "PLUM" on a telephone.
pub const DEFAULT_ADDRESS: &str = "127.0.0.1:7586";

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
    #[error(
        "the page cannot use the address {address}; try another port, or port 0 for a free one"
    )]
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
    address: String,
    /// `None` once it is joined.
    thread: Option<JoinHandle<()>>,
}

impl Page {
    /// Begins to serve the page.
    ///
    /// # Errors
    /// Where the address cannot be used, or the operating system lacks threads or random numbers.
    pub fn start(settings: PageSettings) -> Result<Self, PageError> {
        let PageSettings { address, rig, operator, limits } = settings;
        let listen = |source| PageError::Listen { address, source };
        let listener = TcpListener::bind(address).map_err(listen)?;
        let bound = listener.local_addr().map_err(listen)?;
        let token = if bound.ip().is_loopback() {
            None
        } else {
            Some(Token::random().map_err(PageError::Token)?)
        };
        let hello = Hello { version: VERSION, commands: operator.is_some(), rig };
        let hello = serde_json::to_string(&ToPage::Hello(&hello))?;
        let poll = Poll::new()?;
        let feed = Arc::new(Feed::new(Waker::new(poll.registry(), WAKER)?));
        let address = url(bound, token.as_ref());
        let access = Access::new(bound, token);
        let site = Site { access, limits, hello, operator };
        let server = Server::new(poll, listener, site, Arc::clone(&feed))?;
        let thread = thread::Builder::new().name("page".into()).spawn(move || server.serve())?;
        Ok(Self { feed, address, thread: Some(thread) })
    }

    /// Returns the address to open, with the token if there is one.
    pub fn address(&self) -> &str {
        &self.address
    }
}

impl Observer for Page {
    fn frame(&mut self, record: &FrameRecord) {
        self.feed.frame(record);
    }

    fn event(&mut self, event: &RunEvent) {
        self.feed.event(event);
    }

    fn end(&mut self, summary: &Summary) {
        self.feed.end(summary);
    }
}

impl Drop for Page {
    fn drop(&mut self) {
        self.feed.close();
        if let Some(thread) = self.thread.take() {
            let _panicked = thread.join();
        }
    }
}

/// Returns the address for a browser. One that stands for all of this computer's addresses is
/// replaced by the one that reaches other computers.
fn url(bound: SocketAddr, token: Option<&Token>) -> String {
    let mut address = bound;
    if bound.ip().is_unspecified()
        && let Some(ip) = outward_address(bound)
    {
        address.set_ip(ip);
    }
    let query = token.map(|token| format!("?token={}", token.as_str())).unwrap_or_default();
    format!("http://{address}/{query}")
}

/// Returns the address of this computer on the way to others; `None` without a network. Nothing is
/// sent.
fn outward_address(bound: SocketAddr) -> Option<IpAddr> {
    // Addresses for documentation (RFC 5737, RFC 3849): every route but the local ones leads there.
    let far = if bound.is_ipv4() { "192.0.2.1:9" } else { "[2001:db8::1]:9" };
    let socket = UdpSocket::bind((bound.ip(), 0)).ok()?;
    socket.connect(far).ok()?;
    socket.local_addr().ok().map(|address| address.ip())
}

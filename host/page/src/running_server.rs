//! Start and end of the server, and the address of its page.

use std::net::SocketAddr;
use std::sync::Arc;
use std::thread::{self, JoinHandle};

use mio::net::TcpListener;
use mio::{Poll, Waker};
use plumb_runtime::listening::address_to_open;

use crate::PageError;
use crate::access::{Access, Token};
use crate::limits::Limits;
use crate::server::{Server, Site, WAKER};
use crate::signal::Signal;
use crate::subject::Subject;

/// A page that is being served. Dropping it sends the last state to the browsers and ends the
/// server, within a second.
pub(crate) struct RunningServer {
    subject: Arc<dyn Subject>,
    address: String,
    /// `None` once it is joined.
    thread: Option<JoinHandle<()>>,
}

impl RunningServer {
    /// Begins to serve the subject that `subject` makes. Returns the subject too.
    ///
    /// # Errors
    /// Where the address cannot be used, the operating system lacks threads or random numbers, or
    /// the subject cannot be made.
    pub(crate) fn start<S: Subject + 'static>(
        address: SocketAddr,
        limits: Limits,
        subject: impl FnOnce(Signal) -> Result<S, PageError>,
    ) -> Result<(Arc<S>, Self), PageError> {
        let listen = |source| PageError::Listen { address, source };
        let listener = TcpListener::bind(address).map_err(listen)?;
        let bound = listener.local_addr().map_err(listen)?;
        let token = if bound.ip().is_loopback() {
            None
        } else {
            Some(Token::random().map_err(PageError::Token)?)
        };
        let poll = Poll::new()?;
        let subject = Arc::new(subject(Signal::new(Waker::new(poll.registry(), WAKER)?))?);
        let shared: Arc<dyn Subject> = Arc::<S>::clone(&subject);
        let address = url(bound, token.as_ref());
        let access = Access::new(bound, token);
        let site = Site { access, limits, subject: Arc::clone(&shared) };
        let server = Server::new(poll, listener, site)?;
        let thread = thread::Builder::new().name("page".into()).spawn(move || server.serve())?;
        Ok((subject, Self { subject: shared, address, thread: Some(thread) }))
    }

    /// Returns the address to open, with the token if there is one.
    pub(crate) fn address(&self) -> &str {
        &self.address
    }
}

impl Drop for RunningServer {
    fn drop(&mut self) {
        self.subject.signal().close();
        if let Some(thread) = self.thread.take() {
            let _panicked = thread.join();
        }
    }
}

/// Returns the address for a browser.
fn url(bound: SocketAddr, token: Option<&Token>) -> String {
    let query = token.map(|token| format!("?token={}", token.as_str())).unwrap_or_default();
    format!("http://{}/{query}", address_to_open(bound))
}

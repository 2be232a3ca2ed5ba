//! Start and end of the server, and the address of its page.

use std::net::{IpAddr, SocketAddr, UdpSocket};
use std::sync::Arc;
use std::thread::{self, JoinHandle};

use mio::net::TcpListener;
use mio::{Poll, Waker};

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

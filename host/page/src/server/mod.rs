//! The server: one thread for all connections. It never makes the run wait.

mod client;
mod connection;

use std::collections::BTreeMap;
use std::io::{self, ErrorKind};
use std::sync::Arc;
use std::time::{Duration, Instant};

use mio::net::TcpListener;
use mio::{Events, Interest, Poll, Token};
use plumb_runtime::operator::{OperatorCommand, OperatorSender};
use tungstenite::protocol::frame::coding::CloseCode;

use crate::access::Access;
use crate::feed::Feed;
use crate::limits::{Bucket, Limits};
use crate::picture::Encoder;
use client::Gone;
use connection::Connection;

/// Longest time between two updates. A page that gets none for longer shows that the connection is
/// lost.
const HEARTBEAT: Duration = Duration::from_secs(1);

/// Time that pages have at the end to take the last update.
const FAREWELL: Duration = Duration::from_millis(500);

/// Events of the operating system that one turn handles.
const EVENTS: usize = 64;

/// Answer to a command where there is no operator.
const SHOWS_ONLY: &str = "this page only shows the run";

const LISTENER: Token = Token(0);
/// Wakes the thread for news of the run.
pub(crate) const WAKER: Token = Token(1);
const FIRST_CONNECTION: usize = 2;

/// What all connections share.
pub(crate) struct Site {
    pub(crate) access: Access,
    pub(crate) limits: Limits,
    /// First message to every page.
    pub(crate) hello: String,
    /// `None` for a page that only shows.
    pub(crate) operator: Option<OperatorSender>,
}

impl Site {
    /// Hands a command of a page to the run.
    ///
    /// # Errors
    /// A message for the person, where the run does not take it.
    fn command(&self, command: OperatorCommand) -> Result<(), String> {
        let Some(operator) = &self.operator else { return Err(SHOWS_ONLY.to_owned()) };
        operator.send(command).map(drop).map_err(|error| error.to_string())
    }
}

/// State of the server.
pub(crate) struct Server {
    poll: Poll,
    listener: TcpListener,
    site: Site,
    feed: Arc<Feed>,
    /// The connections by their number, oldest first.
    connections: BTreeMap<usize, Connection>,
    next: usize,
    encoder: Encoder,
    updates: Bucket,
    /// [`Feed::version`] and time of the last update.
    published: (u64, Instant),
}

impl Server {
    /// Makes a server that listens with `listener`.
    ///
    /// # Errors
    /// Where the operating system does not watch the socket.
    pub(crate) fn new(
        poll: Poll,
        mut listener: TcpListener,
        site: Site,
        feed: Arc<Feed>,
    ) -> io::Result<Self> {
        poll.registry().register(&mut listener, LISTENER, Interest::READABLE)?;
        let now = Instant::now();
        Ok(Self {
            poll,
            listener,
            updates: Bucket::new(site.limits.updates, now),
            site,
            feed,
            connections: BTreeMap::new(),
            next: FIRST_CONNECTION,
            encoder: Encoder::default(),
            published: (0, now),
        })
    }

    /// Serves until the feed closes.
    pub(crate) fn serve(mut self) {
        while !self.feed.is_closing() {
            let timeout = self.timeout(Instant::now());
            if self.turn(timeout).is_err() {
                return;
            }
            self.publish(Instant::now());
        }
        self.say_farewell();
    }

    /// Waits for events of the connections and handles them.
    fn turn(&mut self, timeout: Duration) -> io::Result<()> {
        let mut events = Events::with_capacity(EVENTS);
        match self.poll.poll(&mut events, Some(timeout)) {
            Ok(()) => {}
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
        let now = Instant::now();
        for event in &events {
            match event.token() {
                LISTENER => self.accept(now),
                WAKER => {}
                Token(number) => self.advance(number, now),
            }
        }
        self.end_late(now);
        self.feed.set_watchers(self.clients());
        Ok(())
    }

    /// Accepts the connections that wait.
    fn accept(&mut self, now: Instant) {
        while let Ok((mut stream, _)) = self.listener.accept() {
            if self.connections.len() >= self.site.limits.connections && !self.make_room() {
                continue;
            }
            let number = self.next;
            self.next += 1;
            let interest = Interest::READABLE | Interest::WRITABLE;
            if self.poll.registry().register(&mut stream, Token(number), interest).is_ok() {
                self.connections.insert(number, Connection::new(stream, &self.site, now));
            }
        }
    }

    /// Ends the oldest connection that is no open page. Returns whether there was one.
    fn make_room(&mut self) -> bool {
        let idle = |connection: &Connection| !matches!(connection, Connection::Client(_));
        let oldest = self.connections.iter().find(|(_, connection)| idle(connection));
        let Some(number) = oldest.map(|(number, _)| *number) else { return false };
        self.connections.remove(&number).is_some()
    }

    /// Handles what has happened on a connection.
    fn advance(&mut self, number: usize, now: Instant) {
        let Some(connection) = self.connections.remove(&number) else { return };
        let was_client = matches!(connection, Connection::Client(_));
        let Some(mut connection) = connection.advance(&self.site, now) else { return };
        if let Connection::Client(client) = &mut connection
            && !was_client
            && self.begin(client, now).is_err()
        {
            return;
        }
        self.connections.insert(number, connection);
    }

    /// Sends the first messages to a new page, or says that there are too many.
    fn begin(&mut self, client: &mut client::Client, now: Instant) -> Result<(), Gone> {
        if self.clients() >= self.site.limits.clients {
            return client.close(CloseCode::Again, "too many pages are open", now);
        }
        client.greet(&self.site.hello)?;
        client.push(&self.feed, self.encoder.newest(&self.feed))
    }

    fn clients(&self) -> usize {
        let clients = self.connections.values().filter(|c| matches!(c, Connection::Client(_)));
        clients.count()
    }

    /// Sends the newest state to every page that is ready, if there is news or a heartbeat is due.
    fn publish(&mut self, now: Instant) {
        let version = self.feed.version();
        let is_due = now >= self.published.1 + HEARTBEAT;
        if self.clients() == 0 {
            self.published = (version, now);
        } else if is_due || (version != self.published.0 && self.updates.take(1.0, now)) {
            self.published = (version, now);
            let picture = self.encoder.newest(&self.feed);
            self.connections.retain(|_, connection| match connection {
                Connection::Client(client) => client.push(&self.feed, picture).is_ok(),
                _ => true,
            });
        }
    }

    /// Ends the connections whose time is over.
    fn end_late(&mut self, now: Instant) {
        let late = self.connections.iter().filter(|(_, c)| c.deadline(&self.site) <= now);
        for number in late.map(|(number, _)| *number).collect::<Vec<_>>() {
            let connection = self.connections.remove(&number);
            if let Some(rest) = connection.and_then(|c| c.expire(now, &self.site)) {
                self.connections.insert(number, rest);
            }
        }
    }

    /// Returns how long the server may sleep.
    fn timeout(&mut self, now: Instant) -> Duration {
        let left = |deadline: Instant| deadline.saturating_duration_since(now);
        let deadlines = self.connections.values().map(|c| left(c.deadline(&self.site)));
        let mut least = deadlines.fold(left(self.published.1 + HEARTBEAT), Duration::min);
        if self.clients() == 0 {
            return least;
        }
        if self.feed.version() != self.published.0 {
            least = least.min(self.updates.wait(now));
        }
        least
    }

    /// Sends the last update to every page and closes the connections.
    fn say_farewell(&mut self) {
        let now = Instant::now();
        self.connections.retain(|_, connection| match connection {
            Connection::Client(client) => client
                .push_now(&self.feed, None)
                .and_then(|()| client.close(CloseCode::Away, "the run has ended", now))
                .is_ok(),
            _ => true,
        });
        while !self.connections.is_empty() {
            let left = FAREWELL.saturating_sub(now.elapsed());
            if left.is_zero() || self.turn(left).is_err() {
                return;
            }
        }
    }
}

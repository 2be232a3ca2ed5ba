//! The server: one thread for all connections. It never makes the run wait.

mod client;
mod connection;
mod site;

use std::collections::BTreeMap;
use std::io::{self, ErrorKind};
use std::time::{Duration, Instant};

use mio::net::TcpListener;
use mio::{Events, Interest, Poll, Token};
use tungstenite::protocol::frame::coding::CloseCode;

use crate::limits::Bucket;
use crate::picture::Encoder;
use crate::subject::ClientId;
use client::Gone;
use connection::Connection;

pub(crate) use site::Site;

/// Longest time between two updates. A page that gets none for longer shows that the connection is
/// lost.
const HEARTBEAT: Duration = Duration::from_secs(1);

/// Time that pages have at the end to take the last update.
const FAREWELL: Duration = Duration::from_millis(500);

/// Events of the operating system that one turn handles.
const EVENTS: usize = 64;

const LISTENER: Token = Token(0);
/// Wakes the thread for news of the subject.
pub(crate) const WAKER: Token = Token(1);
const FIRST_CONNECTION: usize = 2;

/// State of the server.
pub(crate) struct Server {
    poll: Poll,
    listener: TcpListener,
    site: Site,
    /// The connections by their number, oldest first.
    connections: BTreeMap<usize, Connection>,
    next: usize,
    encoder: Encoder,
    updates: Bucket,
    /// [`Subject::version`] and time of the last update.
    published: (u64, Instant),
}

impl Server {
    /// Makes a server that listens with `listener`.
    ///
    /// # Errors
    /// Where the operating system does not watch the socket.
    pub(crate) fn new(poll: Poll, mut listener: TcpListener, site: Site) -> io::Result<Self> {
        poll.registry().register(&mut listener, LISTENER, Interest::READABLE)?;
        let now = Instant::now();
        Ok(Self {
            poll,
            listener,
            updates: Bucket::new(site.limits.updates, now),
            site,
            connections: BTreeMap::new(),
            next: FIRST_CONNECTION,
            encoder: Encoder::default(),
            published: (0, now),
        })
    }

    /// Serves until the subject asks for the end.
    pub(crate) fn serve(mut self) {
        while !self.site.subject.signal().is_closing() {
            let timeout = self.timeout(Instant::now());
            if self.turn(timeout).is_err() {
                return;
            }
            self.publish(Instant::now());
            self.release_absent(Instant::now());
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
        self.site.subject.signal().set_watchers(self.clients());
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
        let Some(mut connection) = connection.advance(number, &self.site, now) else { return };
        if let Connection::Client(client) = &mut connection
            && !was_client
            && self.begin(client, number, now).is_err()
        {
            return;
        }
        self.connections.insert(number, connection);
    }

    /// Sends the first messages to a new page, or says that there are too many.
    fn begin(
        &mut self,
        client: &mut client::Client,
        number: ClientId,
        now: Instant,
    ) -> Result<(), Gone> {
        if self.clients() >= self.site.limits.clients {
            return client.close(CloseCode::Again, "too many pages are open", now);
        }
        self.site.subject.arrive(number, client.address().ok_or(Gone)?);
        client.greet(self.site.subject.hello())?;
        let subject = &*self.site.subject;
        client.push(subject, self.encoder.newest(subject), now)
    }

    fn clients(&self) -> usize {
        let clients = self.connections.values().filter(|c| matches!(c, Connection::Client(_)));
        clients.count()
    }

    /// Sends the newest state to every page that is ready, if there is news or a heartbeat is due.
    fn publish(&mut self, now: Instant) {
        let version = self.site.subject.version();
        let is_due = now >= self.published.1 + HEARTBEAT;
        if self.clients() == 0 {
            self.published = (version, now);
        } else if is_due || (version != self.published.0 && self.updates.take(1.0, now)) {
            self.published = (version, now);
            let subject = &*self.site.subject;
            let picture = self.encoder.newest(subject);
            self.connections.retain(|_, connection| match connection {
                Connection::Client(client) => client.push(subject, picture, now).is_ok(),
                _ => true,
            });
        }
    }

    /// Ends what only lasts while its page is there.
    fn release_absent(&self, now: Instant) {
        self.site.subject.release_absent(&|number| match self.connections.get(&number) {
            Some(Connection::Client(client)) => client.is_present(&self.site.limits, now),
            _ => false,
        });
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
        if self.site.subject.version() != self.published.0 {
            least = least.min(self.updates.wait(now));
        }
        least
    }

    /// Sends the last update to every page and closes the connections.
    fn say_farewell(&mut self) {
        let now = Instant::now();
        self.connections.retain(|_, connection| match connection {
            Connection::Client(client) => client
                .push_now(&*self.site.subject, None, now)
                .and_then(|()| client.close(CloseCode::Away, "the program has ended", now))
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

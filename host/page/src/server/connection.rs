//! A connection: a request that arrives, a reply that goes out, or an open page.

use std::io::{ErrorKind, Read, Write};
use std::net::Shutdown;
use std::time::Instant;

use data_encoding::BASE64;
use mio::net::TcpStream;
use sha1_smol::Sha1;

use super::client::Client;
use super::site::Site;
use crate::access::Denied;
use crate::assets;
use crate::http::{Parsed, Reply, Request, Status};
use crate::subject::ClientId;

/// Path of the WebSocket.
const SOCKET: &str = "/socket";

/// State of a connection.
pub(super) enum Connection {
    /// A request arrives.
    Request(Pending),
    /// A reply goes out.
    Reply(Sending),
    /// A page is open.
    Client(Box<Client>),
}

/// Request that is not complete.
pub(super) struct Pending {
    stream: TcpStream,
    received: Vec<u8>,
    deadline: Instant,
}

/// Reply that is not sent, or whose client has not closed the connection.
pub(super) struct Sending {
    stream: TcpStream,
    waiting: Vec<u8>,
    deadline: Instant,
}

impl Connection {
    pub(super) fn new(stream: TcpStream, site: &Site, now: Instant) -> Self {
        let deadline = now + site.limits.request_time;
        Self::Request(Pending { stream, received: Vec::new(), deadline })
    }

    /// Returns when the connection ends if nothing happens.
    pub(super) fn deadline(&self, site: &Site) -> Instant {
        match self {
            Self::Request(pending) => pending.deadline,
            Self::Reply(sending) => sending.deadline,
            Self::Client(client) => client.deadline(&site.limits),
        }
    }

    /// Handles what has arrived, and sends what waits. Returns `None` at the connection's end.
    pub(super) fn advance(self, number: ClientId, site: &Site, now: Instant) -> Option<Self> {
        match self {
            Self::Request(pending) => pending.advance(site, now),
            Self::Reply(sending) => sending.advance(),
            Self::Client(mut client) => {
                client.advance(number, site, now).ok()?;
                Some(Self::Client(client))
            }
        }
    }

    /// Ends a connection that is late: a request in words, anything else at once.
    pub(super) fn expire(self, now: Instant, site: &Site) -> Option<Self> {
        match self {
            Self::Request(pending) if !pending.received.is_empty() => {
                let text = "The request took too long.\n";
                pending.reply(&Reply::text(Status::TimedOut, text), false, site, now)
            }
            _ => None,
        }
    }
}

impl Pending {
    fn advance(mut self, site: &Site, now: Instant) -> Option<Connection> {
        let mut buffer = [0; 2048];
        loop {
            match self.stream.read(&mut buffer) {
                Ok(0) => return None,
                Ok(count) => self.received.extend_from_slice(&buffer[..count]),
                Err(error) if error.kind() == ErrorKind::WouldBlock => {
                    return Some(Connection::Request(self));
                }
                Err(error) if error.kind() == ErrorKind::Interrupted => continue,
                Err(_) => return None,
            }
            let limit = site.limits.request_bytes;
            match Request::parse(&self.received) {
                Parsed::Complete(request, length) if length <= limit => {
                    return self.answer(&request, length, site, now);
                }
                Parsed::Partial if self.received.len() < limit => {}
                Parsed::Complete(..) | Parsed::Partial => {
                    let reply = Reply::text(Status::TooLarge, "The request is too long.\n");
                    return self.reply(&reply, false, site, now);
                }
                Parsed::Malformed => {
                    let reply = Reply::text(Status::BadRequest, "This is no request.\n");
                    return self.reply(&reply, false, site, now);
                }
            }
        }
    }

    /// Answers a request whose head has `length` bytes.
    fn answer(
        mut self,
        request: &Request,
        length: usize,
        site: &Site,
        now: Instant,
    ) -> Option<Connection> {
        let is_head = request.method == "HEAD";
        if let Err(denied) = site.access.check(request) {
            let status = match denied {
                Denied::Token => Status::Unauthorized,
                Denied::Host | Denied::Origin => Status::Forbidden,
            };
            return self.reply(&Reply::text(status, denied.text()), is_head, site, now);
        }
        if request.method != "GET" && !is_head {
            let reply = Reply::text(Status::MethodNotAllowed, "Only GET and HEAD are answered.\n");
            return self.reply(&reply, is_head, site, now);
        }
        if request.path == SOCKET {
            let Some(key) = websocket_key(request) else {
                let reply = Reply::text(Status::BadRequest, "This address is for WebSockets.\n");
                return self.reply(&reply, is_head, site, now);
            };
            let rest = self.received.split_off(length);
            return self.upgrade(key, rest, site, now);
        }
        if let Some(file) = site.subject.file(&request.path) {
            let reply = Reply::file(&file.body, file.content_type, file.name);
            return self.reply(&reply, is_head, site, now);
        }
        let Some(asset) = assets::find(site.subject.assets(), &request.path) else {
            let reply = Reply::text(Status::NotFound, "There is nothing at this address.\n");
            return self.reply(&reply, is_head, site, now);
        };
        let reply = Reply {
            status: Status::Ok,
            content_type: asset.content_type,
            body: asset.body,
            host: request.header("host"),
            cookie: site.access.cookie(request),
            download: None,
        };
        self.reply(&reply, is_head, site, now)
    }

    /// Turns the connection into that of an open page.
    fn upgrade(
        mut self,
        key: &str,
        rest: Vec<u8>,
        site: &Site,
        now: Instant,
    ) -> Option<Connection> {
        let accept = accept_key(key);
        let reply = format!(
            "HTTP/1.1 101 Switching Protocols\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n\
             Sec-WebSocket-Accept: {accept}\r\n\r\n"
        );
        // A new socket has room for this much.
        let sent = self.stream.write(reply.as_bytes()).ok()?;
        let _ = self.stream.set_nodelay(true);
        let client = Client::new(self.stream, rest, &site.limits, now);
        (sent == reply.len()).then(|| Connection::Client(client.into()))
    }

    fn reply(
        self,
        reply: &Reply<'_>,
        is_head: bool,
        site: &Site,
        now: Instant,
    ) -> Option<Connection> {
        let deadline = now + site.limits.request_time;
        Sending { stream: self.stream, waiting: reply.bytes(is_head), deadline }.advance()
    }
}

impl Sending {
    /// Sends what waits, then waits until the client closes: a socket that is closed with unread
    /// bytes may lose the reply.
    fn advance(mut self) -> Option<Connection> {
        while !self.waiting.is_empty() {
            match self.stream.write(&self.waiting) {
                Ok(0) => return None,
                Ok(count) => {
                    self.waiting.drain(..count);
                }
                Err(error) if error.kind() == ErrorKind::WouldBlock => {
                    return Some(Connection::Reply(self));
                }
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(_) => return None,
            }
            if self.waiting.is_empty() {
                self.stream.shutdown(Shutdown::Write).ok()?;
            }
        }
        // The rest of a request that is refused is not read to its end.
        let mut rest = [0; 8192];
        match self.stream.read(&mut rest) {
            Err(error) if error.kind() == ErrorKind::WouldBlock => Some(Connection::Reply(self)),
            _ => None,
        }
    }
}

/// Returns the value that proves to a client that its handshake was understood (RFC 6455, 4.2.2).
fn accept_key(key: &str) -> String {
    const GUID: &str = "258EAFA5-E914-47DA-95CA-C5AB0DC85B11";
    BASE64.encode(&Sha1::from(format!("{key}{GUID}")).digest().bytes())
}

/// Returns the key of a request for a WebSocket; `None` if it is none.
fn websocket_key(request: &Request) -> Option<&str> {
    let has = |name: &str, wanted: &str| {
        let values = request.header(name).unwrap_or_default().split(',');
        values.map(str::trim).any(|value| value.eq_ignore_ascii_case(wanted))
    };
    let is_upgrade = request.method == "GET"
        && has("connection", "upgrade")
        && has("upgrade", "websocket")
        && has("sec-websocket-version", "13");
    let key = request.header("sec-websocket-key")?;
    (is_upgrade && key.len() == 24).then_some(key)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The example of RFC 6455, section 1.3.
    #[test]
    fn the_accept_key_is_that_of_the_standard() {
        assert_eq!(accept_key("dGhlIHNhbXBsZSBub25jZQ=="), "s3pPLMBiTxaQ9kYGzzhZRbK+xOo=");
    }
}

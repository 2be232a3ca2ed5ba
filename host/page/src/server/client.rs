//! An open page: a WebSocket on which updates go out and commands come in.

use std::io::{self, ErrorKind, Read, Write};
use std::net::SocketAddr;
use std::time::Instant;

use mio::net::TcpStream;
use tungstenite::protocol::frame::coding::CloseCode;
use tungstenite::protocol::{CloseFrame, Role, WebSocketConfig};
use tungstenite::{Error, Message, WebSocket};

use super::site::Site;
use crate::limits::{Bucket, Limits};
use crate::message::ToPage;
use crate::picture::EncodedPicture;
use crate::subject::{ClientId, Cursor, Received, Subject};

/// Highest number of bytes that wait for a client: an update with its picture and some replies.
const MAX_WAITING: usize = 4 << 20;

/// Size of the buffer for messages of a client, bytes.
const READ_BUFFER: usize = 4096;

/// End of a connection: closed, broken, or against the rules.
#[derive(Debug)]
pub(super) struct Gone;

/// Socket that counts the bytes which it receives, and fails above their rate.
struct Metered {
    stream: TcpStream,
    bytes: Bucket,
}

impl Read for Metered {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.stream.read(buffer)?;
        if self.bytes.take(count as f64, Instant::now()) {
            Ok(count)
        } else {
            Err(io::Error::other("too many bytes"))
        }
    }
}

impl Write for Metered {
    fn write(&mut self, buffer: &[u8]) -> io::Result<usize> {
        self.stream.write(buffer)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.stream.flush()
    }
}

/// Update on its way to a client.
#[derive(Debug, Clone, Copy)]
struct InFlight {
    number: u64,
    sent: Instant,
}

/// State of a client. At most one update is on its way to it: the next one goes out after the
/// client has acknowledged the last, and holds what is newest then.
pub(super) struct Client {
    socket: WebSocket<Metered>,
    cursor: Cursor,
    /// Number of the next update.
    next: u64,
    /// The update that is not acknowledged.
    in_flight: Option<InFlight>,
    /// When the client last acknowledged an update, or began to close.
    acknowledged: Instant,
    /// Frame number of the last picture.
    shown: Option<u64>,
    messages: Bucket,
    is_closing: bool,
}

impl Client {
    /// Begins with the socket of an accepted handshake. `received` are the bytes after it.
    pub(super) fn new(stream: TcpStream, received: Vec<u8>, limits: &Limits, now: Instant) -> Self {
        let config = WebSocketConfig::default()
            .read_buffer_size(READ_BUFFER)
            .max_write_buffer_size(MAX_WAITING)
            .max_message_size(Some(limits.message_bytes))
            .max_frame_size(Some(limits.message_bytes));
        let stream = Metered { stream, bytes: Bucket::new(limits.bytes, now) };
        Self {
            socket: WebSocket::from_partially_read(stream, received, Role::Server, Some(config)),
            cursor: Cursor::default(),
            next: 0,
            in_flight: None,
            acknowledged: now,
            shown: None,
            messages: Bucket::new(limits.messages, now),
            is_closing: false,
        }
    }

    /// Returns the address of the browser; `None` once the connection is broken.
    pub(super) fn address(&self) -> Option<SocketAddr> {
        self.socket.get_ref().stream.peer_addr().ok()
    }

    /// Returns when the connection ends if nothing is acknowledged.
    pub(super) fn deadline(&self, limits: &Limits) -> Instant {
        self.acknowledged + if self.is_closing { limits.request_time } else { limits.silence }
    }

    /// Returns whether the client is there: it takes its updates in time.
    pub(super) fn is_present(&self, limits: &Limits, now: Instant) -> bool {
        let is_late = |update: InFlight| now >= update.sent + limits.absence;
        !self.is_closing && !self.in_flight.is_some_and(is_late)
    }

    /// Sends a message that every client gets.
    pub(super) fn greet(&mut self, hello: &str) -> Result<(), Gone> {
        self.write(Message::text(hello))
    }

    /// Sends the newest state if the client is ready for it.
    pub(super) fn push(
        &mut self,
        subject: &dyn Subject,
        picture: Option<&EncodedPicture>,
        now: Instant,
    ) -> Result<(), Gone> {
        if self.in_flight.is_some() || self.is_closing {
            return Ok(());
        }
        self.push_now(subject, picture, now)
    }

    /// Sends the newest state, also if the client has not acknowledged the last one.
    pub(super) fn push_now(
        &mut self,
        subject: &dyn Subject,
        picture: Option<&EncodedPicture>,
        now: Instant,
    ) -> Result<(), Gone> {
        let picture = picture.filter(|picture| self.shown != Some(picture.frame.number));
        let frame = picture.map(|picture| picture.frame.clone());
        let text = subject.update(self.next, frame, &mut self.cursor).map_err(|_| Gone)?;
        self.write(Message::text(text))?;
        if let Some(picture) = picture {
            self.write(Message::binary(picture.jpeg.clone()))?;
            self.shown = Some(picture.frame.number);
        }
        self.in_flight = Some(InFlight { number: self.next, sent: now });
        self.next += 1;
        Ok(())
    }

    /// Handles the messages that have arrived, and sends what waits. `number` is that of the
    /// connection.
    pub(super) fn advance(
        &mut self,
        number: ClientId,
        site: &Site,
        now: Instant,
    ) -> Result<(), Gone> {
        loop {
            let message = match self.socket.read() {
                Ok(message) => message,
                Err(Error::Io(error)) if error.kind() == ErrorKind::WouldBlock => break,
                Err(_) => return Err(Gone),
            };
            if self.is_closing {
                continue;
            }
            if !self.messages.take(1.0, now) {
                self.close(CloseCode::Policy, "too many messages", now)?;
            } else if let Message::Text(text) = &message {
                self.take(text, number, site, now)?;
            } else if let Message::Binary(_) = message {
                self.complain("the program takes JSON messages only")?;
            }
        }
        settle(self.socket.flush())
    }

    /// Handles a message.
    fn take(
        &mut self,
        text: &str,
        number: ClientId,
        site: &Site,
        now: Instant,
    ) -> Result<(), Gone> {
        match site.subject.take(text, number) {
            Ok(Received::Seen(update)) => {
                if self.in_flight.is_some_and(|in_flight| in_flight.number == update) {
                    self.in_flight = None;
                    self.acknowledged = now;
                }
                Ok(())
            }
            Ok(Received::Command) => Ok(()),
            Ok(Received::Answered(answer)) => self.write(Message::text(answer)),
            Err(problem) => self.complain(&problem),
        }
    }

    /// Begins to close the connection.
    pub(super) fn close(
        &mut self,
        code: CloseCode,
        reason: &'static str,
        now: Instant,
    ) -> Result<(), Gone> {
        self.is_closing = true;
        self.acknowledged = now;
        settle(self.socket.close(Some(CloseFrame { code, reason: reason.into() })))?;
        settle(self.socket.flush())
    }

    fn complain(&mut self, text: &str) -> Result<(), Gone> {
        let text = serde_json::to_string(&ToPage::Problem { text }).map_err(|_| Gone)?;
        self.write(Message::text(text))
    }

    fn write(&mut self, message: Message) -> Result<(), Gone> {
        settle(self.socket.write(message))?;
        settle(self.socket.flush())
    }
}

/// Returns whether the connection lives: what a full socket does not take is sent later.
fn settle(result: tungstenite::Result<()>) -> Result<(), Gone> {
    match result {
        Ok(()) => Ok(()),
        Err(Error::Io(error)) if error.kind() == ErrorKind::WouldBlock => Ok(()),
        Err(_) => Err(Gone),
    }
}

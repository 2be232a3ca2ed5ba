//! Thread that receives the pictures of a camera in the network, and connects again.

use std::io::{self, BufRead, BufReader, ErrorKind, Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

use plumb_config::error_chain::ErrorChain;
use plumb_frame::clock::LiveClock;
use plumb_frame::source::SourceError;
use tracing::warn;

use super::PATIENCE;
use super::body::{Body, Parts};
use super::error::HttpError;
use super::url::HttpUrl;
use crate::capture::slot::{Item, Slot};

/// Shortest and longest pause before the camera is connected again.
const PAUSES: [Duration; 2] = [Duration::from_millis(250), Duration::from_secs(4)];

/// Most bytes of the head of a reply, and most header lines.
const MAX_HEAD_BYTES: usize = 16 << 10;
const MAX_HEADERS: usize = 64;

/// Bytes that are read at once.
const BUFFER_BYTES: usize = 256 << 10;

/// Most pictures in a row that are dropped because a newer one is there: a camera that sends
/// without a pause is still seen.
const MAX_STALE: u32 = 30;

/// Picture as it came.
#[derive(Debug)]
pub(super) struct Picture {
    /// When its last byte was there, seconds on the host's clock.
    pub(super) arrival: f64,
    pub(super) bytes: Vec<u8>,
}

/// Receiver of pictures.
pub(super) struct Receiver {
    pub(super) url: HttpUrl,
    pub(super) clock: LiveClock,
    pub(super) slot: Arc<Slot<Picture>>,
}

/// Connection on which each read ends at a deadline.
struct Timed {
    stream: TcpStream,
    deadline: Instant,
}

impl Read for Timed {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        loop {
            let left = self.deadline.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Err(ErrorKind::TimedOut.into());
            }
            self.stream.set_read_timeout(Some(left))?;
            match self.stream.read(buffer) {
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) if error.kind() == ErrorKind::WouldBlock => {}
                result => return result,
            }
        }
    }
}

impl Receiver {
    /// Starts a thread that receives pictures until the slot is closed. A thread that waits for the
    /// network ends some seconds later.
    pub(super) fn start(self) -> io::Result<()> {
        let thread = thread::Builder::new().name("http".to_owned());
        thread.spawn(move || self.run()).map(drop)
    }

    fn run(self) {
        let _end = self.slot.end_guard();
        let mut pause = PAUSES[0];
        // Each outage is told once.
        let mut is_told = false;
        while !self.slot.is_closed() {
            let (received, error) = self.receive();
            if received > 0 {
                (pause, is_told) = (PAUSES[0], false);
            }
            if !is_told {
                warn!(error = %ErrorChain(&error), "{}: it is connected again", self.url);
                self.slot.offer(Item::Lost(SourceError::new(error)));
                is_told = true;
            }
            thread::sleep(pause);
            pause = PAUSES[1].min(2 * pause);
        }
    }

    /// Receives the pictures of one connection. Returns their number, and why they end.
    fn receive(&self) -> (u64, HttpError) {
        let mut received = 0;
        let (mut body, mut parts) = match self.connect() {
            Ok(connected) => connected,
            Err(error) => return (received, error),
        };
        let mut stale = 0;
        loop {
            body.input.get_mut().deadline = Instant::now() + PATIENCE;
            let bytes = match parts.next(&mut body) {
                Ok(bytes) => bytes,
                Err(error) => return (received, error),
            };
            received += 1;
            if body.input.buffer().len() > parts.backlog(&bytes) && stale < MAX_STALE {
                stale += 1;
                continue;
            }
            stale = 0;
            let arrival = self.clock.now();
            if !self.slot.offer(Item::Frame(Picture { arrival, bytes })) {
                return (received, HttpError::Ended);
            }
        }
    }

    /// Connects to the camera and asks for its pictures.
    fn connect(&self) -> Result<(Body<BufReader<Timed>>, Parts), HttpError> {
        let url = &self.url;
        let stream = reach(&url.host, url.port);
        let stream =
            stream.map_err(|source| HttpError::Connect { url: url.to_string(), source })?;
        let deadline = Instant::now() + PATIENCE;
        stream.set_write_timeout(Some(PATIENCE))?;
        (&stream).write_all(url.request().as_bytes())?;
        let mut input = BufReader::with_capacity(BUFFER_BYTES, Timed { stream, deadline });
        let reply = Reply::read(&mut input)?;
        let boundary = reply.boundary();
        let boundary = boundary.map_err(|says| HttpError::Reply { url: url.to_string(), says })?;
        let left = reply.has_chunks().then_some(0);
        Ok((Body { input, left }, Parts::new(&boundary)))
    }
}

/// Connects to the first address of `host` that answers.
fn reach(host: &str, port: u16) -> io::Result<TcpStream> {
    let mut result = Err(ErrorKind::NotFound.into());
    for address in (host, port).to_socket_addrs()? {
        result = TcpStream::connect_timeout(&address, PATIENCE);
        if result.is_ok() {
            break;
        }
    }
    result
}

/// Head of a reply.
struct Reply {
    code: u16,
    reason: String,
    /// Header lines; the names in lower case.
    headers: Vec<(String, String)>,
}

impl Reply {
    fn read(input: &mut impl BufRead) -> Result<Self, HttpError> {
        let mut head = Vec::new();
        while head.len() < MAX_HEAD_BYTES {
            let bytes = input.fill_buf()?;
            if bytes.is_empty() {
                return Err(HttpError::Ended);
            }
            let (before, count) = (head.len(), bytes.len());
            head.extend_from_slice(bytes);
            let mut headers = [httparse::EMPTY_HEADER; MAX_HEADERS];
            let mut reply = httparse::Response::new(&mut headers);
            match reply.parse(&head) {
                Ok(httparse::Status::Partial) => input.consume(count),
                Ok(httparse::Status::Complete(length)) => {
                    let headers = reply.headers.iter().map(|header| {
                        let value = String::from_utf8_lossy(header.value).into_owned();
                        (header.name.to_ascii_lowercase(), value)
                    });
                    let (code, reason) = (reply.code.unwrap_or(0), reply.reason.unwrap_or(""));
                    let (headers, reason) = (headers.collect(), reason.to_owned());
                    input.consume(length - before);
                    return Ok(Self { code, reason, headers });
                }
                Err(_) => break,
            }
        }
        Err(HttpError::NoHttp)
    }

    fn header(&self, name: &str) -> &str {
        let found = self.headers.iter().find(|(header, _)| header == name);
        found.map_or("", |(_, value)| value)
    }

    fn has_chunks(&self) -> bool {
        self.header("transfer-encoding").eq_ignore_ascii_case("chunked")
    }

    /// Returns what stands between the pictures.
    ///
    /// # Errors
    /// Where there are none: what the reply is, and what to do, for a person.
    fn boundary(&self) -> Result<String, String> {
        let Self { code, reason, .. } = self;
        match code {
            200 => {}
            401 => return Err("wants a password: http://USER:PASSWORD@HOST (Basic only)".into()),
            300..=399 => {
                return Err(format!("the pictures are at {:?}", self.header("location")));
            }
            _ => return Err(format!("the reply is {code} {reason:?}")),
        }
        let kind = self.header("content-type");
        let mut words = kind.split(';').map(str::trim);
        let is_multipart = words.next().is_some_and(|it| it.starts_with("multipart/"));
        let boundary = words.find_map(|word| {
            let (name, value) = word.split_once('=')?;
            name.eq_ignore_ascii_case("boundary").then(|| value.to_owned())
        });
        boundary.filter(|_| is_multipart).ok_or_else(|| {
            format!(
                "the reply is {kind:?}, and no row of JPEG pictures (multipart/x-mixed-replace \
                 with a boundary): give the address of the camera's MJPEG stream"
            )
        })
    }
}

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

use super::body::{Body, Parts, read_line};
use super::error::HttpError;
use super::limits::PATIENCE;
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
        let (mut pause, mut is_told) = (PAUSES[0], false);
        loop {
            let mut received = 0;
            let Err(error) = self.receive(&mut received) else { return };
            if received > 0 {
                (pause, is_told) = (PAUSES[0], false);
            }
            // Each outage is told once.
            if !is_told {
                warn!(error = %ErrorChain(&error), "{}: it is connected again", self.url);
                is_told = true;
                if !self.slot.offer(Item::Lost(SourceError::new(error))) {
                    return;
                }
            }
            thread::sleep(pause);
            pause = PAUSES[1].min(2 * pause);
        }
    }

    /// Receives the pictures of one connection, and counts them, until the slot is closed.
    fn receive(&self, received: &mut u64) -> Result<(), HttpError> {
        let (mut body, mut parts) = self.connect()?;
        let mut stale = 0;
        while !self.slot.is_closed() {
            body.input.get_mut().deadline = Instant::now() + PATIENCE;
            let bytes = parts.next(&mut body)?;
            *received += 1;
            if body.input.buffer().len() > parts.backlog(&bytes) && stale < MAX_STALE {
                stale += 1;
                continue;
            }
            stale = 0;
            self.slot.offer(Item::Frame(Picture { arrival: self.clock.now(), bytes }));
        }
        Ok(())
    }

    /// Connects to the camera and asks for its pictures.
    fn connect(&self) -> Result<(Body<BufReader<Timed>>, Parts), HttpError> {
        let failed = |source| HttpError::Connect { url: self.url.to_string(), source };
        let mut stream = reach(&self.url.host, self.url.port).map_err(failed)?;
        stream.set_write_timeout(Some(PATIENCE))?;
        stream.write_all(self.url.request().as_bytes())?;
        let deadline = Instant::now() + PATIENCE;
        reply(BufReader::with_capacity(BUFFER_BYTES, Timed { stream, deadline }), &self.url)
    }
}

/// Reads the head of the reply of `url`. Returns its body, and the reader of its pictures.
///
/// # Errors
/// Where it has none.
pub(super) fn reply<R: BufRead>(
    mut input: R,
    url: &HttpUrl,
) -> Result<(Body<R>, Parts), HttpError> {
    let head = read_head(&mut input)?;
    let mut headers = [httparse::EMPTY_HEADER; MAX_HEADERS];
    let mut reply = httparse::Response::new(&mut headers);
    reply.parse(&head).map_err(|_| HttpError::NoHttp)?;
    let refused = |says| HttpError::Reply { url: url.to_string(), says };
    let boundary = boundary(&reply).map_err(refused)?;
    let has_chunks = header(&reply, "transfer-encoding").eq_ignore_ascii_case("chunked");
    Ok((Body { input, left: has_chunks.then_some(0) }, Parts::new(&boundary)))
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

/// Reads the head of a reply: up to an empty line.
fn read_head(input: &mut impl BufRead) -> Result<Vec<u8>, HttpError> {
    let mut head = Vec::new();
    while !head.ends_with(b"\r\n\r\n") && head.len() < MAX_HEAD_BYTES {
        head.extend(read_line(input)?);
        head.extend(b"\r\n");
        if !head.starts_with(b"HTTP/") {
            return Err(HttpError::NoHttp);
        }
    }
    Ok(head)
}

/// Returns the value of a header line; an empty one where there is none.
fn header(reply: &httparse::Response<'_, '_>, name: &str) -> String {
    let mut headers = reply.headers.iter();
    let found = headers.find(|header| header.name.eq_ignore_ascii_case(name));
    found.map_or(String::new(), |header| String::from_utf8_lossy(header.value).into_owned())
}

/// Returns what stands between the pictures of a reply.
///
/// # Errors
/// Where there are none: what the reply is, and what to do, for a person.
fn boundary(reply: &httparse::Response<'_, '_>) -> Result<String, String> {
    match reply.code.unwrap_or(0) {
        200 => {}
        401 => return Err("wants a password: http://USER:PASSWORD@HOST (Basic only)".to_owned()),
        300..=399 => return Err(format!("the pictures are at {:?}", header(reply, "location"))),
        code => return Err(format!("the reply is {code} {:?}", reply.reason.unwrap_or(""))),
    }
    let kind = header(reply, "content-type");
    let mut names = kind.split(';').filter_map(|word| word.trim().split_once('='));
    let boundary = names.rfind(|(name, _)| name.eq_ignore_ascii_case("boundary"));
    match boundary {
        Some((_, boundary)) if kind.starts_with("multipart/") => Ok(boundary.to_owned()),
        _ => Err(format!(
            "the reply is {kind:?}, and no row of JPEG pictures (multipart/x-mixed-replace with a \
             boundary): give the address of the camera's MJPEG stream"
        )),
    }
}

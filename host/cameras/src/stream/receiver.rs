//! Thread that receives a stream: it takes every frame at once, so that no sender ever waits.

use std::fs::File;
use std::io::{BufRead, BufReader, ErrorKind, Read};
use std::sync::Arc;
use std::thread::{self, JoinHandle};

use plumb_config::bounded_read::{LineError, read_line};
use plumb_config::error_chain::ErrorChain;
use plumb_frame::clock::{LiveClock, SenderClock};
use plumb_frame::source::SourceError;
use tracing::{debug, info};

use super::address::StreamAddress;
use super::arrival::{Arrival, SILENCE};
use super::connection::{Connection, Interruption};
use super::endpoint::Endpoint;
use super::error::StreamError;
use super::header::{Header, HeaderError, MAX_HEADER_BYTES};
use crate::capture::slot::{Item, Slot};

/// Most bytes that are reserved for a picture before they have come.
const MAX_RESERVED: u64 = 1 << 20;

/// Frame as it came.
#[derive(Debug)]
pub(super) struct RawFrame {
    pub(super) header: Header,
    /// Time of the exposure, seconds on the host's clock.
    pub(super) time: f64,
    pub(super) colour: Vec<u8>,
    pub(super) depth: Vec<u8>,
}

/// Receiver of a stream.
pub(super) struct Receiver {
    pub(super) endpoint: Endpoint,
    pub(super) clock: LiveClock,
    pub(super) slot: Arc<Slot<RawFrame>>,
}

/// End of a connection.
pub(super) enum End {
    /// The stream is closed.
    Closed,
    /// The sender has ended between two frames.
    Disconnected,
    /// What follows cannot be read.
    Failed(StreamError),
}

impl Receiver {
    /// Receives frames until the stream is closed, or standard input ends.
    pub(super) fn run(self) {
        let _end = self.slot.end_guard();
        let error = self.receive_all().err().map(SourceError::over);
        self.slot.offer(Item::End(error));
    }

    /// Receives the frames of one sender after the other.
    ///
    /// # Errors
    /// Where the operating system reports one, or standard input fails.
    fn receive_all(&self) -> Result<(), StreamError> {
        while !self.slot.is_closed() {
            let arrival = self.endpoint.next_arrival().map_err(StreamError::Io)?;
            let end = match arrival {
                None => continue,
                Some(Arrival::Sender(file)) => {
                    info!("a sender has connected");
                    self.receive(file)
                }
                Some(Arrival::Stranger(file, stranger)) => {
                    let error = StreamError::Stranger(stranger);
                    self.endpoint.refuse(&file, &ErrorChain(&error).to_string());
                    End::Failed(error)
                }
            };
            let is_only = self.endpoint.is_input();
            let error = match end {
                End::Closed => return Ok(()),
                End::Disconnected if is_only => return Ok(()),
                End::Disconnected => StreamError::Disconnected,
                End::Failed(error) if is_only => return Err(error),
                End::Failed(error) => error,
            };
            debug!(error = %ErrorChain(&error), "the connection of a sender has ended");
            self.slot.offer(Item::Lost(SourceError::new(error)));
        }
        Ok(())
    }

    /// Receives the frames of one sender. Returns why they end, and tells the sender where it has
    /// not ended by itself.
    fn receive(&self, file: File) -> End {
        let is_closed = || self.slot.is_closed();
        let mut input = BufReader::new(Connection::new(file, &self.endpoint, &is_closed));
        let mut clock = SenderClock::new();
        for number in 1.. {
            match self.next_frame(&mut input, number, &mut clock) {
                Ok(Ok(frame)) => self.slot.offer(Item::Frame(frame)),
                Ok(Err(lost)) => self.slot.offer(Item::Lost(SourceError::new(lost))),
                Err(end) => {
                    if let End::Failed(error) = &end {
                        input.get_ref().refuse(&ErrorChain(error).to_string());
                    }
                    return end;
                }
            };
        }
        End::Closed
    }

    /// Receives frame `number`. Returns it, or its loss.
    ///
    /// # Errors
    /// Where the connection ends, or cannot be read on.
    fn next_frame(
        &self,
        input: &mut BufReader<Connection<'_>>,
        number: u64,
        clock: &mut SenderClock,
    ) -> Result<Result<RawFrame, StreamError>, End> {
        input.get_mut().is_in_frame = false;
        match input.fill_buf() {
            Ok([]) => return Err(End::Disconnected),
            Ok(_) => {}
            Err(error) if error.kind() == ErrorKind::ConnectionReset => {
                return Err(End::Disconnected);
            }
            Err(error) => return Err(End::of(error, number)),
        }
        let arrival = self.clock.now();
        input.get_mut().is_in_frame = true;
        let frame = read_frame(input, number)?;
        let time = clock.taken(frame.header.t, frame.header.age, arrival);
        Ok(time.map(|time| RawFrame { time, ..frame }).map_err(StreamError::from))
    }
}

impl End {
    /// Returns the end of a connection by an error within frame `number`.
    fn of(error: std::io::Error, number: u64) -> Self {
        Self::Failed(match Interruption::of(&error) {
            Some(Interruption::Closed) => return Self::Closed,
            Some(Interruption::Stalled) => StreamError::Stalled { number, waited: SILENCE },
            Some(Interruption::GaveWay) => StreamError::GaveWay,
            None if error.kind() == ErrorKind::ConnectionReset => StreamError::Truncated { number },
            None => StreamError::Io(error),
        })
    }
}

/// Reads frame `number`. Its time is that of the sender.
pub(super) fn read_frame(input: &mut impl BufRead, number: u64) -> Result<RawFrame, End> {
    let header = read_header(input, number)?;
    let colour = read_bytes(input, header.colour_bytes, number)?;
    let depth = read_bytes(input, header.depth_bytes, number)?;
    Ok(RawFrame { header, time: header.t, colour, depth })
}

/// Reads the header of frame `number`.
fn read_header(input: &mut impl BufRead, number: u64) -> Result<Header, End> {
    let refused = |error| End::Failed(StreamError::Header { number, error });
    let line = match read_line(input, MAX_HEADER_BYTES) {
        Ok(line) => line.unwrap_or_default(),
        Err(LineError::Io(error)) => return Err(End::of(error, number)),
        Err(error) => return Err(refused(HeaderError::Line(error))),
    };
    if !line.ends_with('\n') {
        return Err(End::Failed(StreamError::Truncated { number }));
    }
    Header::parse(&line).map_err(refused)
}

/// Reads `count` bytes of frame `number`.
fn read_bytes(input: &mut impl BufRead, count: u64, number: u64) -> Result<Vec<u8>, End> {
    let mut bytes = Vec::with_capacity(count.min(MAX_RESERVED) as usize);
    match input.take(count).read_to_end(&mut bytes) {
        Ok(_) if bytes.len() as u64 == count => Ok(bytes),
        Ok(_) => Err(End::Failed(StreamError::Truncated { number })),
        Err(error) => Err(End::of(error, number)),
    }
}

/// Thread that receives a stream. Dropping it closes the stream and waits for the thread, which
/// takes a tenth of a second at most.
#[derive(Debug)]
pub(super) struct Reception {
    slot: Arc<Slot<RawFrame>>,
    /// `None` once it is joined.
    thread: Option<JoinHandle<()>>,
}

impl Reception {
    /// Listens at `address`. Frames are stamped with `clock`.
    ///
    /// # Errors
    /// Where the address cannot be used, or the operating system starts no thread.
    pub(super) fn start(address: &StreamAddress, clock: LiveClock) -> Result<Self, StreamError> {
        let slot = Arc::new(Slot::default());
        let receiver =
            Receiver { endpoint: Endpoint::listen(address)?, clock, slot: Arc::clone(&slot) };
        let thread = thread::Builder::new().name("stream".to_owned());
        let thread = thread.spawn(move || receiver.run()).map_err(StreamError::Io)?;
        Ok(Self { slot, thread: Some(thread) })
    }

    /// Returns the place of the newest frame.
    pub(super) fn slot(&self) -> &Slot<RawFrame> {
        &self.slot
    }
}

impl Drop for Reception {
    fn drop(&mut self) {
        self.slot.close();
        if let Some(thread) = self.thread.take() {
            let _panicked = thread.join();
        }
    }
}

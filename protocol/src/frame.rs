//! Framing: postcard bytes, their CRC-32 (ISO-HDLC, little endian) behind them, COBS around both, a zero at the end.

use core::fmt;

use crc::{CRC_32_ISO_HDLC, Crc, Table};
use heapless::Vec;
use serde::{Serialize, de::DeserializeOwned};

/// Largest frame, its closing zero included, bytes.
pub const MAX_FRAME: usize = 256;

/// Largest message, bytes of postcard: a frame less CRC, COBS overhead (1 byte up to 253) and zero.
pub const MAX_MESSAGE: usize = 248;

const CRC_LEN: usize = 4;
const _: () = assert!(MAX_MESSAGE + CRC_LEN + 2 <= MAX_FRAME && MAX_MESSAGE + CRC_LEN < 254);

// With a table of a kilobyte, in one place: bit by bit it would take the board a quarter of a tick for each message.
static CRC: Crc<u32, Table<1>> = Crc::<u32, Table<1>>::new(&CRC_32_ISO_HDLC);

/// A whole frame, ready to be sent.
pub type Frame = Vec<u8, MAX_FRAME>;

/// The message does not fit [`MAX_MESSAGE`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TooLong;

impl fmt::Display for TooLong {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "the message is longer than {MAX_MESSAGE} bytes")
    }
}

impl core::error::Error for TooLong {}

/// The frame of `message`.
///
/// # Errors
/// Where it is too long for a frame; no message of this crate is.
pub fn encode<T: Serialize>(message: &T) -> Result<Frame, TooLong> {
    let mut plain = [0; MAX_MESSAGE + CRC_LEN];
    let len = postcard::to_slice(message, &mut plain[..MAX_MESSAGE]).map_err(|_| TooLong)?.len();
    let crc = CRC.checksum(&plain[..len]).to_le_bytes();
    plain[len..len + CRC_LEN].copy_from_slice(&crc);

    let mut frame = Frame::new();
    frame.resize_default(MAX_FRAME).map_err(|_| TooLong)?;
    let len = cobs::encode(&plain[..len + CRC_LEN], &mut frame);
    frame.truncate(len);
    frame.push(0).map_err(|_| TooLong)?;
    Ok(frame)
}

/// Why a frame was dropped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FrameError {
    /// More than [`MAX_FRAME`] bytes came without a zero.
    Overlong,
    /// It is not COBS: torn, or bytes were lost.
    Torn,
    /// The CRC does not match.
    Crc,
    /// The bytes arrived intact, but they are no message of this schema.
    Malformed,
}

impl fmt::Display for FrameError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Overlong => "a frame without an end",
            Self::Torn => "a torn frame",
            Self::Crc => "a corrupted frame (CRC)",
            Self::Malformed => "an intact frame that is no message of this version",
        })
    }
}

impl core::error::Error for FrameError {}

/// Shows `see` the message in a frame without its closing zero; `frame` is used as scratch space. By reference, since a message
/// of some hundred bytes takes the board as many clocks to copy.
#[inline(always)]
fn decode<T: DeserializeOwned, R>(frame: &mut [u8], see: impl FnOnce(Result<&T, FrameError>) -> R) -> R {
    let mut reader = match check(frame) {
        Ok(message) => postcard::Deserializer::from_bytes(message),
        Err(error) => return see(Err(error)),
    };
    match T::deserialize(&mut reader) {
        Ok(message) if reader.finalize().is_ok_and(<[u8]>::is_empty) => see(Ok(&message)),
        _ => see(Err(FrameError::Malformed)),
    }
}

/// The bytes of the message in a frame without its closing zero, if they have arrived intact.
fn check(frame: &mut [u8]) -> Result<&[u8], FrameError> {
    let len = cobs::decode_in_place(frame).map_err(|_| FrameError::Torn)?;
    let plain = frame.get(..len).ok_or(FrameError::Torn)?;
    let (message, crc) = plain.split_last_chunk::<CRC_LEN>().ok_or(FrameError::Torn)?;
    if CRC.checksum(message) == u32::from_le_bytes(*crc) { Ok(message) } else { Err(FrameError::Crc) }
}

/// Finds the frames in a stream of bytes that may begin anywhere and be damaged anywhere: whatever came before, the
/// next zero byte starts afresh.
#[derive(Debug, Clone, Default)]
pub struct Accumulator {
    buffer: Vec<u8, MAX_FRAME>,
    overlong: bool,
}

impl Accumulator {
    /// An empty one.
    pub const fn new() -> Self {
        Self { buffer: Vec::new(), overlong: false }
    }

    /// Takes the next byte; what it completes, if anything. Empty frames (zeros in a row) are passed over: a sender
    /// may put a zero first to end whatever was there.
    pub fn push<T: DeserializeOwned + Clone>(&mut self, byte: u8) -> Option<Result<T, FrameError>> {
        self.take(&mut &[byte][..], |message: Result<&T, _>| message.cloned())
    }

    /// Takes bytes off the front of `bytes`, up to the next zero where there is one; what `see` makes of what they complete, if
    /// anything.
    #[inline(always)]
    pub fn take<T: DeserializeOwned, R>(
        &mut self,
        bytes: &mut &[u8],
        see: impl FnOnce(Result<&T, FrameError>) -> R,
    ) -> Option<R> {
        let end = bytes.iter().position(|&byte| byte == 0);
        let (part, rest) = bytes.split_at(end.unwrap_or(bytes.len()));
        // Of an overlong frame nothing is needed.
        self.overlong |= self.buffer.extend_from_slice(part).is_err();
        *bytes = rest.get(1..).unwrap_or_default();
        end?;
        let complete = match (self.overlong, self.buffer.is_empty()) {
            (true, _) => Some(see(Err(FrameError::Overlong))),
            (false, true) => None,
            (false, false) => Some(decode(&mut self.buffer, see)),
        };
        self.buffer.clear();
        self.overlong = false;
        complete
    }
}

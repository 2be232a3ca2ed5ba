//! Framing: a frame contains postcard bytes and their CRC-32 (ISO-HDLC, little endian), encoded
//! with COBS, and ends with a zero byte.

use core::fmt;

use crc::{CRC_32_ISO_HDLC, Crc, Table};
use heapless::Vec;
use serde::{Serialize, de::DeserializeOwned};

/// Largest frame including its closing zero, bytes.
pub const MAX_FRAME: usize = 256;

/// Largest message in postcard, bytes: a frame without the CRC, the COBS overhead (1 byte for up to
/// 253 bytes) and the zero.
pub const MAX_MESSAGE: usize = 248;

const CRC_LEN: usize = 4;
/// Largest decoded frame, bytes: one less than the encoded one, for the first COBS code.
const MAX_PLAIN: usize = MAX_FRAME - 1;
const _: () = assert!(MAX_MESSAGE + CRC_LEN + 2 <= MAX_FRAME && MAX_MESSAGE + CRC_LEN < 254);

// A table of 1 KiB. Without it, the CRC of one message takes the board a quarter of a tick.
pub(crate) static CRC: Crc<u32, Table<1>> = Crc::<u32, Table<1>>::new(&CRC_32_ISO_HDLC);

/// A complete frame with its closing zero.
pub type Frame = Vec<u8, MAX_FRAME>;

/// Error: a message is longer than [`MAX_MESSAGE`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TooLong;

impl fmt::Display for TooLong {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "the message is longer than {MAX_MESSAGE} bytes")
    }
}

impl core::error::Error for TooLong {}

/// Encodes `message` as a frame.
///
/// # Errors
/// [`TooLong`] if the message does not fit a frame. Every message about three motors fits.
pub fn encode<T: Serialize>(message: &T) -> Result<Frame, TooLong> {
    let mut plain = [0; MAX_MESSAGE + CRC_LEN];
    let len = postcard::to_slice(message, &mut plain[..MAX_MESSAGE]).map_err(|_| TooLong)?.len();
    framed(&mut plain, len)
}

/// Returns the frame of a message of the first `len` bytes, behind which is room for the CRC. It is
/// there once for all types of messages: the firmware has little room.
#[inline(never)]
fn framed(plain: &mut [u8; MAX_MESSAGE + CRC_LEN], len: usize) -> Result<Frame, TooLong> {
    let crc = checksum(&plain[..len]).to_le_bytes();
    plain[len..len + CRC_LEN].copy_from_slice(&crc);

    let mut frame = Frame::new();
    frame.resize_default(MAX_FRAME).map_err(|_| TooLong)?;
    let len = cobs::encode(&plain[..len + CRC_LEN], &mut frame);
    frame.truncate(len);
    frame.push(0).map_err(|_| TooLong)?;
    Ok(frame)
}

/// Reason for dropping a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FrameError {
    /// More than [`MAX_FRAME`] bytes arrived without a zero.
    Overlong,
    /// The COBS code is incomplete, or shorter than a CRC: bytes are missing.
    Torn,
    /// The CRC does not match.
    Crc,
    /// The CRC matches, but the bytes are not a message of this schema.
    Malformed,
    /// The CRC matches, and the bytes begin as a request does, whose command this program does not
    /// know.
    UnknownCommand {
        /// [`ToBoard::id`](crate::message::ToBoard::id).
        id: u16,
    },
}

impl fmt::Display for FrameError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Overlong => "an overlong frame",
            Self::Torn => "a torn frame",
            Self::Crc => "a corrupted frame (CRC)",
            Self::Malformed => "an intact frame that is not a message of this version",
            Self::UnknownCommand { .. } => "a command that this version does not know",
        })
    }
}

impl core::error::Error for FrameError {}

/// Decodes a message from its postcard bytes.
///
/// # Errors
/// [`FrameError::Malformed`] if the bytes are not a message of this schema.
pub fn read<T: DeserializeOwned>(message: &[u8]) -> Result<T, FrameError> {
    match postcard::take_from_bytes(message) {
        Ok((message, [])) => Ok(message),
        _ => Err(FrameError::Malformed),
    }
}

/// Returns the CRC of a message's postcard bytes, as its frame has it.
pub fn checksum(message: &[u8]) -> u32 {
    CRC.checksum(message)
}

/// Checks the CRC of a decoded frame and returns the postcard bytes of its message.
fn check(plain: &[u8]) -> Result<&[u8], FrameError> {
    let (message, crc) = plain.split_last_chunk::<CRC_LEN>().ok_or(FrameError::Torn)?;
    if checksum(message) == u32::from_le_bytes(*crc) { Ok(message) } else { Err(FrameError::Crc) }
}

/// Decoder that finds the frames in a stream of bytes. The stream may start inside a frame and may
/// be damaged. After damage, decoding starts again behind the next zero byte.
///
/// It removes COBS run by run while the bytes arrive. The `cobs` crate has an incremental decoder
/// (`DecoderState::feed`), which takes one byte at a time. With that decoder, the time from a
/// position's last byte to the new rate is 7 µs longer at worst and 16 µs in the median, measured
/// with `make bench-chip`.
#[derive(Debug, Clone)]
pub struct Accumulator {
    /// Decoded bytes of the current frame.
    plain: [u8; MAX_PLAIN],
    /// Number of used bytes in `plain`.
    len: usize,
    /// Number of bytes until the next COBS code.
    run: u8,
    /// Whether the next COBS code represents a zero byte.
    zero: bool,
    /// Whether the first byte of the frame has arrived.
    begun: bool,
    /// Whether the frame is longer than `plain`.
    overlong: bool,
}

impl Default for Accumulator {
    fn default() -> Self {
        Self::new()
    }
}

impl Accumulator {
    /// Creates an empty accumulator.
    pub const fn new() -> Self {
        Self { plain: [0; MAX_PLAIN], len: 0, run: 0, zero: false, begun: false, overlong: false }
    }

    /// Takes the next byte and returns the message that it completes. Empty frames (consecutive
    /// zeros) are ignored: a sender may send a zero first, to end an incomplete frame.
    pub fn push<T: DeserializeOwned>(&mut self, byte: u8) -> Option<Result<T, FrameError>> {
        self.take(&mut &[byte][..]).map(|message| message.and_then(read))
    }

    /// Removes the bytes up to the end of the first frame from the front of `bytes`. Returns that
    /// frame's message as bytes for [`read`], or `None` if no frame ends in `bytes`.
    #[inline(always)]
    pub fn take(&mut self, bytes: &mut &[u8]) -> Option<Result<&[u8], FrameError>> {
        if !self.find_end(bytes) {
            return None;
        }
        let (len, torn, overlong) = (self.len, self.run > 0, self.overlong);
        (self.len, self.run, self.zero, self.begun, self.overlong) = (0, 0, false, false, false);
        Some(match self.plain.get(..len) {
            _ if overlong => Err(FrameError::Overlong),
            Some(plain) if !torn => check(plain),
            _ => Err(FrameError::Torn),
        })
    }

    /// Decodes bytes from the front of `bytes` and removes them. Returns whether a frame that is
    /// not empty has ended.
    #[inline(always)]
    fn find_end(&mut self, bytes: &mut &[u8]) -> bool {
        while let Some((&byte, rest)) = self.take_run(bytes).split_first() {
            *bytes = rest;
            match byte {
                0 if self.begun => return true,
                0 => {}
                _ => self.begin_run(byte),
            }
        }
        *bytes = &[];
        false
    }

    /// Takes the bytes of the current run and returns the bytes behind it.
    #[inline(always)]
    fn take_run<'a>(&mut self, bytes: &'a [u8]) -> &'a [u8] {
        let room = self.plain.get_mut(self.len..).unwrap_or_default();
        let run = bytes.get(..usize::from(self.run)).unwrap_or(bytes);
        let mut count = 0;
        for (place, &byte) in room.iter_mut().zip(run) {
            if byte == 0 {
                break;
            }
            *place = byte;
            count += 1;
        }
        self.len += count;
        self.run -= count as u8;
        bytes.get(count..).unwrap_or_default()
    }

    /// Begins the run of COBS code `byte` (1 to 255), which has `byte` - 1 bytes. A zero follows
    /// the run unless the code is 255.
    #[inline(always)]
    fn begin_run(&mut self, byte: u8) {
        if self.zero {
            self.reserve(1);
            self.plain[self.len] = 0;
            self.len += 1;
        }
        (self.run, self.zero, self.begun) = (byte - 1, byte < 255, true);
        self.reserve(usize::from(self.run));
    }

    /// Makes room for `count` bytes (at most 254). Discards the bytes of an overlong frame.
    #[inline(always)]
    fn reserve(&mut self, count: usize) {
        if count > MAX_PLAIN - self.len {
            (self.len, self.overlong) = (0, true);
        }
    }
}

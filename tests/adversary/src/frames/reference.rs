//! Reference decoder: the frame format by its definition, without optimisation.

use plumb_protocol::frame::{FrameError, MAX_FRAME};

/// Bytes of a frame's checksum.
const CRC_LEN: usize = 4;

/// Returns the message in `frame`, the bytes between two zeros.
///
/// # Errors
/// As [`Accumulator::take`](plumb_protocol::frame::Accumulator::take).
pub fn decode(frame: &[u8]) -> Result<Vec<u8>, FrameError> {
    let plain = take_cobs_off(frame)?;
    let (message, crc) = plain.split_last_chunk::<CRC_LEN>().ok_or(FrameError::Torn)?;
    if crc32(message).to_le_bytes() == *crc { Ok(message.to_vec()) } else { Err(FrameError::Crc) }
}

/// Decodes COBS: each block starts with its length, and represents its other bytes and, unless it
/// has 255 bytes or is the last, a zero. A frame of [`MAX_FRAME`] bytes or more is overlong.
fn take_cobs_off(frame: &[u8]) -> Result<Vec<u8>, FrameError> {
    let mut plain = Vec::new();
    let mut rest = frame;
    let mut zero = false;
    while let Some((&length, behind)) = rest.split_first() {
        let block = usize::from(length) - 1;
        if zero {
            plain.push(0);
        }
        if plain.len() + block >= MAX_FRAME {
            return Err(FrameError::Overlong);
        }
        let (bytes, next) = behind.split_at_checked(block).ok_or(FrameError::Torn)?;
        plain.extend_from_slice(bytes);
        zero = length < 255;
        rest = next;
    }
    Ok(plain)
}

/// Returns the CRC-32 (ISO-HDLC) bit by bit.
fn crc32(bytes: &[u8]) -> u32 {
    let mut crc = u32::MAX;
    for &byte in bytes {
        crc ^= u32::from(byte);
        for _ in 0..8 {
            crc = if crc & 1 == 1 { (crc >> 1) ^ 0xEDB8_8320 } else { crc >> 1 };
        }
    }
    !crc
}

/// Splits a stream into frames.
#[derive(Debug, Clone, Default)]
pub struct Decoder {
    frame: Vec<u8>,
}

impl Decoder {
    /// Adds a byte; returns the message that it completes, or the error.
    pub fn push(&mut self, byte: u8) -> Option<Result<Vec<u8>, FrameError>> {
        if byte != 0 {
            self.frame.push(byte);
            return None;
        }
        let frame = std::mem::take(&mut self.frame);
        if frame.is_empty() { None } else { Some(decode(&frame)) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_checksum_has_its_catalogue_value() {
        assert_eq!(crc32(b"123456789"), 0xCBF4_3926);
    }

    #[test]
    fn blocks_are_decoded() {
        assert_eq!(take_cobs_off(&[3, 7, 8, 2, 9]), Ok(vec![7, 8, 0, 9]));
        assert_eq!(take_cobs_off(&[1, 1, 1]), Ok(vec![0, 0]));
        assert_eq!(take_cobs_off(&[9, 1]), Err(FrameError::Torn));
        assert_eq!(take_cobs_off(&[1; 257]), Err(FrameError::Overlong));
        assert_eq!(decode(&[1]), Err(FrameError::Torn));
    }
}

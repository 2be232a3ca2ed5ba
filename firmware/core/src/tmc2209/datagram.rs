//! Datagrams on the single wire (section 4.1), with their CRC (section 4.2).

use plumb_protocol::dimension::PerMotor;

/// Most bytes that arrive in an exchange: the echo of a request to read and the reply, or the echo
/// of a write.
pub const MAX_RECEIVED: usize = READ + REPLY;

/// Bytes of a request to read.
const READ: usize = 4;
/// Bytes of a write.
const WRITE: usize = 8;
/// Bytes of a reply.
const REPLY: usize = 8;
/// First byte of every datagram.
const SYNC: u8 = 0x05;
/// Address of the master, in replies.
const MASTER: u8 = 0xff;
/// Bit of a register's address in a write.
const IS_WRITE: u8 = 0x80;

/// A datagram to be sent, and how the DIR pins are to stand meanwhile.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Exchange {
    pub(super) bytes: [u8; WRITE],
    /// Levels of the pins DIR of motors A, B and C; `None` leaves them to the step generator. They
    /// are set only while the drivers are off.
    pub directions: Option<PerMotor<bool>>,
}

/// Reason why an exchange has no answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum NoAnswer {
    /// Nothing came after the request.
    Silent,
    /// Something else came.
    Damaged,
}

impl Exchange {
    /// Returns a request to read a register.
    #[cold]
    pub(super) fn read(address: u8, register: u8) -> Self {
        let mut bytes = [0; WRITE];
        bytes[..READ - 1].copy_from_slice(&[SYNC, address, register]);
        bytes[READ - 1] = crc(&bytes[..READ - 1]);
        Self { bytes, directions: None }
    }

    /// Returns a write to a register.
    #[cold]
    pub(super) fn write(address: u8, register: u8, value: u32) -> Self {
        let mut bytes = [0; WRITE];
        bytes[..3].copy_from_slice(&[SYNC, address, register | IS_WRITE]);
        bytes[3..WRITE - 1].copy_from_slice(&value.to_be_bytes());
        bytes[WRITE - 1] = crc(&bytes[..WRITE - 1]);
        Self { bytes, directions: None }
    }

    /// Returns whether a driver answers.
    fn is_read(&self) -> bool {
        self.bytes[2] & IS_WRITE == 0
    }

    /// Returns the bytes to be sent.
    #[cold]
    pub fn bytes(&self) -> &[u8] {
        let length = if self.is_read() { READ } else { WRITE };
        &self.bytes[..length]
    }

    /// Returns the value that a driver has answered with; 0 for a write, which has no answer.
    /// `received` is what came over the wire: an echo of the request, then the reply.
    #[cold]
    pub(super) fn answer(&self, received: &[u8]) -> Result<u32, NoAnswer> {
        if !self.is_read() {
            return Ok(0);
        }
        let reply = match received.strip_prefix(self.bytes()) {
            Some([]) => return Err(NoAnswer::Silent),
            None if received.is_empty() => return Err(NoAnswer::Silent),
            reply => reply.unwrap_or_default(),
        };
        match *reply {
            [SYNC, MASTER, register, a, b, c, d, check]
                if register == self.bytes[2] && check == crc(&reply[..REPLY - 1]) =>
            {
                Ok(u32::from_be_bytes([a, b, c, d]))
            }
            _ => Err(NoAnswer::Damaged),
        }
    }
}

/// Returns the CRC of a datagram: x^8 + x^2 + x + 1 from 0, the lowest bit of each byte first.
#[cold]
pub(super) fn crc(bytes: &[u8]) -> u8 {
    let bits = bytes.iter().flat_map(|byte| (0..8).map(move |bit| byte >> bit & 1));
    bits.fold(0, |crc, bit| crc << 1 ^ if crc >> 7 ^ bit == 0 { 0 } else { 0x07 })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A write and a reply as others have recorded them: ST's forum, "TMC2209" (CHOPCONF of driver
    /// 0 = 0x10000053), and the wiki of TMC2209_Raspberry_Pi (IOIN = 0x21000241).
    #[test]
    fn the_crc_is_that_of_recorded_datagrams() {
        let write = Exchange::write(0, 0x6c, 0x1000_0053);
        assert_eq!(write.bytes(), [0x05, 0x00, 0xec, 0x10, 0x00, 0x00, 0x53, 0x9c]);
        let reply = [0x05, 0xff, 0x06, 0x21, 0x00, 0x02, 0x41, 0x9d];
        assert_eq!(crc(&reply[..7]), reply[7]);
        let read = Exchange::read(0, 0x06);
        let received = [read.bytes(), &reply].concat();
        assert_eq!(read.answer(&received), Ok(0x2100_0241));
    }

    #[test]
    fn every_damaged_bit_and_every_missing_byte_of_an_answer_is_seen() {
        let read = Exchange::read(2, 0x6f);
        let mut reply = [0x05, 0xff, 0x6f, 0xc0, 0x1f, 0x00, 0x00, 0];
        reply[7] = crc(&reply[..7]);
        let received = [read.bytes(), &reply].concat();
        assert_eq!(read.answer(&received), Ok(0xc01f_0000));
        for bit in 0..8 * received.len() {
            let mut damaged = received.clone();
            damaged[bit / 8] ^= 1 << (bit % 8);
            assert_eq!(read.answer(&damaged), Err(NoAnswer::Damaged), "bit {bit}");
        }
        for length in 1..received.len() {
            let expected = if length == READ { NoAnswer::Silent } else { NoAnswer::Damaged };
            assert_eq!(read.answer(&received[..length]), Err(expected), "{length} bytes");
        }
        assert_eq!(read.answer(&[]), Err(NoAnswer::Silent));
        // The answer to another question.
        let other = Exchange::read(2, 0x06);
        let received = [other.bytes(), &reply].concat();
        assert_eq!(other.answer(&received), Err(NoAnswer::Damaged));
    }
}

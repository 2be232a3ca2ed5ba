//! The chip's serial port on USB, for a link of the host in the chip's time.

use std::time::Duration;

use plumb_runtime::link::{LinkError, Transport};
use serde_json::json;

use super::{CYCLES_PER_US, Chip};

/// Port of a chip. The chip's time passes while the link waits.
pub struct ChipPort<'a> {
    chip: &'a mut Chip,
    /// Bytes that the link has received, of all that the board has sent.
    read: usize,
}

impl Chip {
    /// Opens the port: what the board has sent before is discarded.
    pub fn port(&mut self) -> ChipPort<'_> {
        let read = self.usb_bytes.len();
        ChipPort { chip: self, read }
    }
}

impl Transport for ChipPort<'_> {
    fn name(&self) -> String {
        "the emulated chip".to_owned()
    }

    fn now(&self) -> Duration {
        Duration::from_micros(self.chip.cycle / CYCLES_PER_US)
    }

    fn send(&mut self, bytes: &[u8]) -> Result<(), LinkError> {
        self.chip.send(bytes, 0);
        Ok(())
    }

    fn receive(&mut self, bytes: &mut Vec<u8>, wait: Duration) -> Result<(), LinkError> {
        if self.read == self.chip.usb_bytes.len() {
            self.chip.execute(json!({ "receive_us": wait.as_micros() as u64 }));
        }
        bytes.extend(&self.chip.usb_bytes[self.read..]);
        self.read = self.chip.usb_bytes.len();
        Ok(())
    }
}

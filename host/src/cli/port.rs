//! The open port of a board.

use std::time::Duration;

use plumb_runtime::link::{LinkError, Serial, Transport};
use plumb_sim::led_port::LedPort;

/// Open port of the board of a rig file.
pub(crate) enum Port {
    /// A serial port, in real time.
    Serial(Serial),
    /// That of an emulated board, which waits for this program.
    Led(LedPort),
}

impl Port {
    /// Takes the time of the board at `serial`, where it gives it.
    pub(crate) fn led(serial: Serial) -> Self {
        LedPort::take(serial).map_or_else(Self::Serial, Self::Led)
    }

    /// Returns the port of an emulated board that waits for this program.
    pub(crate) fn led_port(&self) -> Option<&LedPort> {
        match self {
            Self::Serial(_) => None,
            Self::Led(port) => Some(port),
        }
    }

    /// Returns whether a program is at the other end, such as an emulated board.
    pub(crate) fn is_pseudo_terminal(&self) -> bool {
        match self {
            Self::Serial(serial) => serial.is_pseudo_terminal(),
            Self::Led(_) => true,
        }
    }
}

impl Transport for Port {
    fn name(&self) -> String {
        match self {
            Self::Serial(serial) => serial.name(),
            Self::Led(port) => port.name(),
        }
    }

    fn now(&self) -> Duration {
        match self {
            Self::Serial(serial) => serial.now(),
            Self::Led(port) => port.now(),
        }
    }

    fn leads(&self) -> bool {
        self.led_port().is_some()
    }

    fn send(&mut self, bytes: &[u8]) -> Result<(), LinkError> {
        match self {
            Self::Serial(serial) => serial.send(bytes),
            Self::Led(port) => port.send(bytes),
        }
    }

    fn receive(&mut self, bytes: &mut Vec<u8>, wait: Duration) -> Result<(), LinkError> {
        match self {
            Self::Serial(serial) => serial.receive(bytes, wait),
            Self::Led(port) => port.receive(bytes, wait),
        }
    }
}

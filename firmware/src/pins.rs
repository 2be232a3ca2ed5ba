//! Which pin does what (docs/use/board.md draws them). All others are left alone.

/// UART0, from the host; GP0 is to the host.
pub(crate) const UART_RX: u8 = 1;
/// STEP of motors A, B and C; DIR is the pin after it.
pub(crate) const STEP: [u8; 3] = [2, 4, 6];
/// Enables the drivers. Outside of [`Enable`](crate::enable) it is an input, and the resistor on
/// the wire decides.
pub(crate) const ENABLE: u8 = 14;
/// The emergency input: closed to ground is good, open stops.
pub(crate) const EMERGENCY: u8 = 15;

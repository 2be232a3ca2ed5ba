//! Which pin does what (docs/use/board.md draws them). All other pins are unused.

/// UART0 from the host; GP0 is to the host.
pub(crate) const UART_RX: u8 = 1;
/// STEP of motors A, B and C; DIR is the pin after it.
pub(crate) const STEP: [u8; 3] = [2, 4, 6];
/// Enable line of the drivers. As an input its level comes from the resistor on the wire.
pub(crate) const ENABLE: u8 = 14;
/// Emergency input: closed to ground in operation, open to stop.
pub(crate) const ESTOP: u8 = 15;

//! Number of a place in the source where the board's program may panic.

use crate::frame::CRC;

/// Returns the number of a place in the source: the CRC-32 of the file's path, as the compiler
/// gives it, and of the line, little endian. It fits a register that keeps its content over a
/// restart. `scripts/panic-place` finds the place again.
pub fn panic_place(file: &str, line: u32) -> u32 {
    let mut digest = CRC.digest();
    digest.update(file.as_bytes());
    digest.update(&line.to_le_bytes());
    digest.finalize()
}

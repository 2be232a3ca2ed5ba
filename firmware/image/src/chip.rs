//! The chips: their memories and the families of their UF2 files.

use std::ops::Range;

/// A chip with the flash of its board.
#[derive(Debug, PartialEq, Eq)]
pub struct Chip {
    /// Its name, with its board's.
    pub name: &'static str,
    /// Addresses of the flash.
    pub flash: Range<u32>,
    /// Addresses of the RAM.
    pub ram: Range<u32>,
    /// Label of its bootloader's drive, which is also the Board-ID in INFO_UF2.TXT there.
    pub drive: &'static str,
    /// Family of its UF2 files (<https://github.com/raspberrypi/pico-sdk>, boot/uf2.h).
    pub family: u32,
    /// Whether a UF2 file begins with a block for no chip, which the boot ROM of the stepping A2
    /// needs to count the others (RP2350-E10).
    pub begins_with_absolute: bool,
}

/// The RP2040 of a Pico: 2 MiB of flash, 264 KiB of RAM.
pub static RP2040: Chip = Chip {
    name: "the RP2040 of a Pico",
    flash: 0x1000_0000..0x1020_0000,
    ram: 0x2000_0000..0x2004_2000,
    drive: "RPI-RP2",
    family: 0xe48b_ff56,
    begins_with_absolute: false,
};

/// The RP2350 of a Pico 2: 4 MiB of flash, 520 KiB of RAM. The family is that of programs for its
/// Arm processors in their secure state.
pub static RP2350: Chip = Chip {
    name: "the RP2350 of a Pico 2",
    flash: 0x1000_0000..0x1040_0000,
    ram: 0x2000_0000..0x2008_2000,
    drive: "RP2350",
    family: 0xe48b_ff59,
    begins_with_absolute: true,
};

/// All chips.
pub static ALL: [&Chip; 2] = [&RP2040, &RP2350];

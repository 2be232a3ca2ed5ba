//! UF2 format: blocks of 512 bytes. Each block contains 256 bytes of flash and their address, so
//! that a file system can write the blocks in any order (<https://github.com/microsoft/uf2>).

use std::collections::BTreeSet;

use thiserror::Error;

use crate::chip::{ALL, Chip, RP2040, RP2350};

/// Flash content of a block, bytes.
pub const PAYLOAD: usize = 256;

/// Size of the flash's sectors, bytes.
const SECTOR: usize = 4096;

/// Size of a block, bytes.
pub const BLOCK: usize = 512;

const MAGIC: [u32; 2] = [0x0a32_4655, 0x9e5d_5157];
const MAGIC_END: u32 = 0x0ab1_6f30;
const FAMILY_PRESENT: u32 = 0x2000;
/// A block that is for no chip: flag, family and address, and the word after its content that says
/// so (pico-sdk, boot/uf2.h; picotool, elf2uf2: `gen_abs_block`). 0xef fills it.
const EXTENSION_PRESENT: u32 = 0x8000;
const ABSOLUTE: u32 = 0xe48b_ff57;
const ABSOLUTE_ADDRESS: u32 = 0x10ff_ff00;
const IGNORE: u32 = 0x9957_e304;

/// Reason why a file cannot be written to a board.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub enum Uf2Error {
    /// It is empty, or its first bytes are not those of a UF2 file.
    #[error("this is no UF2 file")]
    NotUf2,
    /// It ends within a block, or has fewer or more blocks than it says.
    #[error("the file has {found} bytes instead of {expected}: copy or build it again")]
    Length {
        /// Bytes of the file.
        found: usize,
        /// Bytes of all the blocks that the first one announces.
        expected: usize,
    },
    /// A block's magic numbers, number or size are wrong, or it comes twice.
    #[error("block {index} of the file is damaged: copy or build it again")]
    Damaged {
        /// Place of the block in the file.
        index: usize,
    },
    /// It is for another chip.
    #[error(
        "the file is for another chip (family {family:#010x}) than the RP2040 of a Pico \
         ({:#010x}) or the RP2350 of a Pico 2 ({:#010x})",
        RP2040.family,
        RP2350.family
    )]
    Family {
        /// The family's number; 0 where the file names none.
        family: u32,
    },
    /// It writes outside the flash.
    #[error("the file writes to {address:#010x}, which is outside the board's flash")]
    Address {
        /// The address.
        address: u32,
    },
    /// The boot ROM finds no program after the file is written.
    #[error(
        "the file has no program for the beginning of the flash ({:#010x})",
        RP2040.flash.start
    )]
    NoStart,
}

/// Firmware in a UF2 file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Firmware {
    /// The chip that it is for.
    pub chip: &'static Chip,
    /// Bytes of flash that it writes.
    pub size: usize,
}

/// Checks that the boot ROM of a chip accepts `file` and starts it. The first block tells the chip.
///
/// # Errors
/// The first thing that is wrong.
pub fn check(file: &[u8]) -> Result<Firmware, Uf2Error> {
    if !file.starts_with(&MAGIC[0].to_le_bytes()) {
        return Err(Uf2Error::NotUf2);
    }
    let file = file.strip_prefix(&absolute()).unwrap_or(file);
    let chip = chip(file)?;
    let announced = word(file, 6).ok_or(Uf2Error::Length { found: file.len(), expected: BLOCK })?;
    let expected = (announced as usize).saturating_mul(BLOCK);
    if file.len() != expected {
        return Err(Uf2Error::Length { found: file.len(), expected });
    }
    let (mut numbers, mut addresses) = (BTreeSet::new(), BTreeSet::new());
    for (index, block) in file.chunks_exact(BLOCK).enumerate() {
        let (number, address) =
            check_block(chip, block, announced).ok_or(Uf2Error::Damaged { index })??;
        if !numbers.insert(number) || !addresses.insert(address) {
            return Err(Uf2Error::Damaged { index });
        }
    }
    if addresses.first() != Some(&chip.flash.start) {
        return Err(Uf2Error::NoStart);
    }
    Ok(Firmware { chip, size: addresses.len() * PAYLOAD })
}

/// Returns the chip of a file, by its first block. An RP2040's where the block is damaged, which is
/// found later.
fn chip(file: &[u8]) -> Result<&'static Chip, Uf2Error> {
    let (Some(flags), Some(family)) = (word(file, 2), word(file, 7)) else { return Ok(&RP2040) };
    let family = if flags & FAMILY_PRESENT == 0 { 0 } else { family };
    ALL.into_iter().find(|chip| chip.family == family).ok_or(Uf2Error::Family { family })
}

/// Returns number and address of a block of a file with `count` blocks; `None` where the block is
/// damaged.
fn check_block(chip: &Chip, block: &[u8], count: u32) -> Option<Result<(u32, u32), Uf2Error>> {
    let field = |index| word(block, index);
    let magic = [field(0)?, field(1)?, field(BLOCK / 4 - 1)?];
    let (flags, address, size, number) = (field(2)?, field(3)?, field(4)?, field(5)?);
    if magic != [MAGIC[0], MAGIC[1], MAGIC_END] || field(6)? != count || number >= count {
        return None;
    }
    let family = if flags & FAMILY_PRESENT == 0 { 0 } else { field(7)? };
    if family != chip.family {
        return Some(Err(Uf2Error::Family { family }));
    }
    // The boot ROM takes whole pages of the flash only (RP2040 datasheet, section 2.8.4.2; RP2350,
    // 5.5.2).
    if size as usize != PAYLOAD {
        return None;
    }
    if !chip.flash.contains(&address) || !address.is_multiple_of(PAYLOAD as u32) {
        return Some(Err(Uf2Error::Address { address }));
    }
    Some(Ok((number, address)))
}

/// Returns the little-endian word at `index`, where `bytes` reach so far.
fn word(bytes: &[u8], index: usize) -> Option<u32> {
    let (word, _) = bytes.get(4 * index..)?.split_first_chunk()?;
    Some(u32::from_le_bytes(*word))
}

/// Returns the UF2 file for `flash`, from the first address of the chip's flash on. The last block
/// is filled with 0xff.
///
/// The boot ROM erases only the sectors (4096 bytes) that the file writes. Other sectors keep their
/// content. For an RP2350 the last sector is filled up, as picotool does.
pub fn file(chip: &Chip, flash: &[u8]) -> Vec<u8> {
    let sector = if chip.begins_with_absolute { SECTOR / PAYLOAD } else { 1 };
    let count = flash.len().div_ceil(PAYLOAD).next_multiple_of(sector);
    let start = chip.begins_with_absolute.then(absolute);
    let blocks = (0..count).map(|index| {
        let bytes = flash.chunks(PAYLOAD).nth(index).unwrap_or_default();
        block(chip, bytes, index as u32, count as u32)
    });
    start.into_iter().chain(blocks).flatten().collect()
}

/// Returns the block that is for no chip.
fn absolute() -> [u8; BLOCK] {
    let flags = FAMILY_PRESENT | EXTENSION_PRESENT;
    let mut block =
        framed([flags, ABSOLUTE_ADDRESS, PAYLOAD as u32, 0, 2, ABSOLUTE], &[0xef; PAYLOAD]);
    block[32 + PAYLOAD..][..4].copy_from_slice(&IGNORE.to_le_bytes());
    block
}

/// Returns block `index` of `count`, with up to [`PAYLOAD`] bytes of the flash.
fn block(chip: &Chip, bytes: &[u8], index: u32, count: u32) -> [u8; BLOCK] {
    let address = chip.flash.start + index * PAYLOAD as u32;
    framed([FAMILY_PRESENT, address, PAYLOAD as u32, index, count, chip.family], bytes)
}

/// Returns a block with these words after its magic numbers, and up to [`PAYLOAD`] bytes.
fn framed(words: [u32; 6], bytes: &[u8]) -> [u8; BLOCK] {
    let head = MAGIC.into_iter().chain(words);
    let mut block = [0; BLOCK];
    for (place, word) in block.chunks_exact_mut(4).zip(head) {
        place.copy_from_slice(&word.to_le_bytes());
    }
    let payload = &mut block[32..32 + PAYLOAD];
    payload.fill(0xff);
    payload[..bytes.len()].copy_from_slice(bytes);
    block[BLOCK - 4..].copy_from_slice(&MAGIC_END.to_le_bytes());
    block
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns a file of three blocks, with the word at `index` of block `block` replaced.
    fn changed(block: usize, index: usize, value: u32) -> Vec<u8> {
        let mut file = file(&RP2040, &[0x5a; 3 * PAYLOAD]);
        let place = block * BLOCK + 4 * index;
        file[place..place + 4].copy_from_slice(&value.to_le_bytes());
        file
    }

    #[test]
    fn a_file_of_this_crate_is_accepted_in_any_order() {
        let file = file(&RP2040, &[0x5a; 700]);
        assert_eq!(check(&file), Ok(Firmware { chip: &RP2040, size: 3 * PAYLOAD }));
        let reversed: Vec<u8> = file.rchunks(BLOCK).flatten().copied().collect();
        assert_eq!(check(&reversed), Ok(Firmware { chip: &RP2040, size: 3 * PAYLOAD }));
    }

    #[test]
    fn every_damage_is_found() {
        assert_eq!(check(b""), Err(Uf2Error::NotUf2));
        assert_eq!(check(b"\x7fELF and more"), Err(Uf2Error::NotUf2));
        for (block, index, value) in
            [(1, 0, 0), (1, 1, 0), (2, 127, 0), (1, 4, 255), (2, 5, 3), (2, 5, 1), (1, 6, 4)]
        {
            let found = check(&changed(block, index, value));
            assert_eq!(found, Err(Uf2Error::Damaged { index: block }), "{block} {index} {value}");
        }
        // Two blocks for one place.
        assert_eq!(check(&changed(2, 3, RP2040.flash.start)), Err(Uf2Error::Damaged { index: 2 }));
    }

    #[test]
    fn a_file_that_is_cut_anywhere_is_refused() {
        let whole = file(&RP2040, &[0x5a; 3 * PAYLOAD]);
        for length in 0..whole.len() {
            let error = check(&whole[..length]).map_err(|error| error.to_string());
            assert!(error.is_err(), "{length} bytes");
        }
        let found = 2 * BLOCK;
        assert_eq!(check(&whole[..found]), Err(Uf2Error::Length { found, expected: 3 * BLOCK }));
    }

    #[test]
    fn another_chip_and_other_addresses_are_named() {
        let samd21 = 0x68ed_2b88;
        assert_eq!(check(&changed(0, 7, samd21)), Err(Uf2Error::Family { family: samd21 }));
        let rp2350 = RP2350.family;
        assert_eq!(check(&changed(1, 7, rp2350)), Err(Uf2Error::Family { family: rp2350 }));
        assert_eq!(check(&changed(1, 2, 0)), Err(Uf2Error::Family { family: 0 }));
        for address in
            [0x2000_0000, RP2040.flash.end, RP2040.flash.start - 256, RP2040.flash.start + 512 + 4]
        {
            assert_eq!(check(&changed(2, 3, address)), Err(Uf2Error::Address { address }));
        }
        let [one, other] = [0, 256].map(|offset| RP2040.flash.start + offset);
        let mut moved = file(&RP2040, &[0; 256]);
        assert_eq!(word(&moved, 3), Some(one));
        moved[12..16].copy_from_slice(&other.to_le_bytes());
        assert_eq!(check(&moved), Err(Uf2Error::NoStart));
    }

    /// The flash of a Pico 2 is written sector by sector, after a block that is for no chip.
    #[test]
    fn the_file_of_an_rp2350_begins_with_an_absolute_block_and_fills_its_sectors() {
        let file = file(&RP2350, &[0x5a; 5000]);
        assert_eq!(check(&file), Ok(Firmware { chip: &RP2350, size: 2 * SECTOR }));
        assert_eq!(file.len(), 33 * BLOCK);
        let words = [2, 3, 4, 5, 6, 7, 8 + 64].map(|index| word(&file, index));
        let expected = [0xa000, 0x10ff_ff00, 256, 0, 2, 0xe48b_ff57, 0x9957_e304];
        assert_eq!(words, expected.map(Some));
        assert_eq!(word(&file, 128 + 7), Some(0xe48b_ff59));
        // Without that block it is as good on later steppings.
        assert_eq!(check(&file[BLOCK..]), Ok(Firmware { chip: &RP2350, size: 2 * SECTOR }));
        assert_eq!(check(&file[..BLOCK]), Err(Uf2Error::Length { found: 0, expected: BLOCK }));
    }
}

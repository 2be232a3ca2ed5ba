//! UF2 format: blocks of 512 bytes. Each block contains 256 bytes of flash and their address, so
//! that a file system can write the blocks in any order (<https://github.com/microsoft/uf2>).

use std::collections::BTreeSet;
use std::ops::Range;

use thiserror::Error;

/// Flash content of a block, bytes.
pub const PAYLOAD: usize = 256;

/// Size of a block, bytes.
pub const BLOCK: usize = 512;

const MAGIC: [u32; 2] = [0x0a32_4655, 0x9e5d_5157];
const MAGIC_END: u32 = 0x0ab1_6f30;
const FAMILY_PRESENT: u32 = 0x2000;
const RP2040: u32 = 0xe48b_ff56;

/// Addresses of a Pico's flash of 2 MiB.
const FLASH: Range<u32> = 0x1000_0000..0x1020_0000;

/// Reason why a file cannot be written to a Pico.
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
         ({RP2040:#010x})"
    )]
    Family {
        /// The family's number; 0 where the file names none.
        family: u32,
    },
    /// It writes outside the flash.
    #[error("the file writes to {address:#010x}, which is outside a Pico's flash")]
    Address {
        /// The address.
        address: u32,
    },
    /// The boot ROM finds no program after the file is written.
    #[error("the file has no program for the beginning of the flash ({:#010x})", FLASH.start)]
    NoStart,
}

/// Checks that the boot ROM of an RP2040 accepts `file` and starts it. Returns the bytes of flash
/// that it writes.
///
/// # Errors
/// The first thing that is wrong.
pub fn check(file: &[u8]) -> Result<usize, Uf2Error> {
    if !file.starts_with(&MAGIC[0].to_le_bytes()) {
        return Err(Uf2Error::NotUf2);
    }
    let announced = word(file, 6).ok_or(Uf2Error::Length { found: file.len(), expected: BLOCK })?;
    let expected = (announced as usize).saturating_mul(BLOCK);
    if file.len() != expected {
        return Err(Uf2Error::Length { found: file.len(), expected });
    }
    let (mut numbers, mut addresses) = (BTreeSet::new(), BTreeSet::new());
    for (index, block) in file.chunks_exact(BLOCK).enumerate() {
        let (number, address) =
            check_block(block, announced).ok_or(Uf2Error::Damaged { index })??;
        if !numbers.insert(number) || !addresses.insert(address) {
            return Err(Uf2Error::Damaged { index });
        }
    }
    if addresses.first() != Some(&FLASH.start) {
        return Err(Uf2Error::NoStart);
    }
    Ok(addresses.len() * PAYLOAD)
}

/// Returns number and address of a block of a file with `count` blocks; `None` where the block is
/// damaged.
fn check_block(block: &[u8], count: u32) -> Option<Result<(u32, u32), Uf2Error>> {
    let field = |index| word(block, index);
    let magic = [field(0)?, field(1)?, field(BLOCK / 4 - 1)?];
    let (flags, address, size, number) = (field(2)?, field(3)?, field(4)?, field(5)?);
    if magic != [MAGIC[0], MAGIC[1], MAGIC_END] || field(6)? != count || number >= count {
        return None;
    }
    let family = if flags & FAMILY_PRESENT == 0 { 0 } else { field(7)? };
    if family != RP2040 {
        return Some(Err(Uf2Error::Family { family }));
    }
    // The boot ROM takes whole pages of the flash only (RP2040 datasheet, section 2.8.4.2).
    if size as usize != PAYLOAD {
        return None;
    }
    if !FLASH.contains(&address) || !address.is_multiple_of(PAYLOAD as u32) {
        return Some(Err(Uf2Error::Address { address }));
    }
    Some(Ok((number, address)))
}

/// Returns the little-endian word at `index`, where `bytes` reach so far.
fn word(bytes: &[u8], index: usize) -> Option<u32> {
    let (word, _) = bytes.get(4 * index..)?.split_first_chunk()?;
    Some(u32::from_le_bytes(*word))
}

/// Returns the UF2 file for `flash`, whose first address is `start`. The last block is filled with
/// 0xff.
///
/// The RP2040's boot ROM erases only the sectors (4096 bytes) that the file writes. Other sectors
/// keep their content.
pub fn file(start: u32, flash: &[u8]) -> Vec<u8> {
    let blocks = flash.chunks(PAYLOAD);
    let count = blocks.len() as u32;
    blocks.zip(0..).flat_map(|(bytes, index)| block(start, bytes, index, count)).collect()
}

/// Returns block `index` of `count`, with up to [`PAYLOAD`] bytes of the flash from `start`.
fn block(start: u32, bytes: &[u8], index: u32, count: u32) -> [u8; BLOCK] {
    let head = [
        MAGIC[0],
        MAGIC[1],
        FAMILY_PRESENT,
        start + index * PAYLOAD as u32,
        PAYLOAD as u32,
        index,
        count,
        RP2040,
    ];
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
        let mut file = file(FLASH.start, &[0x5a; 3 * PAYLOAD]);
        let place = block * BLOCK + 4 * index;
        file[place..place + 4].copy_from_slice(&value.to_le_bytes());
        file
    }

    #[test]
    fn a_file_of_this_crate_is_accepted_in_any_order() {
        let file = file(FLASH.start, &[0x5a; 700]);
        assert_eq!(check(&file), Ok(3 * PAYLOAD));
        let reversed: Vec<u8> = file.rchunks(BLOCK).flatten().copied().collect();
        assert_eq!(check(&reversed), Ok(3 * PAYLOAD));
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
        assert_eq!(check(&changed(2, 3, FLASH.start)), Err(Uf2Error::Damaged { index: 2 }));
    }

    #[test]
    fn a_file_that_is_cut_anywhere_is_refused() {
        let whole = file(FLASH.start, &[0x5a; 3 * PAYLOAD]);
        for length in 0..whole.len() {
            let error = check(&whole[..length]).map_err(|error| error.to_string());
            assert!(error.is_err(), "{length} bytes");
        }
        let found = 2 * BLOCK;
        assert_eq!(check(&whole[..found]), Err(Uf2Error::Length { found, expected: 3 * BLOCK }));
    }

    #[test]
    fn another_chip_and_other_addresses_are_named() {
        let rp2350 = 0xe48b_ff59;
        assert_eq!(check(&changed(0, 7, rp2350)), Err(Uf2Error::Family { family: rp2350 }));
        assert_eq!(check(&changed(1, 2, 0)), Err(Uf2Error::Family { family: 0 }));
        for address in [0x2000_0000, FLASH.end, FLASH.start - 256, FLASH.start + 512 + 4] {
            assert_eq!(check(&changed(2, 3, address)), Err(Uf2Error::Address { address }));
        }
        assert_eq!(check(&file(FLASH.start + 256, &[0; 256])), Err(Uf2Error::NoStart));
    }
}

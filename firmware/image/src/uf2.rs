//! UF2 format: blocks of 512 bytes. Each block contains 256 bytes of flash and their address, so
//! that a file system can write the blocks in any order (<https://github.com/microsoft/uf2>).

/// Flash content of a block, bytes.
pub const PAYLOAD: usize = 256;

/// Size of a block, bytes.
pub const BLOCK: usize = 512;

const MAGIC: [u32; 2] = [0x0a32_4655, 0x9e5d_5157];
const MAGIC_END: u32 = 0x0ab1_6f30;
const FAMILY_PRESENT: u32 = 0x2000;
const RP2040: u32 = 0xe48b_ff56;

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

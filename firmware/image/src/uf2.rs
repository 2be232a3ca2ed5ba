//! UF2: blocks of 512 bytes, each of which says where its 256 bytes of flash go, so that they
//! survive any order in which a file system writes them (<https://github.com/microsoft/uf2>).

/// Bytes of flash in a block.
pub const PAYLOAD: usize = 256;

/// Bytes of a block.
pub const BLOCK: usize = 512;

const MAGIC: [u32; 2] = [0x0a32_4655, 0x9e5d_5157];
const MAGIC_END: u32 = 0x0ab1_6f30;
const FAMILY_PRESENT: u32 = 0x2000;
const RP2040: u32 = 0xe48b_ff56;

/// The file for `flash`, which goes to the address `start` on; the last block is filled up with
/// 0xff.
///
/// The RP2040's boot ROM erases whole sectors of 4096 bytes as it meets them, so sectors that the
/// file does not touch keep what they have.
pub fn file(start: u32, flash: &[u8]) -> Vec<u8> {
    let blocks = flash.chunks(PAYLOAD);
    let count = blocks.len() as u32;
    blocks.zip(0..).flat_map(|(bytes, index)| block(start, bytes, index, count)).collect()
}

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

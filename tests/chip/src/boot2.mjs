// The second boot stage: the image's first 256 bytes, with a checksum that the boot ROM checks before it starts them.

const LENGTH = 252;
const POLYNOMIAL = 0x04c11db7;

/** CRC-32 as the boot ROM computes it (RP2040 datasheet 2.8.1.3.1): from all ones, most significant bit first, nothing inverted. */
export function checksum(bytes) {
  let crc = 0xffffffff;
  for (const byte of bytes) {
    crc ^= byte << 24;
    for (let bit = 0; bit < 8; bit++) crc = crc & 0x80000000 ? (crc << 1) ^ POLYNOMIAL : crc << 1;
  }
  return crc >>> 0;
}

/** Would the boot ROM start this flash? */
export function bootTwoIsValid(flash) {
  const stored = new DataView(flash.buffer, flash.byteOffset).getUint32(LENGTH, true);
  return checksum(flash.subarray(0, LENGTH)) === stored;
}

// The second boot stage: the first 256 bytes of the image, with a checksum. The boot ROM verifies
// it.

const LENGTH = 252;
const POLYNOMIAL = 0x04c11db7;

/**
 * CRC-32 of the boot ROM (RP2040 datasheet 2.8.1.3.1): starts with all ones, most significant bit
 * first, not inverted.
 */
export function checksum(bytes) {
  let crc = 0xffffffff;
  for (const byte of bytes) {
    crc ^= byte << 24;
    for (let bit = 0; bit < 8; bit++) crc = crc & 0x80000000 ? (crc << 1) ^ POLYNOMIAL : crc << 1;
  }
  return crc >>> 0;
}

/** Returns whether the boot ROM starts this flash. */
export function bootTwoIsValid(flash) {
  const stored = new DataView(flash.buffer, flash.byteOffset).getUint32(LENGTH, true);
  return checksum(flash.subarray(0, LENGTH)) === stored;
}

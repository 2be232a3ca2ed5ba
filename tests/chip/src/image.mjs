// Puts a firmware image into flash: an ELF file by its program headers, or a UF2 file block by
// block.
import fs from 'node:fs';

const FLASH_BASE = 0x10000000;
const PT_LOAD = 1;
const UF2_MAGIC = [0x0a324655, 0x9e5d5157, 0x0ab16f30];
const UF2_NOT_MAIN_FLASH = 1;

/**
 * Copies `bytes` to their address in flash, or throws an error that names the part outside of it.
 */
function place(flash, address, bytes, name) {
  const offset = address - FLASH_BASE;
  if (offset < 0 || offset + bytes.length > flash.length) {
    throw new Error(
      `${name}: ${bytes.length} bytes at 0x${address.toString(16)} are outside of the flash`,
    );
  }
  flash.set(bytes, offset);
}

function loadElf(file, flash, name) {
  const headers = file.readUInt32LE(28);
  const size = file.readUInt16LE(42);
  for (let i = 0; i < file.readUInt16LE(44); i++) {
    const header = headers + i * size;
    const [offset, physical, length] = [4, 12, 16].map((field) =>
      file.readUInt32LE(header + field),
    );
    if (file.readUInt32LE(header) === PT_LOAD && length > 0) {
      place(flash, physical, file.subarray(offset, offset + length), name);
    }
  }
}

function loadUf2(file, flash, name) {
  for (let block = 0; block + 512 <= file.length; block += 512) {
    const magic = [0, 4, 508].map((field) => file.readUInt32LE(block + field));
    if (!magic.every((word, i) => word === UF2_MAGIC[i]))
      throw new Error(`${name}: the UF2 block at ${block} is damaged`);
    if (file.readUInt32LE(block + 8) & UF2_NOT_MAIN_FLASH) continue;
    const length = file.readUInt32LE(block + 16);
    place(
      flash,
      file.readUInt32LE(block + 12),
      file.subarray(block + 32, block + 32 + length),
      name,
    );
  }
}

/**
 * Puts an image into a flash array (offset 0 is address 0x10000000).
 * @param {string | Uint8Array} image path of an .elf or .uf2 file, its contents, or a plain flash
 * image to copy
 */
export function loadImage(image, flash) {
  const name = typeof image === 'string' ? image : 'image';
  const file = typeof image === 'string' ? fs.readFileSync(image) : Buffer.from(image);
  if (file.length >= 4 && file.readUInt32BE(0) === 0x7f454c46) loadElf(file, flash, name);
  else if (file.length >= 4 && file.readUInt32LE(0) === UF2_MAGIC[0]) loadUf2(file, flash, name);
  else if (typeof image === 'string') throw new Error(`${name} is neither an ELF nor a UF2 file`);
  else place(flash, FLASH_BASE, file, name);
}

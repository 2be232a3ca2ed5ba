// Frames that configure a board, for tests of the real firmware.
import { readFileSync } from 'node:fs';

/** Frame of Wire and of Configure with id 300, of tests/tests/it/golden.rs. */
const golden = readFileSync(new URL('../../tests/it/golden.rs', import.meta.url), 'utf8');
/** The schema of the messages, which a test compares with the types. */
const client = readFileSync(
  new URL('../../../protocol/examples/client.py', import.meta.url),
  'utf8',
);
const SCHEMA = Buffer.from(client.match(/SCHEMA = bytes\.fromhex\("([0-9a-f]+)"\)/)[1], 'hex');
const VERSION = Number(client.match(/VERSION = b"PLMB", (\d+)/)[1]);
const HELLO_300 = Buffer.from([0xac, 0x02, 0, ...Buffer.from('PLMB'), VERSION]);

/** CRC-32 (ISO-HDLC). */
function crc32(bytes) {
  let crc = ~0;
  for (const byte of bytes) {
    crc ^= byte;
    for (let bit = 0; bit < 8; bit++) crc = (crc >>> 1) ^ (crc & 1 ? 0xedb88320 : 0);
  }
  return ~crc >>> 0;
}

/** Wraps a message: CRC, COBS, a zero. */
export function frame(message) {
  const crc = Buffer.alloc(4);
  crc.writeUInt32LE(crc32(message));
  const out = [];
  let run = [];
  for (const byte of [...message, ...crc, 0]) {
    if (byte !== 0) run.push(byte);
    else {
      out.push(run.length + 1, ...run);
      run = [];
    }
  }
  return Buffer.from([...out, 0]);
}

/** Returns the golden frame that begins with these digits. */
function goldenFrame(begin) {
  const text = golden.slice(golden.indexOf(`"${begin}`) + 1);
  return Buffer.from(text.slice(0, text.indexOf('"')).replace(/\\\s*/g, ''), 'hex');
}

/** Hello, then Wire of a Pico and Configure. */
export const CONFIGURED = Buffer.concat([
  frame(Buffer.concat([HELLO_300, SCHEMA])),
  goldenFrame('07ac02100103'),
  goldenFrame('04ac0203'),
]);

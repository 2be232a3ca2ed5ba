#!/usr/bin/env node
// Serves the emulated chip to other programs: commands and replies in JSON lines, in lock step; or
// the bytes of a serial line, in real time. The commands: README.md
// usage: node serve.mjs FIRMWARE.elf|.uf2 [--flash FILE] [--first JSON] [--bytes usb|uart]
//   --first JSON   a command that is executed first, such as '{"gpio":[15,0]}'
//   --flash FILE   flash contents: read at the start if the file exists (the image is placed over
//                  them), written at the end
//   --bytes LINE   standard input and output are the bytes of USB or UART, and the chip runs in
// real
//                  time
// exit: 0 at the end of the input; 2 bad arguments, or a firmware that cannot be loaded
import fs from 'node:fs';
import readline from 'node:readline';
import { parseArgs } from 'node:util';
import { Session } from './src/session.mjs';

const SLICE_NS = 500_000;
const LAST_NS = 5_000_000;
/** Maximum lag that the chip catches up with. Beyond it, the chip's time stays behind. */
const LAG_NS = 20_000_000;

function options() {
  const parsed = parseArgs({
    allowPositionals: true,
    options: { flash: { type: 'string' }, first: { type: 'string' }, bytes: { type: 'string' } },
  });
  const [image, ...rest] = parsed.positionals;
  const { flash, first, bytes } = parsed.values;
  if (!image || rest.length > 0 || (bytes !== undefined && bytes !== 'usb' && bytes !== 'uart')) {
    throw new Error(
      'usage: node serve.mjs FIRMWARE.elf|.uf2 [--flash FILE] [--first JSON] [--bytes usb|uart]',
    );
  }
  return { image, flash, first, bytes };
}

function answer(session, line) {
  try {
    return session.do(JSON.parse(line));
  } catch (error) {
    return { error: error.message };
  }
}

/** Serves one command and one reply per line. */
async function lockStep(session) {
  for await (const line of readline.createInterface({ input: process.stdin })) {
    if (line.trim() !== '') process.stdout.write(`${JSON.stringify(answer(session, line))}\n`);
  }
}

/** Serves bytes in real time until the input ends. */
function realTime({ chip }, line) {
  let behind = process.hrtime.bigint();
  let open = true;
  process.stdin.on('data', (bytes) =>
    line === 'usb' ? chip.usb.send(bytes) : chip.uart0.feed(bytes),
  );
  process.stdin.on('end', () => (open = false));
  if (line === 'usb') chip.usb.onData = (bytes) => process.stdout.write(bytes);
  else chip.uart0.onByte = (byte) => process.stdout.write(Uint8Array.of(byte));
  return new Promise((resolve) => {
    const turn = () => {
      const now = process.hrtime.bigint();
      if (now - behind > LAG_NS) behind = now - BigInt(LAG_NS);
      while (now - behind >= SLICE_NS && process.hrtime.bigint() - now < LAG_NS) {
        chip.runFor(SLICE_NS);
        behind += BigInt(SLICE_NS);
      }
      if (open) {
        setTimeout(turn, 1);
      } else {
        // The last bytes of the input still get their answers.
        chip.runFor(LAST_NS);
        resolve();
      }
    };
    turn();
  });
}

async function main() {
  const { image, flash, first, bytes } = options();
  const saved = flash && fs.existsSync(flash) ? fs.readFileSync(flash) : undefined;
  const session = new Session({ image, flash: saved });
  if (first) session.do(JSON.parse(first));
  await (bytes ? realTime(session, bytes) : lockStep(session));
  if (flash) fs.writeFileSync(flash, session.chip.saveFlash());
}

main().catch((error) => {
  process.stderr.write(`${error.message}\n`);
  process.exitCode = 2;
});

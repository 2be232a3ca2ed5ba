// Tests of the commands of serve.mjs, in one process and over a pipe.
import assert from 'node:assert/strict';
import { spawnSync } from 'node:child_process';
import fs from 'node:fs';
import os from 'node:os';
import path from 'node:path';
import { test } from 'node:test';
import { fileURLToPath } from 'node:url';
import { Session } from '../src/session.mjs';
import { IO_BANK0, Program, SIO, UART0 } from './support.mjs';

const SERVE = fileURLToPath(new URL('../serve.mjs', import.meta.url));
const [STEP, DIR] = [2, 3];

/** A program with three steps up, one step down and two bytes to the UART; then it sleeps. */
function image() {
  const p = new Program();
  for (const pin of [STEP, DIR]) p.set(IO_BANK0 + 8 * pin + 4, 5);
  p.set(SIO + 0x24, (1 << STEP) | (1 << DIR));
  const pulse = () => p.set(SIO + 0x14, 1 << STEP).set(SIO + 0x18, 1 << STEP);
  p.set(SIO + 0x14, 1 << DIR);
  for (let i = 0; i < 3; i++) pulse();
  p.set(SIO + 0x18, 1 << DIR);
  pulse();
  [
    [0x24, 1],
    [0x28, 0],
    [0x2c, 0x70],
    [0x30, 0x301],
    [0, 0xab],
    [0, 0xcd],
  ].forEach(([offset, value]) => p.set(UART0 + offset, value));
  return p.sleep().build();
}

test('a reply has all events since the last', () => {
  const session = new Session({ image: image() });
  session.do({ steppers: [[STEP, DIR]], list: [DIR] });
  const reply = session.do({ run_us: 100, levels: [STEP, DIR] });
  assert.deepEqual(reply.steps, [2]);
  assert.deepEqual(reply.rises, [
    [STEP, 4],
    [DIR, 1],
  ]);
  assert.deepEqual(
    reply.edges.map(([, pin, level]) => [pin, level]),
    [
      [DIR, 1],
      [DIR, 0],
    ],
  );
  assert.equal(reply.uart[0][1], 'abcd');
  assert.deepEqual(reply.levels, [0, 0]);
  assert.equal(reply.cycle, 12_500);
  assert.deepEqual(session.do({ run_us: 1 }), { cycle: 12_625, steps: [2] });
});

test('a stepper reports number and times of its pulses', () => {
  const session = new Session({ image: image() });
  session.do({ steppers: [[STEP, DIR]] });
  // Two loads of a constant and a store between any two edges.
  const { pulses } = session.do({ run_us: 100, pulses: true });
  assert.deepEqual(
    { ...pulses[0], last: null },
    { count: 4, high: 5, low: 5, setup: 5, hold: 10, last: null },
  );
  assert.deepEqual(
    { ...session.do({ run_us: 1, pulses: true }).pulses[0], last: null },
    { count: 0, high: null, low: null, setup: null, hold: null, last: null },
  );
});

test('functions are measured to the cycle, and only on request', () => {
  const p = new Program().jump('main').raw(0xbf00, 0xbf00, 0x4770); // nop; nop; bx lr
  const call = () => p.load(3, 0x10000203).raw(0x4798);
  p.label('main');
  call();
  call();
  const session = new Session({ image: p.sleep().build() });
  session.do({ trace: { functions: { twoNops: 0x10000202 } } });
  const { calls } = session.do({ run_us: 10, calls: true });
  assert.deepEqual(
    calls.twoNops.map(([, cycles]) => cycles),
    [4, 4],
  );
  assert.deepEqual(session.do({ reset: 'run', trace: null, run_us: 10, calls: true }).calls, {});
});

test('a new image starts a new chip, without what the one before had', () => {
  const session = new Session({ image: image() });
  session.do({ run_us: 100 });
  const { cycle, uart, resets } = session.do({ image: image(), run_us: 100 });
  assert.equal(cycle, 12_500);
  assert.equal(uart[0][1], 'abcd');
  assert.equal(resets, undefined);
});

test('a wait for bytes that do not come ends in its time', () => {
  const session = new Session({ image: image() });
  assert.equal(session.do({ receive_us: 1000 }).cycle, 125_000);
});

test('a reset, memory and the load are reported', () => {
  const session = new Session({ image: image() });
  session.do({ run_us: 100 });
  assert.deepEqual(session.do({ reset: 'power' }).resets, [[12_500, 'power']]);
  session.do({ poke: [0x20001000, '01020304'] });
  assert.equal(session.do({ peek: [0x20001000, 3] }).peek, '010203');
  assert.ok(session.do({ run_us: 1000, load: true }).load.idle > 0.5);
});

test('serve.mjs accepts JSON lines, and reports invalid ones', () => {
  const folder = fs.mkdtempSync(path.join(os.tmpdir(), 'plumb-chip-'));
  const uf2 = path.join(folder, 'image.uf2');
  fs.writeFileSync(uf2, toUf2(image()));
  const input = ['{"run_us":100}', '{"hop":1}', '{', '{"usb":"xyz"}', '{"hash":true}'].join('\n');
  const run = () =>
    spawnSync(process.execPath, [SERVE, uf2, '--flash', path.join(folder, 'flash')], {
      input,
      encoding: 'utf8',
    });
  const result = run();
  assert.equal(result.status, 0, result.stderr);
  const [first, unknown, broken, wrong, hash] = result.stdout
    .trim()
    .split('\n')
    .map((line) => JSON.parse(line));
  assert.equal(first.uart[0][1], 'abcd');
  assert.match(unknown.error, /unknown command hop/);
  assert.ok(broken.error);
  assert.match(wrong.error, /hexadecimal/);
  assert.match(hash.hash, /^[0-9a-f]{16}$/);
  assert.equal(fs.statSync(path.join(folder, 'flash')).size, 2 * 1024 * 1024);
  assert.equal(run().stdout, result.stdout);
  fs.rmSync(folder, { recursive: true });
});

test('serve.mjs transfers the bytes of a line', () => {
  const folder = fs.mkdtempSync(path.join(os.tmpdir(), 'plumb-chip-'));
  const uf2 = path.join(folder, 'image.uf2');
  fs.writeFileSync(uf2, toUf2(image()));
  // The bytes are there after 20 µs of the chip; at the end of its input it runs for a last 5 ms.
  const result = spawnSync(process.execPath, [SERVE, uf2, '--bytes', 'uart'], { input: '' });
  assert.deepEqual([...result.stdout], [0xab, 0xcd]);
  fs.rmSync(folder, { recursive: true });
});

test('serve.mjs without a firmware prints its usage', () => {
  const result = spawnSync(process.execPath, [SERVE], { encoding: 'utf8' });
  assert.equal(result.status, 2);
  assert.match(result.stderr, /usage/);
});

/** Returns the UF2 file of an image at the start of flash. */
function toUf2(bytes) {
  const blocks = Math.ceil(bytes.length / 256);
  const file = Buffer.alloc(512 * blocks);
  for (let i = 0; i < blocks; i++) {
    const words = [
      0x0a324655,
      0x9e5d5157,
      0x2000,
      0x10000000 + 256 * i,
      256,
      i,
      blocks,
      0xe48bff56,
    ];
    words.forEach((word, n) => file.writeUInt32LE(word, 512 * i + 4 * n));
    Buffer.from(bytes).copy(file, 512 * i + 32, 256 * i, 256 * (i + 1));
    file.writeUInt32LE(0x0ab16f30, 512 * i + 508);
  }
  return file;
}

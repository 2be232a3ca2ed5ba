// Tests of PIO to the cycle: delays, dividers, side-set, FIFOs, flags, stalls, and DMA.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import {
  configure,
  DMA,
  loadPio,
  MS,
  pio,
  PIO0,
  PINS,
  record,
  SIO,
  sleepingChip,
  SM0,
  start,
  US,
  X,
  IO_BANK0,
} from './support.mjs';

const TXF0 = PIO0 + 0x10;
const FSTAT = PIO0 + 0x04;
const FLEVEL = PIO0 + 0x0c;
const IRQ = PIO0 + 0x30;
const LINE = { sideBits: 1 };

/**
 * Runs a program on a machine with pin 2 as SET, OUT and side-set pin; returns the pin's edges in
 * cycles from the start.
 */
function run(
  program,
  { nanos = 10 * US, words = [], shift = 3 << 18, sideBits = 0, ...settings } = {},
) {
  const chip = sleepingChip();
  loadPio(chip, program, [2]);
  configure(chip, 0, {
    wrap: [0, program.length - 1],
    shift,
    pinctrl: (sideBits << 29) | (1 << 26) | (1 << 20) | (2 << 10) | (2 << 5) | 2,
    ...settings,
  });
  for (const word of words) chip.bus.write32(TXF0, word);
  let from = 0;
  const edges = record(chip, 2, () => from);
  from = start(chip);
  chip.runFor(nanos);
  return { chip, edges };
}
const distances = (edges) => edges.slice(1).map(([, at], i) => at - edges[i][1]);

test('an instruction takes one cycle and its delay', () => {
  const { edges } = run([
    pio.with(pio.set(PINS, 1), { delay: 4 }),
    pio.with(pio.set(PINS, 0), { delay: 1 }),
  ]);
  assert.deepEqual(edges.slice(0, 4), [
    [1, 0],
    [0, 5],
    [1, 7],
    [0, 12],
  ]);
});

test('a clock divider stretches everything, its fraction evenly', () => {
  const program = [pio.set(PINS, 1), pio.set(PINS, 0)];
  const whole = distances(run(program, { clkdiv: 7 << 16 }).edges);
  assert.ok(whole.every((cycles) => cycles === 7));
  const fraction = run(program, { clkdiv: (2 << 16) | (128 << 8) }).edges;
  assert.ok(distances(fraction).every((cycles) => cycles === 2 || cycles === 3));
  assert.equal(fraction[200][1], 500);
});

test('a count-down in one instruction is skipped, and ends at the same cycle', () => {
  const program = [
    pio.with(pio.set(PINS, 1), { delay: 2 }),
    pio.set(X, 31),
    pio.with(pio.jmp(2, 2), { delay: 3 }),
    pio.set(PINS, 0),
  ];
  const { edges } = run(program);
  // 3 for SET, 1 for SET X, 32 rounds of 4, then low for 1.
  assert.deepEqual(edges.slice(0, 3), [
    [1, 0],
    [0, 3 + 1 + 128],
    [1, 3 + 1 + 128 + 1],
  ]);
});

test('a wait of 2^32 rounds takes no computing time', () => {
  const program = [pio.pull, pio.mov(X, 7), pio.jmp(2, 2), pio.set(PINS, 1)];
  const { chip, edges } = run(program, { words: [0xffffffff], nanos: 8e9 });
  assert.deepEqual(edges, []);
  assert.equal(chip.bus.read32(SM0 + 0x0c), 2);
  // From cycle 2 to 1e9, both included.
  assert.equal(chip.engine.machines[0].x, 0xffffffff - (1e9 - 1));
});

test('side-set takes effect in the first cycle, also of a stalled instruction', () => {
  const program = [
    pio.with(pio.pull, { side: 1, ...LINE }),
    pio.with(pio.out(X, 32), { side: 0, delay: 3, ...LINE }),
  ];
  const { chip, edges } = run(program, { sideBits: 1 });
  assert.deepEqual(edges, [[1, 0]]);
  chip.bus.write32(TXF0, 1);
  chip.runFor(US);
  // OUT follows PULL and takes four cycles; then PULL stalls again.
  assert.deepEqual(
    edges.map(([level]) => level),
    [1, 0, 1],
  );
  assert.equal(edges[2][1] - edges[1][1], 4);
});

test('OUT with autopull replaces the last word in its shift; an empty OSR costs a cycle', () => {
  const threshold = (bits) => (3 << 18) | (1 << 17) | ((bits & 31) << 25);
  const words = [0b01, 0b01, 0b01];
  const { edges, chip } = run([pio.out(PINS, 1)], { words, shift: threshold(2) });
  // The OSR is empty at the start: filled in cycle 0, used from cycle 1 on, then without a gap.
  assert.deepEqual(edges, [
    [1, 1],
    [0, 2],
    [1, 3],
    [0, 4],
    [1, 5],
    [0, 6],
  ]);
  assert.equal((chip.bus.read32(PIO0 + 8) >>> 24) & 1, 1, 'it has stalled for data since');
});

test('MOV of the OSR refills it; PULL of a full OSR does nothing with autopull', () => {
  const shift = (3 << 18) | (1 << 17);
  const { chip } = run([pio.pull, pio.mov(X, 7), pio.jmp(2)], { words: [11, 22], shift });
  assert.equal(chip.engine.machines[0].x, 11);
  assert.equal(chip.bus.read32(FLEVEL) & 15, 1);
});

test('joined FIFOs hold eight words and none', () => {
  const chip = sleepingChip();
  configure(chip, 0, { shift: (3 << 18) | (1 << 30) });
  for (let i = 0; i < 7; i++) chip.bus.write32(TXF0, i);
  assert.equal(chip.bus.read32(FLEVEL) & 15, 7);
  assert.equal((chip.bus.read32(FSTAT) >>> 16) & 1, 0);
  chip.bus.write32(TXF0, 7);
  assert.equal((chip.bus.read32(FSTAT) >>> 16) & 1, 1);
  chip.bus.write32(TXF0, 8);
  assert.equal((chip.bus.read32(PIO0 + 8) >>> 16) & 1, 1, 'the ninth is lost, and said to be');
  configure(chip, 0, { shift: (3 << 18) | (1 << 31) });
  assert.equal(chip.bus.read32(FLEVEL) & 15, 0, 'joining anew empties them');
  assert.equal(
    (chip.bus.read32(FSTAT) >>> 16) & 1,
    1,
    'with the receiver joined there is no room to send',
  );
});

test('autopush collects bits into words', () => {
  const chip = sleepingChip();
  loadPio(chip, [pio.set(X, 5), pio.in(X, 8), pio.jmp(1)]);
  configure(chip, 0, { shift: (1 << 16) | (16 << 20) });
  start(chip);
  chip.runFor(US);
  assert.equal(chip.bus.read32(PIO0 + 0x20), 0x0505);
  assert.equal(chip.bus.read32(PIO0 + 8) & 1, 1, 'with four words unread it waits');
});

test('a flag that a machine raises is seen by another from the next cycle on', () => {
  const chip = sleepingChip();
  loadPio(chip, [pio.irq(4), pio.jmp(1), pio.wait(1, 2, 4), pio.set(PINS, 1), pio.jmp(4)], [2]);
  for (const machine of [0, 1]) configure(chip, machine, { pinctrl: (1 << 26) | (2 << 5) });
  chip.bus.write32(SM0 + 0x18 + 0x10, pio.jmp(2));
  let from = 0;
  const edges = record(chip, 2, () => from);
  from = start(chip, 3);
  chip.runFor(US);
  assert.deepEqual(edges, [[1, 2]]);
  assert.equal(chip.bus.read32(IRQ), 0, 'WAIT has cleared it');
});

test('IRQ WAIT interrupts the processor, and continues when the flag is cleared', () => {
  const { chip, edges } = run([pio.irqWait(0), pio.set(PINS, 1), pio.jmp(2)]);
  chip.bus.write32(PIO0 + 0x12c, 1 << 8);
  assert.equal((chip.core.lines >> 7) & 1, 1);
  assert.deepEqual(edges, []);
  chip.bus.write32(IRQ, 1);
  chip.runFor(US);
  assert.equal(edges.length, 1);
  assert.equal((chip.core.lines >> 7) & 1, 0);
});

test('WAIT and JMP read the pins', () => {
  const { chip, edges } = run(
    [pio.wait(1, 0, 15), pio.set(PINS, 1), pio.jmp(1, 6), pio.set(PINS, 0), pio.jmp(4)],
    { exec: 15 << 24 },
  );
  assert.deepEqual(edges, []);
  chip.drive(15, 1);
  const up = chip.cycles;
  chip.runFor(US);
  chip.drive(15, 0);
  const down = chip.cycles;
  chip.runFor(US);
  const [rise, fall] = edges;
  assert.equal(rise[0], 1);
  assert.ok(down - up >= 125);
  assert.ok(fall[1] - rise[1] >= down - up - 2 && fall[1] - rise[1] <= down - up + 4);
});

test('an instruction written to INSTR is executed at once, also by a stopped machine', () => {
  const chip = sleepingChip();
  chip.bus.write32(SM0 + 0x10, pio.set(X, 9));
  chip.bus.write32(SM0 + 0x10, pio.mov(6, X));
  chip.bus.write32(SM0 + 0x10, 0x8000);
  assert.equal(chip.bus.read32(PIO0 + 0x20), 9);
  assert.equal(chip.bus.read32(SM0 + 0x0c), 0);
});

test('OUT EXEC executes its bits in the next cycle', () => {
  const { edges } = run([pio.pull, pio.with(pio.out(7, 16), { delay: 5 }), pio.jmp(2)], {
    words: [pio.set(PINS, 1)],
  });
  assert.deepEqual(edges, [[1, 2]]);
});

test('machines started together stay in phase', () => {
  const chip = sleepingChip();
  loadPio(
    chip,
    [pio.with(pio.set(PINS, 1), { delay: 9 }), pio.with(pio.set(PINS, 0), { delay: 9 })],
    [2],
  );
  chip.bus.write32(IO_BANK0 + 8 * 3 + 4, 6);
  for (const machine of [0, 1])
    configure(chip, machine, { wrap: [0, 1], pinctrl: (1 << 26) | ((2 + machine) << 5) });
  chip.bus.write32(SM0 + 0x18 + 0x10, pio.set(4, 1));
  const edges = [2, 3].map((pin) => record(chip, pin, () => 0));
  start(chip, 3);
  chip.runFor(MS);
  assert.ok(edges[0].length > 1000);
  assert.deepEqual(edges[0], edges[1]);
});

test('a machine stopped within a delay continues with the rest of it', () => {
  const { chip, edges } = run(
    [pio.with(pio.set(PINS, 1), { delay: 31 }), pio.with(pio.set(PINS, 0), { delay: 31 })],
    { nanos: 8 * 10 },
  );
  chip.bus.write32(PIO0, 0);
  chip.runFor(8 * 1000);
  chip.bus.write32(PIO0, 1);
  chip.runFor(8 * 100);
  assert.deepEqual(edges.slice(0, 3), [
    [1, 0],
    [0, 1032],
    [1, 1064],
  ]);
});

test('DMA fills the FIFO as the machine empties it, and interrupts at the end', () => {
  const chip = sleepingChip();
  const words = 256;
  const counts = Uint32Array.from({ length: words }, (_, i) => 90 + (i % 7));
  chip.poke(0x20001000, new Uint8Array(counts.buffer));
  // A pulse of 10 cycles, then the word's cycles: PULL, OUT, SET, the count.
  loadPio(
    chip,
    [
      pio.pull,
      pio.out(X, 32),
      pio.with(pio.set(PINS, 1), { delay: 9 }),
      pio.set(PINS, 0),
      pio.jmp(4, 2),
    ],
    [2],
  );
  configure(chip, 0, { wrap: [0, 4], pinctrl: (1 << 26) | (2 << 5) });
  const edges = record(chip, 2, () => 0);
  chip.bus.write32(DMA + 0x404, 1);
  chip.bus.write32(DMA, 0x20001000);
  chip.bus.write32(DMA + 4, TXF0);
  chip.bus.write32(DMA + 8, words);
  chip.bus.write32(DMA + 0x0c, 1 | (2 << 2) | (1 << 4) | (0 << 15));
  start(chip);
  chip.runFor(100);
  assert.equal((chip.core.lines >> 11) & 1, 0);
  chip.runFor(MS);
  const rises = edges.filter(([level]) => level === 1).map(([, at]) => at);
  assert.equal(rises.length, words);
  assert.deepEqual(
    rises.slice(1).map((at, i) => at - rises[i]),
    [...counts.slice(0, -1)].map((count) => count + 1 + 13),
  );
  assert.equal((chip.core.lines >> 11) & 1, 1);
});

test('a pin that PIO drives can be read back', () => {
  const { chip } = run([pio.set(PINS, 1), pio.jmp(1)]);
  assert.equal((chip.bus.read32(SIO + 4) >> 2) & 1, 1);
  assert.equal(chip.level(2), 1);
});

// Tests of virtual time: alarms, watchdog, resets, DMA, and that two runs are equal.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { Chip } from '../src/chip.mjs';
import {
  configure,
  DMA,
  loadPio,
  MS,
  NVIC_ISER,
  pio,
  PINS,
  Program,
  record,
  sleepingChip,
  start,
  TIMER,
  US,
  WATCHDOG,
} from './support.mjs';

const RAM = 0x20000100;
const ENABLE = 1 << 30;
const REASON = 0x08;
const SCRATCH0 = 0x0c;

test('an alarm is in its microsecond, and not before', () => {
  const chip = sleepingChip();
  chip.bus.write32(TIMER + 0x38, 1);
  chip.runFor(400);
  const wanted = chip.bus.read32(TIMER + 0x28) + 7;
  chip.bus.write32(TIMER + 0x10, wanted);
  const rang = () => (chip.core.lines & 1) === 1;
  chip.runUntil(rang, 20 * US, 8);
  assert.equal(chip.cycles, wanted * 125);
  assert.equal(chip.bus.read32(TIMER + 0x28), wanted);
});

test('a program that sleeps to an alarm wakes there, to the cycle', () => {
  const program = new Program()
    .set(TIMER + 0x38, 1)
    .set(NVIC_ISER, 1)
    .set(TIMER + 0x10, 1000)
    .sleep();
  program
    .handler(16)
    .set(TIMER + 0x34, 1)
    .load(0, TIMER)
    .ldr(2, 0, 0x28)
    .load(1, RAM)
    .str(2, 1);
  const chip = program.raw(0x4770).chip();
  chip.runFor(5 * MS);
  assert.equal(chip.peek32(RAM), 1000);
  assert.ok(chip.load.idle > 0.999);
});

test('the chip runs exactly for the requested time', () => {
  const chip = new Program().label('loop').load(0, 0x20000000).raw(0xc8ff).jump('loop').chip();
  for (let i = 1; i <= 1000; i++) {
    chip.runFor(US);
    assert.ok(chip.cycles >= 125 * i && chip.cycles < 125 * i + 16);
  }
});

/**
 * Returns a chip with values in RAM and in a scratch register, and its watchdog set to `micros`.
 */
function watched(micros) {
  const chip = sleepingChip();
  const causes = [];
  chip.onReset = (cause, at) => causes.push([cause, at]);
  chip.bus.write32(WATCHDOG + 0x0c, 0xdecafbad);
  chip.bus.write32(RAM, 0x1234);
  chip.bus.write32(WATCHDOG + 4, 2 * micros);
  chip.bus.write32(WATCHDOG, ENABLE);
  return { chip, causes, from: chip.cycles };
}

test('the watchdog resets the chip once after its count, and reports it to the next boot', () => {
  const { chip, causes, from } = watched(100);
  chip.runFor(99 * US);
  assert.deepEqual(causes, []);
  assert.equal(chip.bus.read32(WATCHDOG) & 0xffffff, 2);
  chip.runFor(MS);
  assert.deepEqual(causes, [['watchdog', from + 100 * 125]]);
  assert.equal(chip.bus.read32(WATCHDOG + 8), 1);
  assert.equal(chip.bus.read32(WATCHDOG + 0x0c), 0xdecafbad | 0);
  assert.equal(chip.bus.read32(RAM), 0x1234, 'memory is not cleared');
  assert.equal(chip.bus.read32(TIMER + 0x28) < 2000, true, 'the timer begins anew');
});

test('a watchdog that is fed does not reset the chip', () => {
  const { chip, causes } = watched(100);
  for (let i = 0; i < 100; i++) {
    chip.runFor(99 * US);
    chip.bus.write32(WATCHDOG + 4, 200);
  }
  assert.deepEqual(causes, []);
});

test('a forced watchdog reset differs from a timeout', () => {
  const { chip, causes } = watched(1000);
  chip.bus.write32(WATCHDOG, 1 << 31);
  chip.runFor(US);
  assert.equal(causes[0][0], 'forced');
  assert.equal(chip.bus.read32(WATCHDOG + 8), 2);
});

test('only the flash survives power off', () => {
  const { chip, causes } = watched(1000);
  chip.reset('power');
  assert.equal(causes[0][0], 'power');
  assert.deepEqual(
    [8, 0x0c].map((offset) => chip.bus.read32(WATCHDOG + offset)),
    [0, 0],
  );
  assert.notEqual(chip.peek32(RAM), 0x1234);
  assert.equal(chip.bus.read32(0x40064008), 1 << 8, 'HAD_POR');
});

test('the watchdog resets a locked-up processor', () => {
  const program = new Program()
    .set(WATCHDOG + 4, 2000)
    .set(WATCHDOG, ENABLE)
    .raw(0xde00)
    .handler(3)
    .raw(0xde00);
  const chip = program.chip();
  chip.runFor(10 * MS);
  assert.ok(chip.resets >= 9 && chip.resets <= 10);
});

test('DMA copies one word per cycle, and reports its end', () => {
  const chip = sleepingChip();
  chip.poke(
    0x20001000,
    Uint8Array.from({ length: 400 }, (_, i) => i),
  );
  [0x20001000, 0x20002000, 100, 1 | (2 << 2) | (3 << 4) | (63 << 15)].forEach((word, i) =>
    chip.bus.write32(DMA + 4 * i, word),
  );
  chip.runFor(50 * 8);
  assert.equal(chip.bus.read32(DMA + 8), 50);
  chip.runFor(51 * 8);
  assert.equal(chip.bus.read32(DMA + 0x400), 1);
  assert.deepEqual(chip.peek(0x20002000, 400), chip.peek(0x20001000, 400));
});

test('DMA paced by a timer keeps its rate: X words in Y cycles', () => {
  const chip = sleepingChip();
  chip.bus.write32(DMA + 0x420, (1 << 16) | 125);
  [0x20001000, 0x20002000, 1000, 1 | (2 << 2) | (59 << 15)].forEach((word, i) =>
    chip.bus.write32(DMA + 4 * i, word),
  );
  chip.runFor(100 * US);
  assert.equal(chip.bus.read32(DMA + 8), 900);
});

test('an image that the boot ROM rejects is not started', () => {
  const image = new Program().set(RAM, 1).sleep().build();
  image[4] ^= 1;
  const chip = new Chip({ image });
  chip.runFor(MS);
  assert.equal(chip.inBootloader, true);
  assert.notEqual(chip.peek32(RAM), 1);
});

test('the boot ROM ends a download by the watchdog; registers survive as on the chip', () => {
  const chip = new Program().sleep().chip();
  const causes = [];
  chip.onReset = (cause) => causes.push(cause);
  const registers = () =>
    [REASON, SCRATCH0, SCRATCH0 + 16].map((offset) => chip.bus.read32(WATCHDOG + offset));
  const prepare = () => {
    chip.bus.write32(WATCHDOG + SCRATCH0, 5);
    chip.bus.write32(WATCHDOG + SCRATCH0 + 16, 7);
    chip.poke(RAM, [1, 2, 3, 4]);
  };
  chip.reset('bootsel');
  prepare();
  chip.finishDownload('uf2');
  chip.runFor(499 * MS);
  assert.equal(chip.inBootloader, true);
  chip.runFor(2 * MS);
  assert.equal(chip.inBootloader, false);
  assert.deepEqual(registers(), [1, 5, 0]);
  assert.equal(chip.peek32(RAM), 0x04030201);
  prepare();
  chip.reset('system');
  assert.deepEqual(registers(), [1, 5, 7]);
  chip.reset('run');
  assert.deepEqual(registers(), [0, 0, 0]);
  assert.deepEqual(causes, ['power', 'watchdog', 'system', 'run']);
});

/** Runs a chip with pulses, alarms and a watchdog reset, in steps of `step`. */
function busyRun(step) {
  const program = new Program()
    .set(TIMER + 0x38, 1)
    .set(NVIC_ISER, 1)
    .set(WATCHDOG + 4, 9000)
    .set(WATCHDOG, ENABLE);
  program
    .set(0x40014000 + 8 * 25 + 4, 5)
    .set(0xd0000020, 1 << 25)
    .set(TIMER + 0x10, 100)
    .sleep();
  program
    .handler(16)
    .set(TIMER + 0x34, 1)
    .set(0xd000001c, 1 << 25);
  program.load(1, TIMER).ldr(0, 1, 0x28).raw(0x3064).str(0, 1, 0x10);
  const chip = program.raw(0x4770).chip();
  const edges = record(chip, 25, () => 0);
  loadPio(
    chip,
    [pio.with(pio.set(PINS, 1), { delay: 30 }), pio.with(pio.set(PINS, 0), { delay: 30 })],
    [2],
  );
  configure(chip, 0, {
    clkdiv: (3 << 16) | (77 << 8),
    wrap: [0, 1],
    pinctrl: (1 << 26) | (2 << 5),
  });
  start(chip);
  for (let spent = 0; spent < 20 * MS; spent += step) chip.runFor(step);
  return { hash: String(chip.hash), count: chip.hash.count, edges };
}

test('two runs are equal to the cycle, for any division into steps', () => {
  const first = busyRun(MS);
  assert.ok(first.count > 1000 && first.edges.length > 100);
  assert.deepEqual(busyRun(MS), first);
  assert.deepEqual(busyRun(12_500), first);
});

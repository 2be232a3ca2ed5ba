// Tests of the flash's cache: its time, its lines, and that translated code takes the same time.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { Program, sleepingChip, SSI, US } from './support.mjs';

const FLASH = 0x10000000;
const XIP_CTRL = 0x14000000;
/** Bytes after which the lines share a set. */
const WAY = 8192;

/** Sets the flash's interface up as the W25Q080's second stage does, with a divider. */
function setUp(chip, divider = 2) {
  for (const [offset, value] of [
    [0x08, 0],
    [0x14, divider],
    [0x00, 0x005f0300],
    [0xf4, 0xa0002022],
    [0x08, 1],
  ])
    chip.bus.write32(SSI + offset, value);
}

function cachedChip() {
  const chip = sleepingChip();
  setUp(chip);
  chip.bus.cache.flush();
  return chip;
}

/** Returns the cycles that a read of flash waits. */
function wait(chip, offset) {
  chip.bus.takeStall();
  chip.bus.read32(FLASH + offset);
  return chip.bus.takeStall();
}

test('a miss takes the transfer that the second stage has set up', () => {
  const chip = cachedChip();
  // 8 clocks for the address and its mode bits, 4 wait cycles, 16 for 64 bits of data.
  assert.equal(wait(chip, 0x1000), 2 * (8 + 4 + 16));
  assert.equal(wait(chip, 0x1004), 0, 'the other word of the line');
  assert.equal(wait(chip, 0x1008), 56, 'the next line');
  setUp(chip, 4);
  assert.equal(wait(chip, 0x1010), 112);
});

test('a set keeps two lines, and the older one gives way', () => {
  const chip = cachedChip();
  const before = chip.bus.cache.misses;
  assert.deepEqual([0, 1, 0, 1].map((way) => wait(chip, 0x1000 + way * WAY)), [56, 56, 0, 0]);
  assert.equal(wait(chip, 0x1000 + 2 * WAY), 56);
  assert.deepEqual([2, 1, 0].map((way) => wait(chip, 0x1000 + way * WAY)), [0, 0, 56]);
  assert.equal(chip.bus.cache.misses - before, 4);
});

test('the cache is flushed and switched off by its registers', () => {
  const chip = cachedChip();
  wait(chip, 0x1000);
  chip.bus.write32(XIP_CTRL + 4, 1);
  assert.deepEqual([wait(chip, 0x1000), wait(chip, 0x1000)], [56, 0]);
  chip.bus.write32(XIP_CTRL, 0);
  assert.deepEqual([wait(chip, 0x1000), wait(chip, 0x1000)], [56, 56]);
});

test('addresses say whether a line is kept and looked for', () => {
  const chip = cachedChip();
  const [notKept, notLookedFor] = [0x1000000, 0x2000000];
  assert.deepEqual([notKept, 0, notKept].map((bits) => wait(chip, bits + 0x1000)), [56, 56, 0]);
  assert.equal(wait(chip, notLookedFor + 0x1000), 56);
});

test('a look from outside takes no time and changes nothing', () => {
  const chip = cachedChip();
  chip.peek(FLASH + 0x1000, 64);
  assert.equal(chip.bus.takeStall(), 0);
  assert.equal(wait(chip, 0x1000), 56);
});

test('a program waits for its lines once, and not again in a loop', () => {
  const loop = new Program().load(2, 1000).label('loop').raw(0x3a01).jump('loop', 1).sleep();
  const chip = loop.chip();
  setUp(chip);
  chip.runFor(100 * US);
  // subs and a taken branch 999 times, the last one not taken; the code is in two lines.
  const busy = chip.cycles - chip.sleepCycles;
  assert.ok(chip.bus.cache.misses <= 8, `${chip.bus.cache.misses} misses`);
  assert.ok(busy > 3 * 1000 && busy < 3 * 1000 + 600, `${busy} cycles`);
});

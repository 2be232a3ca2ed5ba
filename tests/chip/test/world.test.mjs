// Tests of the chip's surroundings: pins, UART, I2C bus, flash, USB cable.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { Chip, Pca9685 } from '../src/chip.mjs';
import {
  DPRAM,
  I2C0,
  IO_BANK0,
  MS,
  PADS,
  Program,
  SIO,
  SSI,
  sleepingChip,
  UART0,
  US,
  USB,
} from './support.mjs';

const RAM = 0x20000100;
const AVAILABLE = 1 << 10;
const FULL = 1 << 15;

const input = (chip, pin) => (chip.bus.read32(SIO + 4) >>> pin) & 1;
const pad = (chip, pin, bits) => chip.bus.write32(PADS + 4 + 4 * pin, bits);
const PULL_UP = 0x48;
const PULL_DOWN = 0x44;

test('an input reads what drives it, or its pull', () => {
  const chip = sleepingChip();
  assert.equal(input(chip, 15), 0, 'pulled down after a reset');
  pad(chip, 15, PULL_UP);
  assert.equal(input(chip, 15), 1);
  chip.drive(15, 0);
  assert.equal(input(chip, 15), 0);
  chip.drive(15, null);
  assert.equal(input(chip, 15), 1);
  pad(chip, 15, PULL_DOWN);
  assert.equal(input(chip, 15), 0);
});

test('a level from outside survives a reset, an output of the chip does not', () => {
  const chip = sleepingChip();
  chip.drive(15, 1);
  chip.bus.write32(IO_BANK0 + 8 * 8 + 4, 5);
  chip.bus.write32(SIO + 0x24, 1 << 8);
  chip.bus.write32(SIO + 0x14, 1 << 8);
  const levels = [];
  chip.watch(8, (level) => levels.push(level));
  assert.equal(chip.level(8), 1);
  chip.reset('run');
  assert.deepEqual(levels, [0]);
  assert.equal(input(chip, 15), 1);
});

test('an edge on a pin interrupts; a change of its settings does not', () => {
  const chip = sleepingChip();
  const EDGES = 0xc << 28; // of pin 15, in PROC0_INTE1
  chip.bus.write32(IO_BANK0 + 0x104, EDGES);
  pad(chip, 15, PULL_DOWN);
  assert.equal((chip.core.lines >> 13) & 1, 0);
  chip.drive(15, 1);
  assert.equal((chip.core.lines >> 13) & 1, 1);
  chip.bus.write32(IO_BANK0 + 0xf4, EDGES);
  assert.equal((chip.core.lines >> 13) & 1, 0);
});

/** Sets up UART0 at 115 200 baud with FIFOs. */
function serialChip() {
  const chip = sleepingChip();
  [
    [0x24, 67],
    [0x28, 52],
    [0x2c, 0x70],
    [0x30, 0x301],
  ].forEach(([offset, value]) => chip.bus.write32(UART0 + offset, value));
  return chip;
}
const BYTE_US = 10 / 0.1152;

test('bytes take their time over the UART, in both directions', () => {
  const chip = serialChip();
  const sent = [];
  chip.uart0.onByte = (byte) => sent.push([byte, chip.nanos / US]);
  const from = chip.nanos / US;
  [1, 2, 3].forEach((byte) => chip.bus.write32(UART0, byte));
  chip.runFor(4 * BYTE_US * US);
  assert.deepEqual(
    sent.map(([byte]) => byte),
    [1, 2, 3],
  );
  sent.forEach(([, at], i) => assert.ok(Math.abs(at - from - (i + 1) * BYTE_US) < 0.2));
  chip.uart0.feed([7, 8]);
  chip.runFor(0.9 * BYTE_US * US);
  assert.equal(chip.bus.read32(UART0 + 0x18) & 16, 16, 'nothing yet');
  chip.runFor(1.2 * BYTE_US * US);
  assert.deepEqual([chip.bus.read32(UART0), chip.bus.read32(UART0)], [7, 8]);
});

test('the receiver interrupts at its level, or after a pause', () => {
  const chip = serialChip();
  chip.bus.write32(UART0 + 0x38, (1 << 4) | (1 << 6));
  const line = () => (chip.core.lines >> 20) & 1;
  chip.uart0.feed([1]);
  chip.runFor(2 * BYTE_US * US);
  assert.equal(line(), 0);
  chip.runFor(3 * BYTE_US * US);
  assert.equal(line(), 1, 'time-out');
  chip.bus.read32(UART0);
  assert.equal(line(), 0);
  chip.uart0.feed(new Array(16).fill(5));
  chip.runFor(15.5 * BYTE_US * US);
  assert.equal(line(), 0);
  chip.runFor(BYTE_US * US);
  assert.equal(line(), 1, 'half full');
});

test('a byte for a full FIFO is lost', () => {
  const chip = serialChip();
  chip.uart0.feed(Array.from({ length: 40 }, (_, i) => i));
  chip.runFor(50 * BYTE_US * US);
  const received = [];
  while (!(chip.bus.read32(UART0 + 0x18) & 16)) received.push(chip.bus.read32(UART0));
  assert.deepEqual(
    received,
    Array.from({ length: 32 }, (_, i) => i),
  );
  assert.equal(chip.uarts[0].overruns, 8);
});

/** Sets up I2C0 at 400 kHz with the target `address`. */
function busChip(address) {
  const chip = sleepingChip();
  [
    [0x6c, 0],
    [0x1c, 125],
    [0x20, 187],
    [0x04, address],
    [0x6c, 1],
  ].forEach(([offset, value]) => chip.bus.write32(I2C0 + offset, value));
  return chip;
}
const STOP = 1 << 9;
const command = (chip, words) => words.forEach((word) => chip.bus.write32(I2C0 + 0x10, word));
const raw = (chip) => chip.bus.read32(I2C0 + 0x34);

test('a PCA9685 records what is written to it, at the speed of the bus', () => {
  const chip = busChip(0x60);
  const hat = new Pca9685();
  chip.i2c[0].targets.set(0x60, hat);
  command(chip, [0x00, 0x21 | STOP]);
  chip.runFor(20 * US);
  assert.equal(raw(chip) & (1 << 9), 0, 'not stopped yet');
  chip.runFor(100 * US);
  assert.equal(raw(chip) & (1 << 9), 1 << 9);
  command(chip, [0x06, 0, 0x10, 0x34, 0x02 | STOP]);
  chip.runFor(200 * US);
  assert.deepEqual(hat.writes, [
    { register: 0, bytes: [0x21] },
    { register: 6, bytes: [0, 0x10, 0x34, 0x02] },
  ]);
  assert.deepEqual(hat.channel(0), { on: 0x1000, off: 0x234 });
});

test('an unknown address and a refused byte abort a transfer', () => {
  const chip = busChip(0x61);
  command(chip, [0, 1 | STOP]);
  chip.runFor(100 * US);
  assert.equal(chip.bus.read32(I2C0 + 0x80) & 1, 1, '7-bit address not acknowledged');
  chip.bus.read32(I2C0 + 0x54);
  const hat = new Pca9685();
  hat.patience = 1;
  chip.i2c[0].targets.set(0x61, hat);
  command(chip, [0, 1 | STOP]);
  chip.runFor(200 * US);
  assert.equal((chip.bus.read32(I2C0 + 0x80) >> 3) & 1, 1, 'data not acknowledged');
});

test('the bus reads, and its interrupts follow the FIFOs', () => {
  const chip = busChip(0x60);
  const hat = new Pca9685();
  chip.i2c[0].targets.set(0x60, hat);
  assert.equal(raw(chip) & 16, 16, 'room to send');
  command(chip, [0xfe, 0x100 | (1 << 10) | STOP]);
  assert.equal(raw(chip) & 4, 0);
  chip.runFor(200 * US);
  assert.equal(raw(chip) & 4, 4, 'a byte to read');
  assert.equal(chip.bus.read32(I2C0 + 0x10) & 255, 0x1e);
  assert.equal(raw(chip) & 4, 0);
});

/**
 * Erases the last sector and programs its first page with 0x55, from RAM and with flash unmapped.
 */
function flashWriter() {
  const SECTOR = 0x1ff000;
  const call = (p, name, ...args) => {
    p.load(0, 0x40)
      .load(1, name.charCodeAt(0) | (name.charCodeAt(1) << 8))
      .load(3, 0x21)
      .raw(0x4798, 0x4606); // r6 = lookup
    args.forEach((value, i) => p.load(i, value));
    return p.raw(0x47b0); // blx r6
  };
  const p = new Program();
  for (const [name, ...args] of [
    ['IF'],
    ['EX'],
    ['RE', SECTOR, 4096],
    ['RP', SECTOR, RAM, 256],
    ['FC'],
    ['CX'],
  ])
    call(p, name, ...args);
  const image = p.set(0x20008000, 1).sleep().build();
  // Flash is not readable meanwhile, so that the code is copied to RAM and started there.
  return { image, SECTOR };
}

function flashChip() {
  const { image, SECTOR } = flashWriter();
  const chip = new Chip({ image });
  const code = chip.peek(0x10000200, 0x200);
  chip.poke(0x20002000, code);
  chip.poke(RAM, new Uint8Array(256).fill(0x55));
  chip.core.pc = 0x20002000;
  chip.flash.bytes.fill(0x00, SECTOR, SECTOR + 4096);
  return { chip, SECTOR };
}

test('flash is erased and programmed in its time, and survives a reset', () => {
  const { chip, SECTOR } = flashChip();
  chip.runFor(44 * MS);
  assert.equal(chip.flash.busy.kind, 'erase');
  assert.equal(chip.peek32(0x20008000), 0);
  chip.runFor(2 * MS);
  assert.equal(chip.peek32(0x20008000), 1);
  assert.deepEqual(
    chip.flash.log.map(({ kind, length }) => [kind, length]),
    [
      ['erase', 4096],
      ['program', 256],
    ],
  );
  assert.deepEqual([...chip.peek(0x10000000 + SECTOR + 254, 4)], [0x55, 0x55, 0xff, 0xff]);
  const next = new Chip({ flash: chip.saveFlash() });
  assert.equal(next.peek32(0x10000000 + SECTOR), 0x55555555);
  chip.reset('power');
  assert.equal(chip.peek32(0x10000000 + SECTOR), 0x55555555);
});

test('a power failure leaves a sector partly erased; a watchdog reset does not', () => {
  const { chip, SECTOR } = flashChip();
  chip.runUntil(() => chip.flash.busy, MS);
  chip.runFor(22.5 * MS);
  chip.reset('power');
  const sector = chip.peek(0x10000000 + SECTOR, 4096);
  const erased = sector.filter((byte) => byte === 0xff).length;
  assert.ok(erased > 1500 && erased < 2600, `${erased} bytes erased`);
  const other = flashChip();
  other.chip.runUntil(() => other.chip.flash.busy, MS);
  other.chip.requestReset('watchdog');
  other.chip.runFor(US);
  assert.ok(other.chip.peek(0x10000000 + SECTOR, 4096).every((byte) => byte === 0xff));
});

test('code in flash faults while flash is unmapped', () => {
  const p = new Program()
    .load(0, 0x40)
    .load(1, 0x5845)
    .load(3, 0x21)
    .raw(0x4798, 0x4606, 0x47b0)
    .sleep(); // EX
  const chip = p.chip();
  chip.runFor(MS);
  assert.equal(chip.core.fault.kind, 'bus fault');
});

test('a second boot stage makes flash readable through the registers of its interface', () => {
  const FLASH = 0x10000000;
  const { bus } = sleepingChip();
  const first = bus.read32(FLASH);
  bus.flashReadable = false;
  bus.write32(SSI + 8, 0);
  bus.write32(SSI, 7 << 16); // commands: send and receive 8 bits
  bus.write32(SSI + 8, 1);
  assert.throws(() => bus.read32(FLASH), /bus fault/);
  bus.write32(SSI + 8, 0);
  bus.write32(SSI, (2 << 21) | (31 << 16) | (3 << 8)); // quad, 32 bits, address and then read
  assert.throws(() => bus.read32(FLASH), /bus fault/);
  bus.write32(SSI + 8, 1);
  assert.equal(bus.read32(FLASH), first);
});

/**
 * Returns a chip whose firmware (the test) has a receive buffer on endpoint 2 and no transmit
 * buffer.
 */
function usbChip() {
  const chip = sleepingChip();
  chip.bus.write32(USB + 0x40, 1);
  chip.bus.write32(DPRAM + 8 * 2 + 4, (1 << 31) | 0x180);
  chip.bus.write32(DPRAM + 8 * 2, (1 << 31) | 0x200);
  chip.bus.write32(DPRAM + 0x94, 64 | AVAILABLE);
  return chip;
}

test('a receive buffer stays available until a packet has arrived', () => {
  const chip = usbChip();
  chip.runFor(MS);
  assert.equal(chip.bus.read32(DPRAM + 0x94) & AVAILABLE, AVAILABLE);
  assert.equal(chip.bus.read32(USB + 0x58), 0);
  chip.port.put(2, Uint8Array.from([1, 2, 3]));
  assert.equal(chip.bus.read32(DPRAM + 0x94) & (AVAILABLE | FULL | 0x3ff), FULL | 3);
  assert.equal(chip.bus.read32(USB + 0x58), 1 << 5);
  assert.deepEqual([...chip.peek(DPRAM + 0x180, 3)], [1, 2, 3]);
});

test('a packet is not sent without a request of the host', () => {
  const chip = usbChip();
  chip.bus.write32(DPRAM + 0x200, 0x04030201);
  chip.bus.write32(DPRAM + 0x90, 3 | FULL | AVAILABLE);
  chip.runFor(MS);
  assert.equal(chip.bus.read32(DPRAM + 0x90) & AVAILABLE, AVAILABLE);
  assert.equal(chip.bus.read32(USB + 0x58), 0);
  assert.deepEqual([...chip.port.take(2).bytes], [1, 2, 3]);
  assert.equal(chip.bus.read32(USB + 0x58), 1 << 4);
});

test('a new host resets the bus; unplugging suspends it once', () => {
  const chip = usbChip();
  const states = [];
  chip.usb.onState = (state) => states.push(state);
  chip.bus.write32(USB + 0x4c, 1 << 16);
  chip.runFor(20 * MS);
  assert.deepEqual(states, ['attached']);
  assert.equal((chip.bus.read32(USB + 0x50) >> 19) & 1, 1, 'BUS_RESET');
  chip.usb.unplug();
  chip.runFor(10 * MS);
  assert.deepEqual(states, ['attached', 'lost']);
  assert.equal((chip.bus.read32(USB + 0x8c) >> 14) & 1, 1, 'DEV_SUSPEND');
  chip.bus.write32(USB + 0x50, 1 << 4);
  chip.runFor(10 * MS);
  assert.equal((chip.bus.read32(USB + 0x8c) >> 14) & 1, 0);
  chip.usb.plug();
  chip.runFor(20 * MS);
  assert.deepEqual(states, ['attached', 'lost', 'attached']);
});

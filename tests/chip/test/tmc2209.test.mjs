// Tests of the emulated TMC2209s on UART1, whose registers the tests write: no firmware runs.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { Chip, DriverWire } from '../src/chip.mjs';
import { crc8 } from '../src/tmc2209.mjs';
import { IO_BANK0 } from './support.mjs';

const UART1 = 0x40038000;
const [DR, FR] = [UART1, UART1 + 0x18];
const RX_EMPTY = 1 << 4;
const [TX, RX] = [8, 9];
const [STEP, DIRECTION, ENABLE] = [11, 10, 12];
const BAUD = 115_200;
const BIT_NS = 1e9 / BAUD;
const [GSTAT, IFCNT, NODECONF, IOIN] = [0x01, 0x02, 0x03, 0x06];
const [CHOPCONF, DRV_STATUS] = [0x6c, 0x6f];
const ON = 0x1401_0053;

/** Returns a chip whose UART1 is at its pins, and the wire with a driver at each address. */
function wired(addresses = [0]) {
  const chip = new Chip();
  const divider = 125e6 / (16 * BAUD);
  chip.bus.write32(UART1 + 0x24, Math.floor(divider));
  chip.bus.write32(UART1 + 0x28, Math.round((divider % 1) * 64));
  chip.bus.write32(UART1 + 0x2c, 0x70);
  chip.bus.write32(UART1 + 0x30, 0x301);
  for (const pin of [TX, RX]) chip.bus.write32(IO_BANK0 + 8 * pin + 4, 2);
  const wire = new DriverWire(chip, [TX, RX]);
  const pins = { step: STEP, direction: DIRECTION, enable: ENABLE };
  const drivers = addresses.map((address) => wire.add({ ...pins, address }));
  return { chip, wire, drivers };
}

const framed = (bytes) => [...bytes, crc8(bytes)];

/** Sends bytes, runs for 1.5 ms, and returns what has arrived. */
function exchange(chip, bytes) {
  for (const byte of bytes) chip.bus.write32(DR, byte);
  chip.runFor(1.5e6);
  const received = [];
  while (!(chip.bus.read32(FR) & RX_EMPTY)) received.push(chip.bus.read32(DR) & 255);
  return received;
}

/** Writes a register of the driver at `address`. */
function write(chip, address, register, value) {
  const data = [24, 16, 8, 0].map((shift) => (value >>> shift) & 255);
  return exchange(chip, framed([5, address, register | 0x80, ...data]));
}

/** Reads a register; null where the answer is not right. */
function read(chip, address, register) {
  const received = exchange(chip, framed([5, address, register]));
  const reply = received.slice(4);
  if (reply.length !== 8 || crc8(reply.slice(0, 7)) !== reply[7]) return null;
  return reply.slice(3, 7).reduce((value, byte) => value * 256 + byte, 0);
}

test('the CRC is that of recorded datagrams', () => {
  assert.equal(crc8([0x05, 0x00, 0xec, 0x10, 0x00, 0x00, 0x53]), 0x9c);
  assert.equal(crc8([0x05, 0xff, 0x06, 0x21, 0x00, 0x02, 0x41]), 0x9d);
});

test('a request is heard back, and its reply comes after SENDDELAY', () => {
  const { chip } = wired();
  const arrivals = [];
  const { receive } = chip.uarts[1];
  chip.uarts[1].receive = function (byte) {
    arrivals.push(chip.nanos);
    receive.call(this, byte);
  };
  const request = framed([5, 0, IFCNT]);
  const start = chip.nanos;
  assert.deepEqual(exchange(chip, request).slice(0, 6), [...request, 5, 255]);
  const bits = arrivals.map((at) => Math.round((at - start) / BIT_NS));
  assert.deepEqual(bits, [10, 20, 30, 40, 58, 68, 78, 88, 98, 108, 118, 128], '8 bits, then bytes');
  write(chip, 0, NODECONF, 2 << 8);
  arrivals.length = 0;
  const later = chip.nanos;
  exchange(chip, request);
  assert.equal(Math.round((arrivals[4] - later) / BIT_NS), 74, '24 bits');
});

test('writes are counted, and registers read back', () => {
  const { chip } = wired([0, 2]);
  assert.equal(read(chip, 0, IFCNT), 0);
  assert.equal(write(chip, 2, CHOPCONF, ON).length, 8, 'an echo only');
  assert.deepEqual([read(chip, 0, IFCNT), read(chip, 2, IFCNT)], [0, 1]);
  assert.deepEqual([read(chip, 0, CHOPCONF), read(chip, 2, CHOPCONF)], [0x10000053, ON]);
  assert.equal(read(chip, 1, IFCNT), null, 'nobody has this address');
  assert.equal(read(chip, 0, GSTAT), 1, 'reset');
  write(chip, 0, GSTAT, 1);
  assert.equal(read(chip, 0, GSTAT), 0);
});

test('a damaged datagram is ignored, and the next one is heard after a rest', () => {
  const { chip } = wired();
  const bytes = framed([5, 0, 0x80 | CHOPCONF, 0, 0, 0, 0]);
  exchange(chip, [...bytes.slice(0, -1), bytes.at(-1) ^ 1]);
  assert.equal(read(chip, 0, IFCNT), 0);
  // Half a datagram: the pause after it is longer than 63 bits.
  exchange(chip, bytes.slice(0, 5));
  assert.equal(read(chip, 0, IFCNT), 0);
});

test('a request too soon after a reply is not heard', () => {
  const { chip } = wired([0, 1]);
  const request = framed([5, 0, IFCNT]);
  for (const [bits, length] of [
    [130, 0],
    [145, 8],
  ]) {
    for (const byte of request) chip.bus.write32(DR, byte);
    chip.runFor(bits * BIT_NS);
    while (!(chip.bus.read32(FR) & RX_EMPTY)) chip.bus.read32(DR);
    const received = exchange(chip, framed([5, 1, IFCNT]));
    assert.equal(received.length - 4, length, `${bits} bits after the last one`);
    chip.runFor(1e6);
  }
});

test('IOIN has the pins, and two drivers on an address differ only by them', () => {
  const { chip, drivers } = wired([1, 1]);
  Object.assign(drivers[1], { direction: 28 });
  assert.equal(read(chip, 1, IOIN), 0x21000044, 'version, PDN_UART, MS1');
  chip.drive(DIRECTION, 1);
  assert.equal(read(chip, 1, IOIN), null, 'they damage each other');
  chip.drive(28, 1);
  assert.equal(read(chip, 1, IOIN), 0x21000244);
});

test('a short circuit switches off until TOFF is 0, the heat until it has cooled down', () => {
  const { chip, drivers } = wired();
  const [driver] = drivers;
  write(chip, 0, GSTAT, 7);
  chip.drive(ENABLE, 0);
  assert.ok(driver.isOn);
  driver.isShorted = true;
  assert.equal(read(chip, 0, DRV_STATUS) & 0x3c, 4);
  assert.equal(read(chip, 0, GSTAT), 2);
  driver.isShorted = false;
  assert.equal(read(chip, 0, DRV_STATUS) & 0x3c, 4, 'kept');
  write(chip, 0, CHOPCONF, ON & ~15);
  write(chip, 0, CHOPCONF, ON);
  assert.equal(read(chip, 0, DRV_STATUS) & 0x3c, 0);
  for (const [temperature, flags, isOn] of [
    [125, 0x101, true],
    [155, 0x703, false],
    [130, 0x103, false],
    [90, 0, true],
  ]) {
    driver.temperature = temperature;
    assert.equal(read(chip, 0, DRV_STATUS) & 0xf03, flags, `${temperature} °C`);
    assert.equal(driver.isOn, isOn, `${temperature} °C`);
  }
});

test('pulses move the motor by the microsteps of CHOPCONF, while the driver is on', () => {
  const { chip, drivers } = wired();
  const [driver] = drivers;
  const pulse = () => [1, 0].forEach((level) => chip.drive(STEP, level));
  chip.drive(ENABLE, 0);
  pulse();
  assert.equal(driver.position, -32, '8 microsteps by the address pins');
  write(chip, 0, 0x00, 0x1c0);
  write(chip, 0, CHOPCONF, ON);
  chip.drive(DIRECTION, 1);
  pulse();
  assert.equal(driver.position, -16);
  chip.drive(ENABLE, 1);
  pulse();
  assert.equal(driver.position, -16);
});

test('nothing passes while UART1 is not at the pins, nor at a rate that is too high', () => {
  const { chip } = wired();
  chip.bus.write32(UART1 + 0x24, 6);
  assert.equal(exchange(chip, framed([5, 0, IFCNT])).length, 4, 'an echo, at 1.3 Mbit/s');
  chip.bus.write32(IO_BANK0 + 8 * TX + 4, 5);
  assert.deepEqual(exchange(chip, framed([5, 0, IFCNT])), []);
});

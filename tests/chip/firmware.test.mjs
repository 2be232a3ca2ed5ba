// The real firmware starts in the emulated chip and answers. The Rust tests compare its behaviour
// with the emulated board.
// usage: PLUMB_ELF=target/firmware/plumb.elf node --test tests/chip/firmware.test.mjs
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { before, test } from 'node:test';
import { Chip } from './src/chip.mjs';
import { Trace } from './src/trace.mjs';
import { CONFIGURED, frame } from './test/frames.mjs';
import { EMERGENCY, FLAG, MACHINE, MONITOR, ORIGIN } from './test/monitor.mjs';

const MS = 1e6;
const [UART_TX, UART_RX, LED] = [0, 1, 25];
const ELF = process.env.PLUMB_ELF;
/**
 * Frame of Hello with id 300 (tests/tests/it/golden.rs); and a part of the board's answer that does
 * not depend on the schema.
 */
const HELLO = Buffer.from('03ac0212504c4d420101020304050607081fb23e5e00', 'hex');
const ANSWER = 'ac02504c4d42';

before(() => assert.ok(ELF, 'PLUMB_ELF has to name the firmware'));

/** Returns the chip 200 ms after power-on, and everything that it has sent. */
function started() {
  const chip = new Chip({ image: ELF });
  const usb = [];
  const uart = [];
  chip.usb.onData = (bytes) => usb.push(...bytes);
  chip.uart0.onByte = (byte) => uart.push(byte);
  chip.runFor(200 * MS);
  return { chip, usb, uart };
}

/** Returns a chip that is configured as a Pico, with its emergency input closed. */
function configured() {
  const { chip } = started();
  chip.drive(EMERGENCY, 0);
  chip.usb.send(CONFIGURED);
  chip.runFor(10 * MS);
  return { chip };
}

/** Returns such a chip while its motor A turns: a jog of 200 steps at 48 steps/s. */
function jogging() {
  const { chip } = configured();
  const jog = [0xac, 0x02, 6, 0, 0x80, 0x32, 0x80, 0xc0, 0x01];
  chip.usb.send(frame(Buffer.from(jog)));
  chip.runFor(20 * MS);
  return { chip };
}

/** Returns the firmware's variable of 32 bits whose name contains this. */
function variable(chip, name) {
  const line = execFileSync('nm', [ELF], { encoding: 'utf8', maxBuffer: 1e8 })
    .split('\n')
    .find((symbol) => symbol.includes(name));
  return chip.peek32(parseInt(line, 16));
}

/** Number of the stepping interrupt's exception, TIMER_IRQ_1. */
const STEPPING = 17;
const DMA_READ_TRIGGER = 0x3c;
const CLKDIV = [0xc8, 0xe0, 0xf8];
const TIMER = 0x40054;
const TIMERAWL = 0x28;
const ALARM1 = 0x14;
/** The tasks' exception, SWI_IRQ_1. */
const TASKS = 16 + 27;
/** Clocks of the longest tick (firmware/README.md). */
const LONGEST_TICK = 23_564;
const PIO0 = 0x50200000;
const PIO_CTRL_CLEAR = PIO0 + 0x3000;
const PIO_IRQ = PIO0 + 0x30;
const CYCLE_NS = 8;
const TICK_CYCLES = 25_000;

/** Returns whether the emergency input has stopped the pulses: a flag of the PIO. */
const isTripped = (chip) => (chip.bus.read32(PIO_IRQ) & FLAG) !== 0;

/** Drives the emergency input: 0 is closed, 1 is open. Then runs for a millisecond. */
function emergency(chip, level) {
  chip.drive(EMERGENCY, level);
  chip.runFor(MS);
}

const hex = (bytes) => Buffer.from(bytes).toString('hex');

test('the firmware enumerates, and answers Hello over USB', () => {
  const { chip, usb } = started();
  assert.equal(chip.usb.ready, true);
  chip.usb.send(HELLO);
  chip.runFor(10 * MS);
  assert.ok(hex(usb).includes(ANSWER), hex(usb));
});

test('the firmware answers Hello over UART, without a USB cable', () => {
  const chip = new Chip({ image: ELF });
  chip.usb.unplug();
  const uart = [];
  chip.uart0.onByte = (byte) => uart.push(byte);
  chip.runFor(50 * MS);
  chip.uart0.feed(HELLO);
  chip.runFor(20 * MS);
  assert.ok(hex(uart).includes(ANSWER), hex(uart));
});

test('the firmware enumerates again after the cable was unplugged', () => {
  const { chip, usb } = started();
  chip.usb.send(HELLO);
  chip.runFor(10 * MS);
  chip.usb.unplug();
  chip.runFor(500 * MS);
  chip.usb.plug();
  assert.ok(chip.runUntil(() => chip.usb.ready, 200 * MS));
  usb.length = 0;
  chip.usb.send(HELLO);
  chip.runFor(20 * MS);
  assert.ok(hex(usb).includes(ANSWER), hex(usb));
  assert.equal(chip.resets, 0);
});

test('an idle firmware sleeps most of the time, without a watchdog reset', () => {
  const { chip } = started();
  chip.runFor(2000 * MS);
  assert.equal(chip.resets, 0);
  assert.equal(chip.core.fault, null);
  assert.ok(chip.load.idle > 0.5, `idle ${chip.load.idle}`);
});

test('the watchdog resets a hanging processor, which starts again', () => {
  const { chip, usb } = started();
  const causes = [];
  chip.onReset = (cause) => causes.push(cause);
  chip.hang();
  assert.ok(chip.runUntil(() => causes.length > 0, 9000 * MS, MS));
  assert.deepEqual(causes, ['watchdog']);
  assert.ok(chip.runUntil(() => chip.usb.ready, 200 * MS));
  usb.length = 0;
  chip.usb.send(HELLO);
  chip.runFor(10 * MS);
  assert.ok(hex(usb).includes(ANSWER), hex(usb));
});

test('before a configuration every pin but those of the link and the LED is an input', () => {
  const { chip } = started();
  for (let pin = 0; pin < 30; pin++) {
    const { outputEnable, pullupEnabled, pulldownEnabled } = chip.mcu.gpio[pin];
    if ([UART_TX, UART_RX, LED].includes(pin)) continue;
    assert.equal(outputEnable, false, `GP${pin} is no output`);
    assert.deepEqual([pullupEnabled, pulldownEnabled], [false, true], `the pull of GP${pin}`);
  }
  assert.equal(chip.mcu.gpio[LED].outputEnable, true);
});

test('the Bootloader message starts the boot ROM', () => {
  const { chip } = started();
  chip.usb.send(Buffer.from('08ac0202b87e1bf300', 'hex'));
  assert.ok(chip.runUntil(() => chip.inBootloader, 100 * MS));
  assert.equal(chip.usb.ready, false);
});

test('two runs are the same', () => {
  const run = () => {
    const { chip } = started();
    chip.drive(EMERGENCY, 0);
    chip.usb.send(CONFIGURED);
    chip.runFor(300 * MS);
    return [String(chip.hash), chip.hash.count, chip.cycles];
  };
  const first = run();
  assert.ok(first[1] > 5);
  assert.deepEqual(run(), first);
});

test('the monitor of the emergency input is the one of the campaign', () => {
  const { chip } = configured();
  const [block] = chip.engine.blocks;
  const machine = block.machines[MACHINE];
  const end = ORIGIN + MONITOR.program.length;
  assert.deepEqual([...block.instructions.slice(ORIGIN, end)], MONITOR.program);
  assert.deepEqual([machine.wrapBottom, machine.wrapTop], MONITOR.wrap);
  assert.deepEqual([machine.y], MONITOR.words);
  assert.deepEqual([machine.inBase, machine.jumpPin], [EMERGENCY, EMERGENCY]);
  assert.deepEqual([machine.outBase, machine.outCount], [0, 32], 'every pin');
  assert.equal(machine.divider, 256, 'a cycle for each instruction');
});

// The processor reads the input as closed, and some clocks later its write has ended the stop. A
// contact that bounces opens again in between.
test('an opening at any clock around the end of a stop is seen, and so is the next press', () => {
  const { chip } = configured();
  emergency(chip, 0);
  let cleared = 0;
  const [block] = chip.engine.blocks;
  const clearFlags = block.clearFlags.bind(block);
  block.clearFlags = (flags) => {
    if (flags & FLAG) cleared = chip.cycles;
    clearFlags(flags);
  };
  emergency(chip, 1);
  emergency(chip, 0);
  assert.ok(cleared > 0, 'the stop has ended');
  const phase = cleared % TICK_CYCLES;
  for (let offset = -60; offset <= 20; offset += 1) {
    emergency(chip, 1);
    assert.ok(isTripped(chip), `${offset}: the press is seen`);
    // Closed in the tick before, so that the next one ends the stop.
    const end = Math.ceil((chip.cycles + TICK_CYCLES - phase) / TICK_CYCLES) * TICK_CYCLES + phase;
    chip.runFor((end - 1000 - chip.cycles) * CYCLE_NS);
    chip.drive(EMERGENCY, 0);
    chip.runFor((end + offset - chip.cycles) * CYCLE_NS);
    chip.drive(EMERGENCY, 1);
    chip.runFor(MS);
    assert.ok(isTripped(chip), `${offset}: open again that many cycles from the end of the stop`);
    emergency(chip, 0);
    assert.ok(!isTripped(chip), `${offset}: the stop ends once the input is closed`);
  }
});

test('an input that is open in two ticks trips, also where its monitor has failed', () => {
  const { chip } = configured();
  emergency(chip, 0);
  assert.ok(!isTripped(chip));
  chip.bus.write32(PIO_CTRL_CLEAR, 1 << MACHINE);
  emergency(chip, 1);
  assert.ok(isTripped(chip));
  emergency(chip, 0);
  assert.ok(!isTripped(chip));
});

test('code in flash takes the same time translated and by single instructions', () => {
  const run = (prepare) => {
    const chip = new Chip({ image: ELF });
    prepare(chip);
    chip.runFor(60 * MS);
    chip.usb.send(HELLO);
    chip.runFor(20 * MS);
    return [String(chip.hash), chip.core.instructions, chip.bus.cache.misses, chip.sleepCycles];
  };
  const translated = run(() => {});
  assert.ok(translated[2] > 1000, `${translated[2]} misses`);
  assert.deepEqual(run((chip) => (chip.bus.pieceAt = () => null)), translated);
});

test('the second boot stage sets up the transfer of a line of the cache', () => {
  const { chip } = started();
  // 28 clocks of the flash at half of clk_sys (rp2040-boot2: boot2_w25q080).
  assert.equal(chip.bus.cache.missCycles, 56);
});

test('no data is offered to the host in the last 200 µs of a frame (erratum E15)', () => {
  const { chip, usb } = started();
  let [frame, latest, offers] = [chip.cycles, 0, 0];
  const { port } = chip;
  const begin = port.frame.bind(port);
  port.frame = () => {
    frame = chip.cycles;
    begin();
  };
  const offer = port.onOffer;
  port.onOffer = (endpoint, out) => {
    if (endpoint !== 0 && !out) {
      offers++;
      latest = Math.max(latest, chip.cycles - frame);
    }
    offer(endpoint, out);
  };
  for (let round = 0; round < 400; round++) {
    chip.usb.send(HELLO);
    chip.runFor(2 * MS + 7500);
  }
  assert.ok(offers >= 400 && usb.length > 400 * 20, `${offers} offers`);
  assert.ok(latest < 800 * 125, `${latest / 125} µs after the beginning of a frame`);
});

test('the longest ticks move no offer into them either', () => {
  const { chip, usb } = started();
  let [begin, latest, offers, frames, looked] = [chip.cycles, 0, 0, 0, 0];
  const { port } = chip;
  const frameBegins = port.frame.bind(port);
  port.frame = () => {
    begin = chip.cycles;
    // One delays the interrupt of a frame.
    if (++frames % 7 === 0) chip.bus.stall += LONGEST_TICK;
    frameBegins();
  };
  const offer = port.onOffer;
  port.onOffer = (endpoint, out) => {
    if (endpoint !== 0 && !out) {
      offers++;
      latest = Math.max(latest, chip.cycles - begin);
    }
    offer(endpoint, out);
  };
  // Another interrupts the tasks after a look at the time.
  const timer = chip.mcu.peripherals[TIMER];
  const read = timer.readUint32.bind(timer);
  timer.readUint32 = (offset) => {
    const isLook = offset === TIMERAWL && chip.core.IPSR === TASKS && frames % 7 > 0;
    if (isLook && chip.cycles - looked > 2_013_000) {
      looked = chip.cycles;
      chip.bus.stall += LONGEST_TICK;
    }
    return read(offset);
  };
  for (let round = 0; round < 600; round++) {
    chip.usb.send(HELLO);
    chip.runFor(2 * MS + 7500);
  }
  assert.ok(offers >= 400 && usb.length > 400 * 20, `${offers} offers`);
  assert.ok(latest < 800 * 125, `${latest / 125} µs after the beginning of a frame`);
});

test('state machines that are slower than planned: the board refuses to drive', () => {
  for (const [sixteenths, answer] of [
    [0, '0401ac0208'], // carried out
    [1, 'ac0201040d'], // refused, a fault: the clock
  ]) {
    const chip = new Chip({ image: ELF });
    const [block] = chip.engine.blocks;
    const write = block.writeUint32Atomic.bind(block);
    block.writeUint32Atomic = (offset, value, alias) =>
      write(offset, CLKDIV.includes(offset) ? value | (sixteenths << 12) : value, alias);
    const usb = [];
    chip.usb.onData = (bytes) => usb.push(...bytes);
    chip.runFor(200 * MS);
    chip.drive(EMERGENCY, 0);
    chip.usb.send(CONFIGURED);
    chip.runFor(20 * MS);
    assert.ok(hex(usb).includes(answer), hex(usb));
    assert.equal(chip.resets, 0);
  }
});

test('words that come late after the look at the time are counted as a late tick', () => {
  const { chip } = jogging();
  assert.equal(variable(chip, 'LATE_TICKS'), 0);
  const { dma } = chip.mcu;
  const write = dma.writeUint32.bind(dma);
  let isArmed = true;
  dma.writeUint32 = (offset, value) => {
    // 100 µs between the words of motor A and those of B.
    if (offset === DMA_READ_TRIGGER && isArmed) {
      isArmed = false;
      chip.bus.stall += 12_500;
    }
    write(offset, value);
  };
  chip.runFor(5 * MS);
  assert.equal(isArmed, false);
  assert.equal(variable(chip, 'LATE_TICKS'), 1);
});

test('a state machine that stands still delays the ticks by two at most', () => {
  const { chip } = jogging();
  const trace = new Trace(chip, {}, { tick: STEPPING });
  chip.bus.write32(PIO_CTRL_CLEAR, 1);
  chip.bus.stall += 3 * TICK_CYCLES;
  chip.runFor(100 * MS);
  const longest = Math.max(...trace.take().tick.map(([, cycles]) => cycles));
  // Those of the delay, two for the machine, and its own.
  assert.ok(longest < 6 * TICK_CYCLES, `${longest} clocks`);
});

test('an alarm that comes while it is compared begins one tick, not two', () => {
  const { chip } = configured();
  const timer = chip.mcu.peripherals[TIMER];
  const write = timer.writeUint32.bind(timer);
  const ahead = [];
  timer.writeUint32 = (offset, value) => {
    write(offset, value);
    if (offset !== ALARM1) return;
    ahead.push(value - Math.floor(chip.clock.now / 125));
    // The processor goes on when the alarm has come.
    if (ahead.length === 10) chip.bus.stall += ahead[9] * 125;
  };
  chip.runFor(5 * MS);
  assert.ok(ahead.length > 20 && Math.max(...ahead) <= 200, `${ahead} µs to the next tick`);
});

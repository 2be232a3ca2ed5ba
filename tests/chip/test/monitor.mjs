// The monitor of the emergency input, alone in the PIO engine: a campaign of contacts that bounce.
//
// The program is a copy of the firmware's (`load_monitor` in
// firmware/src/generator/program.rs); `firmware.test.mjs` compares it with the real image.
import { VirtualClock } from '../src/clock.mjs';
import { Engine } from '../src/pio/engine.mjs';
import { pio, random, X, Y } from './support.mjs';

export const EMERGENCY = 15;
export const ENABLE = 14;
export const FLAG = 1 << 4;
export const MACHINE = 3;
/** Cycles that the input must be open: 50 µs. */
export const FILTER = 6250;
/** Cycles from the processor's look at the input to its first write that ends a stop. */
const LOOK = 6;
/**
 * Cycles from an opening that stays to the end of the pulses, at most; the filter begins anew where
 * the processor ends an earlier stop just then.
 */
const REACTION = FILTER + 8 + LOOK;
const TICK = 25_000;
/** Address of the program. */
export const ORIGIN = 17;
const PIN_DIRECTIONS = 4;
const OSR = 7;
const NULL = 3;
const INVERTED = 1 << 3;
const PIN_HIGH = 6;
const X_NOT_ZERO = 2;
const EMERGENCY_PIN = 1;

/** Registers of a PIO block, as offsets; those of the machine by their own. */
const CTRL = 0x00;
const TXF = 0x10 + 4 * MACHINE;
const IRQ = 0x30;
const PROGRAM = 0x48;
const SM = 0xc8 + 0x18 * MACHINE;
const EXECCTRL = SM + 0x04;
const SHIFTCTRL = SM + 0x08;
const INSTR = SM + 0x10;
const PINCTRL = SM + 0x14;

/**
 * A monitor: its program at address 17, the first and last address that repeat, the words for its
 * queue, whether short openings are to have no effect, and the processor's writes when it finds the
 * input closed: [register, value], one a cycle.
 */
export const MONITOR = {
  program: [
    pio.pull,
    pio.mov(Y, OSR),
    pio.mov(OSR, NULL),
    pio.wait(1, EMERGENCY_PIN, 0),
    pio.mov(X, Y),
    pio.jmp(24, PIN_HIGH),
    pio.jmp(20),
    pio.jmp(22, X_NOT_ZERO),
    pio.out(PIN_DIRECTIONS, 32),
    pio.irqWait(4),
    pio.mov(OSR, INVERTED | NULL),
    pio.out(PIN_DIRECTIONS, 32),
  ],
  wrap: [19, 28],
  words: [FILTER / 2 - 1],
  hasFilter: true,
  end: [[IRQ, FLAG]],
};

/**
 * A monitor without a filter, which stops at its end until the processor starts it again. The
 * processor starts it before it clears the flag: an opening in between is lost, and with it all
 * later presses.
 */
export const ARMED_TOO_EARLY = {
  ...MONITOR,
  program: [
    pio.pull,
    pio.set(PIN_DIRECTIONS, 1),
    pio.wait(1, EMERGENCY_PIN, 0),
    pio.set(PIN_DIRECTIONS, 0),
    pio.irq(4),
    pio.jmp(22),
  ],
  hasFilter: false,
  end: [[INSTR, pio.jmp(18)], ...new Array(12).fill(null), [IRQ, FLAG]],
};

/** The monitor without its filter. */
export const WITHOUT_FILTER = { ...MONITOR, words: [0] };

/** A monitor in a PIO block, and the processor's part of a stop: a tick every 200 µs. */
class Bench {
  constructor({ program, wrap, words, hasFilter, end }) {
    const gpio = Array.from({ length: 30 }, () => ({ inputValue: false, checkForUpdates() {} }));
    const dma = { setDREQ() {}, clearDREQ() {} };
    this.clock = new VirtualClock();
    this.engine = new Engine({ gpio, gpioValues: 0, dma, setInterrupt() {} }, this.clock);
    [this.block] = this.engine.blocks;
    this.gpio = gpio;
    this.hasFilter = hasFilter;
    this.end = end;
    this.pending = null;
    this.tick = TICK;
    this.isOpen = false;
    this.write(PINCTRL, (EMERGENCY << 15) | (1 << 26) | (32 << 20) | (ENABLE << 5));
    this.write(SHIFTCTRL, 1 << 19);
    this.write(INSTR, pio.mov(OSR, INVERTED | NULL));
    this.write(INSTR, pio.out(PIN_DIRECTIONS, 32));
    this.write(EXECCTRL, (EMERGENCY << 24) | (wrap[1] << 12) | (wrap[0] << 7));
    program.forEach((instruction, i) => this.write(PROGRAM + 4 * (ORIGIN + i), instruction));
    words.forEach((word) => this.write(TXF, word));
    this.write(INSTR, pio.jmp(ORIGIN));
    this.write(CTRL, 1 << MACHINE);
  }

  get now() {
    return this.clock.now;
  }

  write(register, value) {
    this.block.writeUint32Atomic(register, value, 0);
  }

  /** Whether the pulses are stopped. */
  get isStopped() {
    return (this.block.readUint32(IRQ) & FLAG) !== 0;
  }

  /** Whether the drivers have current. */
  get isEnabled() {
    return ((this.block.pinDirections >>> ENABLE) & 1) === 1;
  }

  /** Opens or closes the input. */
  set(isOpen) {
    this.engine.catchUp();
    this.isOpen = isOpen;
    this.gpio[EMERGENCY].inputValue = isOpen;
    this.engine.inputChanged();
  }

  /** Runs until `cycle`, with the ticks before it. */
  runTo(cycle) {
    while (this.tick <= cycle) {
      this.advance(this.tick);
      this.tick += TICK;
      this.beginEnd();
    }
    this.advance(cycle);
  }

  /** Begins the end of a stop, if the input is closed. Its writes come with the cycles after it. */
  beginEnd() {
    if (!this.isStopped || this.isOpen || this.pending) return;
    this.pending = this.end.map((write, i) => [this.now + LOOK + i, write]).filter(([, w]) => w);
  }

  advance(cycle) {
    while (this.pending?.length && this.pending[0][0] <= cycle) {
      const [at, [register, value]] = this.pending.shift();
      this.clock.now = at;
      this.write(register, value);
    }
    if (this.pending?.length === 0) this.pending = null;
    this.clock.now = cycle;
    this.engine.catchUp();
  }
}

/** Returns a random number of cycles from `least` to `most`, evenly in its logarithm. */
function cycles(next, least, most) {
  return Math.floor(least * Math.exp((next() / 2 ** 32) * Math.log((most + 1) / least)));
}

/** Opens and closes the input in turn, `count` times; each opening takes `most` cycles at most. */
function bounce(bench, next, count, most) {
  for (let i = 0; i < count; i++) {
    bench.set(true);
    bench.runTo(bench.now + cycles(next, 1, most));
    bench.set(false);
    // The input is sampled every two cycles.
    bench.runTo(bench.now + cycles(next, 3, 4 * FILTER));
  }
}

/**
 * Bounces around the tick that ends a stop, where the processor has found the input closed.
 */
function bounceAtTick(bench, next) {
  bench.set(false);
  bench.runTo(bench.tick + (next() % 40));
  bounce(bench, next, 1 + (next() % 3), 2 * FILTER);
}

/** Presses the button once; adds what was wrong to `wrong`. */
function press(bench, next, wrong) {
  const check = (isRight, text) => isRight || wrong.add(text);
  if (bench.hasFilter) bounce(bench, next, next() % 8, FILTER - 1);
  check(!bench.isStopped && bench.isEnabled, 'a short opening stops');
  bounce(bench, next, next() % 8, 8 * FILTER);
  bench.set(true);
  bench.runTo(bench.now + REACTION);
  check(bench.isStopped, 'a press is missed');
  check(!bench.isEnabled, 'a press leaves the drivers on');
  bench.runTo(bench.now + cycles(next, 1, 2 * TICK));
  if (next() % 2) bounce(bench, next, next() % 8, 8 * FILTER);
  else bounceAtTick(bench, next);
  bench.set(false);
  bench.runTo(bench.now + 2 * TICK);
  check(!bench.isStopped && bench.isEnabled, 'a stop does not end');
}

/**
 * Presses `count` times, twice with each seed: what the first press has lost shows in the second.
 * Returns what was wrong, with the first seed of each.
 */
export function campaign(monitor, count, firstSeed = 1) {
  const found = {};
  for (let seed = firstSeed; seed < firstSeed + count / 2; seed++) {
    const next = random(Math.imul(seed, 0x9e3779b1) || 1);
    const bench = new Bench(monitor);
    const wrong = new Set();
    press(bench, next, wrong);
    press(bench, next, wrong);
    for (const text of wrong) found[text] ??= seed;
  }
  return found;
}

// Shared parts of the tests: small images in Thumb, PIO instructions, registers by their names in
// the datasheet.
import { checksum } from '../src/boot2.mjs';
import { Chip } from '../src/chip.mjs';

export const US = 1000;
export const MS = 1e6;

const CODE = 0x200;
const FLASH = 0x10000000;
export const STACK = 0x20042000;
/**
 * A second boot stage that only goes on to the image, with its table of vectors: `ldr r0, image;
 * ldr r1, VTOR; str r0, [r1]; ldm r0!, {r0, r1}; msr msp, r0; bx r1`, and the two addresses.
 */
const BOOT_TWO = [
  0x4803, 0x4904, 0x6008, 0xc803, 0xf380, 0x8808, 0x4708, 0xbf00, 0x0100, 0x1000, 0xed08, 0xe000,
];

/**
 * A program for the processor: each method appends an instruction. Registers are numbers below 8,
 * unless documented.
 */
export class Program {
  constructor() {
    this.halves = [];
    this.labels = new Map();
    this.jumps = [];
    this.literals = [];
    this.vectors = new Map();
  }

  raw(...halves) {
    this.halves.push(...halves);
    return this;
  }

  label(name) {
    this.labels.set(name, this.halves.length);
    return this;
  }

  /** Starts the handler of an exception. */
  handler(exception) {
    this.vectors.set(exception, this.halves.length);
    return this;
  }

  /** Loads a 32-bit constant. */
  load(register, value) {
    this.literals.push({ at: this.halves.length, value: value >>> 0 });
    return this.raw(0x4800 | (register << 8));
  }

  jump(label, condition = null) {
    this.jumps.push({ at: this.halves.length, label, condition });
    return this.raw(0);
  }

  str(register, base, offset = 0) {
    return this.raw(0x6000 | ((offset >> 2) << 6) | (base << 3) | register);
  }

  ldr(register, base, offset = 0) {
    return this.raw(0x6800 | ((offset >> 2) << 6) | (base << 3) | register);
  }

  /** Writes a word to an address; uses r0 and r1. */
  set(address, value) {
    return this.load(0, value).load(1, address).str(0, 1);
  }

  sleep() {
    return this.label(`sleep${this.halves.length}`)
      .raw(0xbf30)
      .jump(`sleep${this.halves.length - 1}`);
  }

  /** Returns the image, with a second boot stage that the boot ROM accepts. */
  build() {
    const { halves } = this;
    if (halves.length % 2) halves.push(0xbf00);
    for (const { at, value } of this.literals) {
      const offset = (halves.length - ((at + 2) & ~1)) >> 1;
      halves[at] |= offset;
      halves.push(value & 0xffff, value >>> 16);
    }
    for (const { at, label, condition } of this.jumps) {
      const distance = this.labels.get(label) - at - 2;
      halves[at] =
        condition === null
          ? 0xe000 | (distance & 0x7ff)
          : 0xd000 | (condition << 8) | (distance & 0xff);
    }
    const image = Buffer.alloc(CODE + 2 * halves.length);
    BOOT_TWO.forEach((half, i) => image.writeUInt16LE(half, 2 * i));
    halves.forEach((half, i) => image.writeUInt16LE(half, CODE + 2 * i));
    image.writeUInt32LE(checksum(image.subarray(0, 252)), 252);
    image.writeUInt32LE(STACK, 0x100);
    image.writeUInt32LE(FLASH + CODE + 1, 0x104);
    for (const [exception, at] of this.vectors)
      image.writeUInt32LE(FLASH + CODE + 2 * at + 1, 0x100 + 4 * exception);
    return image;
  }

  chip() {
    return new Chip({ image: this.build() });
  }
}

/** Returns a chip whose processor sleeps forever; tests use its bus from outside. */
export const sleepingChip = () => {
  const chip = new Program().sleep().chip();
  chip.runFor(US);
  return chip;
};

export const PIO0 = 0x50200000;
export const SM0 = PIO0 + 0xc8;
export const IO_BANK0 = 0x40014000;
export const PADS = 0x4001c000;
export const TIMER = 0x40054000;
export const WATCHDOG = 0x40058000;
export const DMA = 0x50000000;
export const UART0 = 0x40034000;
export const I2C0 = 0x40044000;
export const USB = 0x50110000;
export const DPRAM = 0x50100000;
export const SSI = 0x18000000;
export const SIO = 0xd0000000;
export const NVIC_ISER = 0xe000e100;

/** Cycles of the images' second boot stage. */
export const BOOT_TWO_CYCLES = 2 + 2 + 2 + 3 + 3 + 2;

/** PIO instructions; `options` are `side` (with `sideBits`) and `delay`. */
export const pio = {
  with: (op, { delay = 0, side = 0, sideBits = 0 } = {}) =>
    op | (((side << (5 - sideBits)) | delay) << 8),
  jmp: (to, condition = 0) => (condition << 5) | to,
  set: (destination, value) => 0xe000 | (destination << 5) | value,
  pull: 0x80a0,
  out: (destination, bits) => 0x6000 | (destination << 5) | (bits & 31),
  mov: (destination, source) => 0xa000 | (destination << 5) | source,
  wait: (polarity, source, index) => 0x2000 | (polarity << 7) | (source << 5) | index,
  irq: (index) => 0xc000 | index,
  irqWait: (index) => 0xc020 | index,
  in: (source, bits) => 0x4000 | (source << 5) | (bits & 31),
};
export const PINS = 0;
export const X = 1;
export const Y = 2;

/** Loads a PIO program at address 0, and makes pins outputs of PIO0. */
export function loadPio(chip, program, pins = []) {
  program.forEach((op, i) => chip.bus.write32(PIO0 + 0x48 + 4 * i, op));
  for (const pin of pins) {
    chip.bus.write32(IO_BANK0 + 8 * pin + 4, 6);
    chip.bus.write32(SM0 + 0x14, (1 << 26) | (pin << 5));
    chip.bus.write32(SM0 + 0x10, pio.set(4, 1));
  }
}

/** Sets the registers of a machine. */
export function configure(
  chip,
  machine,
  { clkdiv = 1 << 16, wrap = [0, 31], exec = 0, shift = 3 << 18, pinctrl = 0 },
) {
  const base = SM0 + 0x18 * machine;
  chip.bus.write32(base, clkdiv);
  chip.bus.write32(base + 4, exec | (wrap[1] << 12) | (wrap[0] << 7));
  chip.bus.write32(base + 8, shift);
  chip.bus.write32(base + 0x14, pinctrl);
}

/** Starts machines (bits) at address 0, with their clocks in phase. Returns the cycle. */
export function start(chip, machines = 1) {
  chip.bus.write32(PIO0, machines | (machines << 4) | (machines << 8));
  return chip.cycles;
}

/** Records the edges of a pin while the chip runs: [level, cycles since `from`]. */
export function record(chip, pin, from) {
  const edges = [];
  chip.watch(pin, (level, at) => edges.push([level, at - from()]));
  return edges;
}

/** Returns a random generator (xorshift) with a seed. */
export function random(seed) {
  let state = seed;
  return () => {
    state ^= state << 13;
    state ^= state >>> 17;
    state ^= state << 5;
    return state >>> 0;
  };
}

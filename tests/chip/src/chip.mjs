// An RP2040 with a Pico's flash, in lock step and virtual time: rp2040js 1.4.1 with the repairs in
// this folder. See ../README.md.
import { RP2040 } from 'rp2040js';
import { bootTwoIsValid } from './boot2.mjs';
import { installBootrom, USB_BOOT } from './bootrom.mjs';
import { CYCLE_NS, VirtualClock } from './clock.mjs';
import { Bus } from './core/bus.mjs';
import { Core } from './core/core.mjs';
import { EventHash } from './events.mjs';
import { Flash } from './flash.mjs';
import { loadImage } from './image.mjs';
import { Engine } from './pio/engine.mjs';
import { repairCache } from './repairs/cache.mjs';
import { repairDma } from './repairs/dma.mjs';
import { Pins } from './repairs/gpio.mjs';
import { I2cBus, repairI2c } from './repairs/i2c.mjs';
import { repairPpb } from './repairs/ppb.mjs';
import { repairPwm } from './repairs/pwm.mjs';
import { installRegisters } from './repairs/registers.mjs';
import { repairSsi } from './repairs/ssi.mjs';
import { repairTimer } from './repairs/timer.mjs';
import { Uart } from './repairs/uart.mjs';
import { UsbPort } from './repairs/usb.mjs';
import { REASON_FORCE, REASON_TIMER, Watchdog } from './repairs/watchdog.mjs';
import { UsbHost } from './usb-host.mjs';

export { CYCLE_NS, CYCLES_PER_US } from './clock.mjs';
export { Pca9685 } from './i2c-targets.mjs';
export { DriverWire } from './tmc2209.mjs';

const FLASH = 0x10000000;
const SRAM = 0x20000000;
const RESETS_USBCTRL = 1 << 24;
/** Address of the jump that `hang` writes: near the end of memory. */
const HANGING = 0x20041f00;
const WATCHDOG = 0x40058;
const PIOS = [0x50200, 0x50300];
const UARTS = [
  { address: 0x40034, irq: 20, tx: 20, rx: 21 },
  { address: 0x40038, irq: 21, tx: 22, rx: 23 },
];
const PINS = 30;
/** Kinds of events in the digest. */
const EVENT = { pin: 1, data: 2, state: 3, uart: 4, reset: 5 };
const STATES = ['attached', 'ready', 'lost', 'stalled'];
/** Causes of a reset. After a watchdog reset, the REASON register has its cause. */
const CAUSES = ['power', 'run', 'watchdog', 'forced', 'system', 'bootloader'];
const REASONS = { watchdog: REASON_TIMER, forced: REASON_FORCE };
/** The second stage, and where the boot ROM copies it: the end of memory. */
const BOOT_TWO_BYTES = 256;
const BOOT_TWO_PLACE = 0x42000 - BOOT_TWO_BYTES;
/** Delays of the boot ROM after a download, and of picotool, ms. */
const DELAYS = { uf2: 1000, picoboot: 500 };

const digest = (bytes) =>
  bytes.reduce((sum, byte) => (Math.imul(sum, 31) + byte) | 0, bytes.length);

export class Chip {
  /**
   * @param {{ image?: string | Uint8Array, flash?: Uint8Array, cache?: boolean }} options
   * `image`: an .elf or .uf2 file, or flash contents from 0x10000000 on; `flash`: contents saved
   * with `saveFlash`, under the image; `cache`: false for a flash that takes no time
   */
  constructor({ image, flash, cache = true } = {}) {
    this.hasCache = cache;
    this.flash = new Flash();
    if (flash) this.flash.bytes.set(flash);
    if (image !== undefined) loadImage(image, this.flash.bytes);
    this.hash = new EventHash();
    /** Called with (cause, cycle) after a reset; the causes are listed in the README. */
    this.onReset = () => {};
    /** Accesses that rp2040js does not implement: number by text. */
    this.warnings = new Map();
    /**
     * Cycles before the last reset, cycles slept before it, and end of the requested run in
     * nanoseconds and cycles.
     */
    this.origin = 0;
    this.sleptBefore = 0;
    this.asked = 0;
    this.deadline = 0;
    this.resets = 0;
    this.watchers = Array.from({ length: PINS }, () => []);
    this.pins = new Pins(
      (pin, level, at) => this.edge(pin, level, at),
      () => this.eventCycle,
    );
    this.i2c = [0, 1].map(() => ({ targets: new Map(), isHeld: false }));
    this.usb = new UsbHost({
      data: (bytes) => this.hash.add(EVENT.data, this.cycles, digest(bytes)),
      state: (name) => this.hash.add(EVENT.state, this.cycles, STATES.indexOf(name)),
    });
    /** The other end of UART0's line. */
    this.uart0 = { onByte: () => {}, feed: (bytes) => this.uarts[0].feed(bytes) };
    /** The other end of UART1's line. */
    this.uart1 = { onByte: () => {} };
    this.boot('power');
  }

  // --- time ---

  /** Cycles since the start, over all resets. */
  get cycles() {
    return this.origin + this.clock.now;
  }

  get nanos() {
    return this.cycles * CYCLE_NS;
  }

  /**
   * Cycle of the current event. An edge by PIO may be within a longer instruction of the processor.
   */
  get eventCycle() {
    return this.origin + (this.engine?.advancing ? this.engine.now : this.clock.now);
  }

  /** Cycles in which the processor slept, over all resets. */
  get sleepCycles() {
    return this.sleptBefore + this.slept;
  }

  /**
   * Runs for `nanos` nanoseconds, including the events of the last cycle. The last instruction is
   * completed, so that the chip may be some cycles ahead; the next call is shorter by them.
   */
  runFor(nanos) {
    this.asked += nanos;
    this.deadline = Math.ceil(this.asked / CYCLE_NS);
    while (this.cycles < this.deadline) {
      if (this.resetWanted !== null) this.boot(this.resetWanted);
      this.stretch();
    }
    this.clock.ring();
    if (this.resetWanted !== null) this.boot(this.resetWanted);
  }

  /**
   * Runs in steps of `step` nanoseconds until `done()`, for at most `limit` nanoseconds. Returns
   * whether it was done.
   */
  runUntil(done, limit, step = 10_000) {
    for (let spent = 0; !done(); spent += step) {
      if (spent >= limit) return false;
      this.runFor(step);
    }
    return true;
  }

  /** Runs or sleeps to the next event or the deadline, whichever is first. */
  stretch() {
    const { clock, core } = this;
    clock.limit = this.deadline - this.origin;
    clock.ring();
    if (this.resetWanted !== null) return;
    if (core.waiting && core.interruptsUpdated) core.wakeIfReady();
    if (!core.waiting) {
      core.run();
    } else if (clock.horizon > clock.now) {
      this.slept += clock.horizon - clock.now;
      clock.now = clock.horizon;
    }
  }

  // --- resets ---

  /** Asks for a reset at the end of the present instruction. */
  requestReset(cause) {
    this.resetWanted ??= cause;
    this.clock.limit = this.clock.now;
    this.clock.horizon = this.clock.now;
  }

  /**
   * Resets now: 'power' (off and on again), 'bootsel' (the same with the button held: the chip
   * stays in its boot ROM), 'run' (the RUN pin: memory keeps its contents), 'system' (a debugger).
   */
  reset(cause = 'power') {
    this.boot(cause);
  }

  /**
   * Ends a download to the boot ROM, by its drive ('uf2') or PICOBOOT ('picoboot'): the ROM has the
   * watchdog reset the chip. `image` is put into flash before, if there is one.
   */
  finishDownload(way, image) {
    if (!this.inBootloader) throw new Error('the chip is not in its boot ROM');
    if (image !== undefined) loadImage(image, this.flash.bytes);
    this.watchdog.reboot(0, DELAYS[way]);
  }

  /**
   * Boots after a reset. Registers survive it as on the chip: RESETS that of the processor alone,
   * the watchdog's all but power and RUN, memory all but power.
   */
  boot(wanted) {
    let cause = wanted === 'bootsel' ? 'power' : wanted;
    const before = this.clock
      ? { sram: this.mcu.sram, watchdog: this.watchdog, resets: this.resetsHeld }
      : null;
    if (before) this.leave(cause);
    this.resetWanted = null;
    this.slept = 0;
    this.clock = new VirtualClock();
    this.mcu = new RP2040(this.clock);
    this.mcu.logger = this.logger();
    this.mcu.flash.set(this.flash.bytes);
    if (before && cause !== 'power') this.mcu.sram.set(before.sram);
    if (cause === 'power' || cause === 'run') this.chipReset = cause;
    this.build(cause === 'system' ? before.resets : undefined);
    if (before && cause !== 'power' && cause !== 'run') {
      const { reason, scratch } = before.watchdog;
      Object.assign(this.watchdog, { reason: REASONS[cause] ?? reason, scratch });
    }
    if (this.watchdog.takeVector() === USB_BOOT) cause = 'bootloader';
    const staysInRom = cause === 'bootloader' || wanted === 'bootsel';
    this.pins.connect(this.mcu);
    this.usb.attach(this.port, this.clock);
    this.start(staysInRom);
    if (!before) return;
    this.resets++;
    this.hash.add(EVENT.reset, this.cycles, CAUSES.indexOf(cause));
    this.onReset(cause, this.cycles);
  }

  /** Adds the counters of the chip before its reset to the totals. */
  leave(cause) {
    this.flash.interrupt(this.cycles, cause === 'power');
    this.sleptBefore += this.slept;
    this.origin += this.clock.now;
  }

  /** Installs the repairs and connects them. */
  build(resetsHeld) {
    const { mcu, clock } = this;
    /** Whether the boot ROM is about to reset the chip. */
    this.isLeaving = false;
    this.bus = new Bus(mcu);
    this.core = new Core(this.bus, clock);
    mcu.core = this.core;
    repairPpb(mcu, this.core, (cause) => this.requestReset(cause));
    repairTimer(mcu, clock);
    repairDma(mcu, clock, this.bus);
    repairPwm(mcu);
    this.resetsHeld = installRegisters(mcu, this.chipReset, resetsHeld, (bits) => {
      if (bits & RESETS_USBCTRL) this.port.reset();
    });
    repairCache(mcu, this.bus.cache);
    repairSsi(mcu, this.bus, this.hasCache, this.flash.id);
    this.watchdog = new Watchdog(clock, (reason) =>
      this.requestReset(reason === REASON_FORCE ? 'forced' : 'watchdog'),
    );
    mcu.peripherals[WATCHDOG] = this.watchdog;
    this.engine = new Engine(mcu, clock);
    mcu.pio = this.engine.blocks;
    PIOS.forEach((address, i) => (mcu.peripherals[address] = this.engine.blocks[i]));
    this.uarts = UARTS.map((lines) => new Uart(mcu, clock, lines));
    mcu.uart = this.uarts;
    UARTS.forEach(({ address }, i) => (mcu.peripherals[address] = this.uarts[i]));
    this.uarts[0].onByte = (byte) => {
      this.hash.add(EVENT.uart, this.cycles, byte);
      this.uart0.onByte(byte);
    };
    this.uarts[1].onByte = (byte) => this.uart1.onByte(byte);
    mcu.i2c.forEach((controller, i) => {
      repairI2c(controller);
      this.i2c[i].bus = new I2cBus(controller, clock, this.i2c[i]);
    });
    this.port = new UsbPort(mcu);
    installBootrom(this);
  }

  /** Has a target hold the clock of an I2C bus low, or let it go. */
  holdI2c(bus, isHeld) {
    this.i2c[bus].isHeld = isHeld;
    if (!isHeld) this.i2c[bus].bus.release();
  }

  /**
   * Starts the image's second stage as the boot ROM does, from memory. Stays in the ROM on request,
   * or if the image is invalid.
   */
  start(staysInRom) {
    this.inBootloader = staysInRom || !bootTwoIsValid(this.flash.bytes);
    if (this.inBootloader) {
      this.core.lockedUp = true;
      this.core.waiting = true;
    } else {
      this.mcu.sram.set(this.flash.bytes.subarray(0, BOOT_TWO_BYTES), BOOT_TWO_PLACE);
      this.core.start(SRAM + BOOT_TWO_PLACE);
    }
  }

  logger() {
    const note = (part, text) => {
      const warning = `${part}: ${text}`;
      this.warnings.set(warning, (this.warnings.get(warning) ?? 0) + 1);
    };
    return { debug() {}, info() {}, warn: note, error: note };
  }

  // --- pins, memory, flash ---

  edge(pin, level, at) {
    this.hash.add(EVENT.pin, at, (pin << 1) | level);
    for (const watcher of this.watchers[pin]) watcher(level, at, pin);
    this.engine?.inputChanged();
  }

  /**
   * Calls back with (level, cycle, pin) at every edge of a pin, over all resets. Returns a function
   * that ends it.
   */
  watch(pin, callback) {
    this.watchers[pin].push(callback);
    return () =>
      (this.watchers[pin] = this.watchers[pin].filter((watcher) => watcher !== callback));
  }

  /**
   * Drives a pin from outside to 0 or 1, or releases it (null): the chip's pull then sets the
   * level.
   */
  drive(pin, level) {
    this.pins.drive(pin, level);
  }

  /** Returns the level of a pin. */
  level(pin) {
    return this.pins.levels[pin];
  }

  /** Returns bytes of memory or flash, also those that the processor cannot read at the moment. */
  peek(address, length) {
    const { bus, mcu } = this;
    if (address >= FLASH && address < FLASH + mcu.flash.length)
      return mcu.flash.slice(address - FLASH, address - FLASH + length);
    return Uint8Array.from({ length }, (_, i) => bus.read8(address + i));
  }

  peek32(address) {
    return new DataView(this.peek(address, 4).buffer).getUint32(0, true);
  }

  /** Writes memory from outside, such as a fill pattern of the stack. */
  poke(address, bytes) {
    this.mcu.sram.set(bytes, address - SRAM);
    this.bus.sramChanged();
  }

  /** Hangs the processor in an endless loop with interrupts off. */
  hang() {
    this.poke(HANGING, [0xfe, 0xe7]);
    this.core.setPrimask(1);
    this.core.waiting = false;
    this.core.pc = HANGING;
  }

  /** Calls the function at `address` with up to four words as its arguments. */
  call(address, words) {
    words.forEach((word, register) => (this.core.r[register] = word));
    this.core.waiting = false;
    this.core.pc = address & ~1;
  }

  /** Returns the contents of the flash chip, for another `Chip`. */
  saveFlash() {
    return this.flash.bytes.slice();
  }

  /** Returns counters for measurements: cycles, cycles slept, instructions since the last reset. */
  get load() {
    const { cycles, sleepCycles } = this;
    return {
      cycles,
      sleepCycles,
      idle: cycles ? sleepCycles / cycles : 0,
      instructions: this.core.instructions,
    };
  }
}

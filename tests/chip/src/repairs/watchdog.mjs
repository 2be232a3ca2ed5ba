// The watchdog: it counts down twice per microsecond (errata RP2040-E1), and resets the chip at 0.
//
// Defects of rp2040js 1.4.1: the periodic alarm fires again at once when the count has reached 0,
// in an endless loop; a write that triggers a reset also changes the other settings in the
// register; LOAD has no effect while the watchdog is disabled. The reason and the scratch registers
// survive every reset but power-on and RUN (datasheet 4.7.1, 4.7.4): the chip passes them on.
import { CYCLES_PER_US } from '../clock.mjs';

const CTRL = 0x00;
const LOAD = 0x04;
const REASON = 0x08;
const SCRATCH0 = 0x0c;
const SCRATCH7 = 0x28;
const TICK = 0x2c;
const TRIGGER = 1 << 31;
const ENABLE = 1 << 30;
const COUNT = 0xffffff;
const PAUSES = 7 << 24;
const TICK_ENABLE = 1 << 9;
const TICK_RUNNING = 1 << 10;
const COUNTS_PER_US = 2;
/** Magic number in scratch 4: the boot ROM jumps to the address in scratch 7 (2.8.1.1). */
const VECTOR = 0xb007c0d3;
export const REASON_TIMER = 1;
export const REASON_FORCE = 2;

export class Watchdog {
  /**
   * @param {import('../clock.mjs').VirtualClock} clock
   * @param {(reason: number) => void} bite requests a reset
   */
  constructor(clock, bite) {
    this.clock = clock;
    this.bite = bite;
    this.reason = 0;
    this.scratch = new Uint32Array(8);
    this.enabled = false;
    this.pauses = PAUSES;
    this.tick = TICK_ENABLE;
    /** The count at the cycle `since`. */
    this.count = 0;
    this.since = 0;
    this.alarm = clock.createAlarm(() => bite(REASON_TIMER));
  }

  get running() {
    return this.enabled && (this.tick & TICK_ENABLE) !== 0;
  }

  get counter() {
    if (!this.running) return this.count;
    const gone = Math.floor(((this.clock.now - this.since) * COUNTS_PER_US) / CYCLES_PER_US);
    return Math.max(0, this.count - gone);
  }

  /** Called after a change of the count or of the enable bit. */
  restart(count) {
    this.count = count;
    this.since = this.clock.now;
    if (this.running)
      this.alarm.scheduleAt(this.since + Math.ceil((count * CYCLES_PER_US) / COUNTS_PER_US));
    else this.alarm.cancel();
  }

  /**
   * Has the watchdog reset the chip, as `watchdog_reboot` of the boot ROM does: with the address
   * for the ROM to jump to after the reset, or 0 to start the image. The ROM's delay ends at half
   * its time, since it does not regard that the count is decremented twice.
   */
  reboot(vector, milliseconds) {
    this.enabled = false;
    this.scratch[4] = vector ? VECTOR : 0;
    if (vector) {
      this.scratch[5] = vector ^ -VECTOR;
      this.scratch[7] = vector;
    }
    this.tick = TICK_ENABLE;
    this.enabled = true;
    this.restart(milliseconds * 1000);
  }

  /** Returns the address that the ROM jumps to after a reset, once; 0 if there is none. */
  takeVector() {
    const [magic, check, , vector] = this.scratch.subarray(4);
    if (magic !== VECTOR || (((check ^ vector) + magic) | 0) !== 0) return 0;
    this.scratch[4] = 0;
    return vector;
  }

  readUint32(offset) {
    if (offset === CTRL) return ((this.enabled ? ENABLE : 0) | this.pauses | this.counter) >>> 0;
    if (offset === REASON) return this.reason;
    if (offset >= SCRATCH0 && offset <= SCRATCH7) return this.scratch[(offset - SCRATCH0) >> 2];
    return offset === TICK ? this.tick | (this.tick & TICK_ENABLE ? TICK_RUNNING : 0) : 0;
  }

  writeUint32Atomic(offset, value, alias) {
    const old = alias === 0 ? 0 : this.readUint32(offset);
    this.write(offset, [value, old ^ value, old | value, old & ~value][alias] >>> 0);
  }

  write(offset, value) {
    if (offset === CTRL) {
      const count = this.counter;
      this.enabled = (value & ENABLE) !== 0;
      this.pauses = value & PAUSES;
      this.restart(count);
      if (value & TRIGGER) this.bite(REASON_FORCE);
    } else if (offset === LOAD) {
      this.restart(value & COUNT);
    } else if (offset >= SCRATCH0 && offset <= SCRATCH7) {
      this.scratch[(offset - SCRATCH0) >> 2] = value;
    } else if (offset === TICK) {
      const count = this.counter;
      this.tick = value & 0x3ff;
      this.restart(count);
    }
  }
}

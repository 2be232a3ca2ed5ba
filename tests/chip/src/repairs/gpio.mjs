// Pins: what is on the pad, and who sees it.
//
// What is wrong in rp2040js 1.4.1: an input reads what was last set from outside, whatever the pad does. On the chip it reads the
// pad (datasheet 2.19.1): what the chip itself drives, else what the world drives, else the pull-up or -down. Its edge interrupts are also
// recorded without an edge: any refresh of an input counts as one. After a reset its pads have their input disabled; the chip's are
// enabled, with a pull-down (2.19.6.3, reset value 0x56).

const PINS = 30;
const PAD_RESET = 0x56;
const EDGE_LOW = 1 << 2;
const EDGE_HIGH = 1 << 3;
const LEVELS = 3;

/** The pins, seen from outside. */
export class Pins {
  /**
   * @param {(pin: number, level: number, at: number) => void} changed called with every edge
   * @param {() => number} at the cycle of what is happening
   */
  constructor(changed, at) {
    this.changed = changed;
    this.at = at;
    this.driven = new Array(PINS).fill(null);
    this.levels = new Uint8Array(PINS);
    this.mcu = null;
  }

  /** Goes over to a chip that has just been reset: what it drove, it drives no more. */
  connect(mcu) {
    this.mcu = mcu;
    mcu.gpio.forEach((pin, index) => this.attach(pin, index));
    for (let index = 0; index < PINS; index++) this.settle(index);
  }

  attach(pin, index) {
    pin.padValue = PAD_RESET;
    pin.checkForUpdates = () => this.settle(index);
    // What rp2040js calls when a pad's settings have changed.
    pin.refreshInput = () => this.present(index);
    this.present(index);
  }

  /** A pad's level: driven by the chip, by the world, by its pull; a floating pad reads 0, one with both pulls keeps its level. */
  resolve(index) {
    const pin = this.mcu.gpio[index];
    if (pin.outputEnable && !pin.outputDisable) return pin.outputValue ? 1 : 0;
    if (this.driven[index] !== null) return this.driven[index];
    if (pin.pullupEnabled && pin.pulldownEnabled) return this.levels[index];
    return pin.pullupEnabled ? 1 : 0;
  }

  settle(index) {
    const level = this.resolve(index);
    if (level === this.levels[index]) return;
    this.levels[index] = level;
    this.present(index);
    this.changed(index, level, this.at());
  }

  /** Lets the chip see a pad's level: input value, interrupts, PWM counters. */
  present(index) {
    const pin = this.mcu.gpio[index];
    const before = pin.inputValue;
    const latched = pin.irqStatus & (EDGE_LOW | EDGE_HIGH);
    pin.rawInputValue = this.levels[index] === 1;
    const edge = pin.inputValue === before ? 0 : pin.inputValue ? EDGE_HIGH : EDGE_LOW;
    pin.irqStatus = latched | edge | (pin.inputValue ? 2 : 1) & LEVELS;
    if (pin.irqEnableMask) this.mcu.updateIOInterrupt();
    if (edge && pin.functionSelect === 4) this.mcu.pwm.gpioOnInput(index);
  }

  /** The world puts a level on a pin (0 or 1), or lets go of it (null). */
  drive(index, level) {
    this.driven[index] = level;
    this.settle(index);
  }
}

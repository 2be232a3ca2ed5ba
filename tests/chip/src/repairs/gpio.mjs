// Pins: the level of the pad, and its observers.
//
// Defects of rp2040js 1.4.1: an input reads the level that was last set from outside. On the chip
// it reads the pad (datasheet 2.19.1): the chip's own output, else the outside level, else the
// pull. Any refresh of an input counts as an edge for the interrupts. After a reset the pads have
// their input disabled; on the chip it is enabled, with a pull-down (2.19.6.3, reset value 0x56).

const PINS = 30;
const PAD_RESET = 0x56;
const EDGE_LOW = 1 << 2;
const EDGE_HIGH = 1 << 3;
const LEVELS = 3;

/** The pins, from outside. */
export class Pins {
  /**
   * @param {(pin: number, level: number, at: number) => void} changed called with every edge
   * @param {() => number} at returns the cycle of the current event
   */
  constructor(changed, at) {
    this.changed = changed;
    this.at = at;
    this.driven = new Array(PINS).fill(null);
    this.levels = new Uint8Array(PINS);
    this.mcu = null;
  }

  /** Connects to a chip after its reset: it drives no pin. */
  connect(mcu) {
    this.mcu = mcu;
    mcu.gpio.forEach((pin, index) => this.attach(pin, index));
    for (let index = 0; index < PINS; index++) this.settle(index);
  }

  attach(pin, index) {
    pin.padValue = PAD_RESET;
    pin.checkForUpdates = () => this.settle(index);
    // rp2040js calls this after a change of a pad's settings.
    pin.refreshInput = () => this.present(index);
    this.present(index);
  }

  /**
   * Returns a pad's level: the chip's output, the outside level, or the pull. A floating pad reads
   * 0, one with both pulls keeps its level.
   */
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

  /** Passes a pad's level to the chip: input value, interrupts, PWM counters. */
  present(index) {
    const pin = this.mcu.gpio[index];
    const before = pin.inputValue;
    const latched = pin.irqStatus & (EDGE_LOW | EDGE_HIGH);
    pin.rawInputValue = this.levels[index] === 1;
    const edge = pin.inputValue === before ? 0 : pin.inputValue ? EDGE_HIGH : EDGE_LOW;
    pin.irqStatus = latched | edge | ((pin.inputValue ? 2 : 1) & LEVELS);
    if (pin.irqEnableMask) this.mcu.updateIOInterrupt();
    if (edge && pin.functionSelect === 4) this.mcu.pwm.gpioOnInput(index);
  }

  /** Drives a pin from outside (0 or 1), or releases it (null). */
  drive(index, level) {
    this.driven[index] = level;
    this.settle(index);
  }
}

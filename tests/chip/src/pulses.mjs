// Position and shortest times, in cycles, from the edges on a stepper driver's STEP and DIR inputs.

export class Pulses {
  /** Counts each rising edge of `step` up if `direction` (not `inverted`) is high, else down. */
  constructor(chip, [step, direction, inverted = false]) {
    this.position = 0;
    this.rise = -Infinity;
    this.fall = -Infinity;
    this.turn = -Infinity;
    this.forget();
    chip.watch(step, (level, cycle) => {
      if (level) this.rises(cycle, (chip.level(direction) === 1) !== inverted ? 1 : -1);
      else this.falls(cycle);
    });
    chip.watch(direction, (_, cycle) => {
      this.turn = cycle;
      this.hold = Math.min(this.hold, cycle - this.rise);
    });
  }

  rises(cycle, by) {
    this.position += by;
    this.count++;
    this.low = Math.min(this.low, cycle - this.fall);
    this.setup = Math.min(this.setup, cycle - this.turn);
    this.rise = cycle;
  }

  falls(cycle) {
    this.high = Math.min(this.high, cycle - this.rise);
    this.fall = cycle;
  }

  forget() {
    this.count = 0;
    for (const time of ['high', 'low', 'setup', 'hold']) this[time] = Infinity;
  }

  /**
   * Returns, since the last call: the number of pulses; the minimum times high, low, from a change
   * of direction to a pulse (`setup`)
   * and from a pulse to a change (`hold`), null if there was none; and the cycle at which the last
   * pulse started.
   */
  take() {
    const { count, high, low, setup, hold, rise } = this;
    this.forget();
    const or = (value) => (Number.isFinite(value) ? value : null);
    return {
      count,
      high: or(high),
      low: or(low),
      setup: or(setup),
      hold: or(hold),
      last: or(rise),
    };
  }
}

// Virtual time: whole cycles of a 125 MHz clk_sys since the chip's last reset.
//
// rp2040js' SimulationClock counts nanoseconds as a sum of floats and walks a list for every
// instruction. This clock has the interface that rp2040js' peripherals use (`nanos`, `micros`,
// `createAlarm`). It counts integers, so that the cycle of an event is exact, and has a horizon:
// until then the processor runs without a check for events.

/** Nanoseconds in one cycle of clk_sys at 125 MHz. */
export const CYCLE_NS = 8;
/** Cycles in one microsecond. */
export const CYCLES_PER_US = 1000 / CYCLE_NS;

/** A callback at a cycle. */
class Alarm {
  constructor(clock, callback) {
    this.clock = clock;
    this.callback = callback;
    this.at = 0;
    this.next = null;
    this.scheduled = false;
  }

  /**
   * Schedules the callback after `nanos` nanoseconds, rounded up to a whole cycle. Replaces an
   * earlier schedule.
   */
  schedule(nanos) {
    this.scheduleAt(this.clock.now + Math.ceil(nanos / CYCLE_NS));
  }

  /** Schedules the callback at a cycle of this clock; at once if it is past. */
  scheduleAt(cycle) {
    if (this.scheduled) this.clock.unlink(this);
    this.at = cycle;
    this.clock.link(this);
  }

  cancel() {
    if (this.scheduled) this.clock.unlink(this);
  }
}

export class VirtualClock {
  constructor() {
    /** Cycles since the reset. */
    this.now = 0;
    /** End of the current run, if no event is before it. */
    this.limit = 0;
    /** Cycle of the next event that the processor does not cause. */
    this.horizon = 0;
    this.first = null;
  }

  get nanos() {
    return this.now * CYCLE_NS;
  }

  get micros() {
    return this.now / CYCLES_PER_US;
  }

  createAlarm(callback) {
    return new Alarm(this, callback);
  }

  /** Inserts an alarm. Alarms of the same cycle run in the order of scheduling. */
  link(alarm) {
    let before = null;
    let after = this.first;
    while (after !== null && after.at <= alarm.at) {
      before = after;
      after = after.next;
    }
    alarm.next = after;
    alarm.scheduled = true;
    if (before === null) this.first = alarm;
    else before.next = alarm;
    if (alarm.at < this.horizon) this.horizon = alarm.at;
  }

  unlink(alarm) {
    if (this.first === alarm) {
      this.first = alarm.next;
    } else {
      let before = this.first;
      while (before.next !== alarm) before = before.next;
      before.next = alarm.next;
    }
    alarm.next = null;
    alarm.scheduled = false;
  }

  /**
   * Runs the alarms that are due. An alarm that is late by part of an instruction has the current
   * cycle as `now`.
   */
  ring() {
    while (this.first !== null && this.first.at <= this.now) {
      const alarm = this.first;
      this.first = alarm.next;
      alarm.next = null;
      alarm.scheduled = false;
      alarm.callback();
    }
    this.horizon = this.first !== null && this.first.at < this.limit ? this.first.at : this.limit;
  }
}

// Virtual time: whole cycles of a 125 MHz clk_sys, counted from the chip's last reset.
//
// rp2040js' own SimulationClock counts nanoseconds as a sum of floats and walks a list for every instruction. This one
// has the interface rp2040js' peripherals use (`nanos`, `micros`, `createAlarm`), counts integers, so that an event's
// cycle is exact, and knows its horizon: until then the processor may run without looking for events.

/** Nanoseconds in one cycle of clk_sys at 125 MHz. */
export const CYCLE_NS = 8;
/** Cycles in one microsecond. */
export const CYCLES_PER_US = 1000 / CYCLE_NS;

/** A call that is to be made at a cycle. */
class Alarm {
  constructor(clock, callback) {
    this.clock = clock;
    this.callback = callback;
    this.at = 0;
    this.next = null;
    this.scheduled = false;
  }

  /** Calls back after that many nanoseconds, rounded up to a whole cycle; instead of what was scheduled before. */
  schedule(nanos) {
    this.scheduleAt(this.clock.now + Math.ceil(nanos / CYCLE_NS));
  }

  /** Calls back at that cycle of this clock; at once where it has passed. */
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
    /** Where the present run ends, if nothing else happens before. */
    this.limit = 0;
    /** The next cycle at which something happens that is not the processor's doing. */
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

  /** Puts an alarm into the list; alarms of the same cycle ring in the order in which they were scheduled. */
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

  /** Rings what is due. An alarm that is late by part of an instruction still sees the present cycle as `now`. */
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

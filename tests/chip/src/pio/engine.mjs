// Both PIO blocks in lock step with the rest of the chip.
//
// Defects of rp2040js 1.4.1: its state machines run a thousand steps at a time from setTimeout,
// independent of the chip's time. Clock dividers, delays, FIFO joining, the phase of CLKDIV_RESTART
// and stalled instructions are missing or wrong. A word written to a FIFO restarts a program at the
// wrong place. Here every instruction has its cycle (datasheet 3.5.5: a divider of n + f/256 gives
// a tick every n or n + 1 cycles). Other machines see the effects of a cycle from the next one on.
// A machine that counts down in one instruction, or is stalled, takes no computing time.
import { Block } from './block.mjs';
import { SUBCYCLES } from './machine.mjs';

const PIO0_IRQ0 = 7;
const PIO1_IRQ0 = 9;

export class Engine {
  constructor(mcu, clock) {
    this.clock = clock;
    /** Cycle of the current instruction; at other times, the last cycle that was run. */
    this.now = 0;
    /** Whether `now` is the time of the events on the pins. */
    this.advancing = false;
    this.alarm = clock.createAlarm(() => {
      this.catchUp();
      this.plan();
    });
    this.blocks = [new Block(mcu, this, 0, PIO0_IRQ0), new Block(mcu, this, 1, PIO1_IRQ0)];
    this.machines = this.blocks.flatMap((block) => block.machines);
  }

  /** Runs everything up to the current cycle. */
  catchUp() {
    if (this.advancing) return;
    this.advancing = true;
    const until = this.clock.now * SUBCYCLES;
    for (let due = this.nextTick(until); due <= until; due = this.nextTick(until))
      this.cycle(Math.ceil(due / SUBCYCLES));
    this.now = this.clock.now;
    this.advancing = false;
  }

  /** Returns the time of the next instruction in subcycles; skips the waits before `until`. */
  nextTick(until) {
    let next = Infinity;
    for (const machine of this.machines) {
      if (!machine.active) continue;
      const period = machine.spin();
      if (period > 0) skip(machine, period, until);
      if (machine.time < next) next = machine.time;
    }
    return next;
  }

  /** Runs one cycle of all machines. */
  cycle(now) {
    this.now = now;
    for (const machine of this.machines) {
      if (machine.active && machine.time <= now * SUBCYCLES) machine.step();
    }
    for (const block of this.blocks) block.commit();
  }

  /** Sets the alarm to the next visible action of a machine. */
  plan() {
    if (this.advancing) return;
    let next = Infinity;
    for (const machine of this.machines) {
      if (!machine.active) continue;
      const period = machine.spin();
      const time = machine.time + (period > 0 ? period * machine[machine.counter] : 0);
      if (time < next) next = time;
    }
    if (next === Infinity) this.alarm.cancel();
    else this.alarm.scheduleAt(Math.ceil(next / SUBCYCLES));
  }

  /** Called at an edge of an input pin: stalled machines check again. */
  inputChanged() {
    if (!this.advancing) this.catchUp();
    let woken = false;
    for (const machine of this.machines) {
      if (!machine.waitsForInput) continue;
      machine.wake(this.now);
      woken = true;
    }
    if (woken) this.plan();
  }
}

/** Applies all count-downs of `machine` by `until` at once. */
function skip(machine, period, until) {
  const left = machine[machine.counter];
  const times = Math.min(left, Math.floor((until - machine.time) / period) + 1);
  if (times <= 0) return;
  machine[machine.counter] = left - times;
  machine.time += times * period;
}

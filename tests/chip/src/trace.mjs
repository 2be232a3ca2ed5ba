// How long functions and exception handlers take, to the cycle, from outside: every instruction is looked at before it is carried out.
// While this goes on nothing is translated, which makes the chip some times slower, and changes nothing in what it does.

export class Trace {
  /**
   * @param {import('./chip.mjs').Chip} chip up to its next reset
   * @param {Record<string, number>} functions by a name: the address of the first instruction
   * @param {Record<string, number>} handlers by a name: the number of the exception (16 + IRQ)
   */
  constructor(chip, functions, handlers) {
    this.chip = chip;
    this.core = chip.core;
    this.names = new Map(Object.entries(functions).map(([name, address]) => [address & ~1, name]));
    // One that is under way already is not counted.
    this.handlers = Object.entries(handlers).map(([name, number]) => ({ name, number, began: null, left: this.core.IPSR !== number }));
    /** Functions that have not returned: { name, began, sp, back }. */
    this.open = [];
    this.forget();
    chip.bus.pieceAt = () => null;
    this.core.step = (bus) => {
      this.look();
      return Object.getPrototypeOf(this.core).step.call(this.core, bus);
    };
  }

  look() {
    const { core, chip, open } = this;
    this.charge();
    for (const handler of this.handlers) {
      if (core.IPSR !== handler.number) {
        handler.left = true;
        if (handler.began !== null) this.ends(handler);
      } else if (handler.left) handler.began ??= chip.cycles;
    }
    while (open.length > 0 && core.pc === open.at(-1).back && core.r[13] === open.at(-1).sp) this.ends(open.pop());
    const name = this.names.get(core.pc);
    if (name !== undefined) open.push({ name, began: chip.cycles, sp: core.r[13], back: core.r[14] & ~1 });
  }

  /** Charges what has passed since the last instruction began to that instruction, unless the processor slept. */
  charge() {
    const { core, chip } = this;
    const awake = chip.cycles - chip.load.sleepCycles;
    const { cycles, last } = this.spent;
    if (last !== null) cycles.set(last, (cycles.get(last) ?? 0) + awake - this.spent.awake);
    this.spent.awake = awake;
    this.spent.last = core.IPSR * 2 ** 32 + core.pc;
  }

  ends(call) {
    this.calls[call.name].push([call.began, this.chip.cycles - call.began]);
    call.began = null;
  }

  forget() {
    this.calls = {};
    this.spent = { cycles: new Map(), last: null, awake: 0 };
    for (const name of [...this.names.values(), ...this.handlers.map((handler) => handler.name)]) this.calls[name] = [];
  }

  /** By name, [cycle of its beginning, cycles that it took] of each call that has returned since this was last asked. */
  take() {
    const { calls } = this;
    this.forget();
    return calls;
  }

  /** [exception, address, cycles awake] of each instruction that was carried out since the calls were last asked. */
  profile() {
    return [...this.spent.cycles].map(([key, cycles]) => [Math.floor(key / 2 ** 32), key % 2 ** 32, cycles]);
  }

  end() {
    delete this.chip.bus.pieceAt;
    delete this.core.step;
  }
}

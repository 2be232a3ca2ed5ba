// Execution times of functions and exception handlers, to the cycle, from outside. For functions
// and for a profile there is a check before every instruction: no code is translated during such a
// trace, which makes the chip a few times slower and does not change its behaviour. For handlers
// alone there is a check before every piece of translated code (core/translate.mjs), because an
// exception begins before a piece and ends with one.

export class Trace {
  /**
   * @param {import('./chip.mjs').Chip} chip up to its next reset
   * @param {Record<string, number>} functions by name: address of the first instruction
   * @param {Record<string, number>} handlers by name: number of the exception (16 + IRQ)
   * @param {boolean} hasProfile whether the cycles of each instruction are counted
   */
  constructor(chip, functions, handlers, hasProfile) {
    this.chip = chip;
    this.core = chip.core;
    this.names = new Map(Object.entries(functions).map(([name, address]) => [address & ~1, name]));
    // A handler that is already active is not counted.
    this.handlers = Object.entries(handlers).map(([name, number]) => ({
      name,
      number,
      began: null,
      left: this.core.IPSR !== number,
    }));
    /** Functions that have not returned: { name, began, sp, back }. */
    this.open = [];
    this.forget();
    const { pieceAt } = chip.bus;
    if (this.names.size === 0 && !hasProfile) {
      chip.bus.pieceAt = (address) => {
        this.lookForHandlers();
        return pieceAt.call(chip.bus, address);
      };
    } else {
      chip.bus.pieceAt = () => {
        this.look();
        return null;
      };
    }
  }

  look() {
    const { core, chip, open } = this;
    this.charge();
    this.lookForHandlers();
    while (open.length > 0 && core.pc === open.at(-1).back && core.r[13] === open.at(-1).sp)
      this.ends(open.pop());
    const name = this.names.get(core.pc);
    if (name !== undefined)
      open.push({ name, began: chip.cycles, sp: core.r[13], back: core.r[14] & ~1 });
  }

  lookForHandlers() {
    const { core, chip } = this;
    for (const handler of this.handlers) {
      if (core.IPSR !== handler.number) {
        handler.left = true;
        if (handler.began !== null) this.ends(handler);
      } else if (handler.left) handler.began ??= chip.cycles;
    }
  }

  /**
   * Adds the cycles since the start of the last instruction to that instruction, unless the
   * processor slept.
   */
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
    for (const name of [...this.names.values(), ...this.handlers.map((handler) => handler.name)])
      this.calls[name] = [];
  }

  /**
   * Returns [start cycle, cycles] of each call that has returned since the last call of this
   * function, by name.
   */
  take() {
    const { calls } = this;
    this.forget();
    return calls;
  }

  /**
   * Returns [exception, address, cycles awake] of each instruction executed since the calls were
   * last read.
   */
  profile() {
    return [...this.spent.cycles].map(([key, cycles]) => [
      Math.floor(key / 2 ** 32),
      key % 2 ** 32,
      cycles,
    ]);
  }

  end() {
    delete this.chip.bus.pieceAt;
  }
}

// One PIO state machine, by the RP2040 datasheet, 3.4 (instructions) and 3.5 (side-set, wrapping,
// FIFO joining, autopush and autopull, clock dividers). The engine (engine.mjs) executes each
// instruction at its cycle.
import { Fifo } from './fifo.mjs';
import { AGAIN, DONE, OPERATIONS } from './operations.mjs';

const SIDE_ENABLE = 1 << 30;
const SIDE_PINDIRS = 1 << 29;
const EXEC_STALLED = 1 << 31;
const AUTOPUSH = 1 << 16;
const AUTOPULL = 1 << 17;
const UNMODELLED_EXEC = (1 << 18) | (1 << 17); // INLINE_OUT_EN, OUT_STICKY
/** Subcycles of a clock divider: it has eight fraction bits. */
export const SUBCYCLES = 256;

const threshold = (field) => field || 32;

export class Machine {
  constructor(block, index) {
    this.block = block;
    this.index = index;
    this.tx = new Fifo();
    this.rx = new Fifo();
    this.enabled = false;
    this.x = 0;
    this.y = 0;
    this.pc = 0;
    this.isr = 0;
    this.osr = 0;
    this.isrCount = 0;
    this.osrCount = 32;
    /**
     * Instruction to execute instead of the one at `pc`, or -1: from INSTR, OUT EXEC or MOV EXEC.
     */
    this.forced = -1;
    /** Whether the instruction is stalled. */
    this.stalled = false;
    /** Whether the stalled IRQ instruction has raised its flag. */
    this.raised = false;
    /** Time of the next instruction, in subcycles (1/256 cycle) since the reset. */
    this.time = 0;
    /** Remaining delay of a disabled machine, in subcycles. */
    this.left = 0;
    /** Whether the last instruction was a jump to itself. */
    this.repeats = false;
    this.previous = 0;
    this.jumped = false;
    this.counter = 'x';
    this.forever = Infinity;
    this.configure('clkdiv', 1 << 16);
    this.configure('execctrl', 0x1f << 12);
    this.configure('shiftctrl', 3 << 18);
    this.configure('pinctrl', 5 << 26);
  }

  /** Decodes the value of a register. */
  configure(register, value) {
    this[register] = value >>> 0;
    if (register === 'clkdiv') {
      this.divider =
        (value >>> 16 || 0x10000) * SUBCYCLES + (value >>> 16 ? (value >>> 8) & 255 : 0);
    } else if (register === 'execctrl') {
      if (value & UNMODELLED_EXEC)
        throw new Error('PIO: OUT_STICKY and INLINE_OUT_EN are not emulated');
      this.jumpPin = (value >>> 24) & 31;
      this.wrapTop = (value >>> 12) & 31;
      this.wrapBottom = (value >>> 7) & 31;
    } else if (register === 'shiftctrl') {
      this.autopush = (value & AUTOPUSH) !== 0;
      this.autopull = (value & AUTOPULL) !== 0;
      this.inRight = (value & (1 << 18)) !== 0;
      this.outRight = (value & (1 << 19)) !== 0;
      this.pushThreshold = threshold((value >>> 20) & 31);
      this.pullThreshold = threshold((value >>> 25) & 31);
      this.join(value >>> 30);
    } else {
      this.outBase = value & 31;
      this.setBase = (value >>> 5) & 31;
      this.sideBase = (value >>> 10) & 31;
      this.inBase = (value >>> 15) & 31;
      this.outCount = (value >>> 20) & 63;
      this.setCount = (value >>> 26) & 7;
    }
    this.sideBits = this.pinctrl >>> 29;
    this.sideOptional = (this.execctrl & SIDE_ENABLE) !== 0;
    this.delayMask = (1 << (5 - this.sideBits)) - 1;
  }

  /**
   * FIFO joining (datasheet 3.5.3): with 1 the transmit FIFO has all words, with 2 the receive
   * FIFO.
   */
  join(which) {
    const depths = [
      [4, 4],
      [8, 0],
      [0, 8],
      [0, 0],
    ][which];
    if (this.tx.depth === depths[0] && this.rx.depth === depths[1]) return;
    this.tx.resize(depths[0]);
    this.rx.resize(depths[1]);
    this.block.fifosChanged(this);
  }

  /**
   * CTRL.SM_RESTART (datasheet 3.7): clears the internal state, but not x, y or the program
   * counter.
   */
  restart() {
    this.isr = 0;
    this.isrCount = 0;
    this.osrCount = 32;
    this.forced = -1;
    this.stalled = false;
    this.raised = false;
    this.clearStalledFlag();
  }

  clearStalledFlag() {
    this.execctrl = (this.execctrl & ~EXEC_STALLED) >>> 0;
  }

  /** Returns the next tick of the divided clock at or after `now` (in cycles). */
  tickFrom(now) {
    const at = now * SUBCYCLES;
    const late = at - this.time;
    return late <= 0 ? this.time : this.time + Math.ceil(late / this.divider) * this.divider;
  }

  /** Executes the instruction that is due, unless it is still stalled. */
  step() {
    const { forced } = this;
    this.previous = this.pc;
    const instruction = forced >= 0 ? forced : this.block.instructions[this.pc];
    const delayOrSide = (instruction >> 8) & 31;
    this.jumped = false;
    this.forced = -1;
    this.stalled = false;
    const done = OPERATIONS[instruction >> 13](this, instruction & 255);
    // After the operation: side-set has priority if both drive a pin (datasheet 3.5.6.2).
    if (this.sideBits) this.sideSet(delayOrSide);
    if (done !== DONE) {
      this.forced = forced;
      if (done === AGAIN) this.time += this.divider;
      else this.stalled = true;
      if (forced >= 0) this.execctrl = (this.execctrl | EXEC_STALLED) >>> 0;
      return;
    }
    if (forced >= 0) this.clearStalledFlag();
    if (this.autopull && this.osrCount >= this.pullThreshold) this.refill();
    this.repeats = this.jumped && this.pc === this.previous;
    if (!this.jumped && forced < 0)
      this.pc = this.pc === this.wrapTop ? this.wrapBottom : (this.pc + 1) & 31;
    // The delay of an instruction that executes another is ignored (datasheet 3.4.5.2, 3.4.8.2).
    this.time += (this.forced >= 0 ? 1 : 1 + (delayOrSide & this.delayMask)) * this.divider;
  }

  /** Side-set is at the start of an instruction, also of a stalled one (datasheet 3.5.1). */
  sideSet(field) {
    let bits = this.sideBits;
    let value = field >> (5 - bits);
    if (this.sideOptional) {
      bits--;
      if (!(value >> bits)) return;
      value &= (1 << bits) - 1;
    }
    this.block.drive(
      this.execctrl & SIDE_PINDIRS ? 'directions' : 'values',
      value,
      this.sideBase,
      bits,
    );
  }

  /** Autopull (datasheet 3.5.4.2): takes a word from the FIFO if the OSR is empty. */
  refill() {
    if (this.tx.empty) return false;
    this.osr = this.pullWord();
    this.osrCount = 0;
    return true;
  }

  pullWord() {
    const word = this.tx.pull();
    this.block.fifosChanged(this);
    return word;
  }

  pushWord() {
    this.rx.push(this.isr);
    this.isr = 0;
    this.isrCount = 0;
    this.block.fifosChanged(this);
  }

  /**
   * Returns the subcycles of one more `jmp x-- here` (or y, or always) that jumps to itself and has
   * done so before; 0 if the machine
   * does something else. Such a wait has no visible effect, so that the engine may skip it.
   * `this[this.counter]` is the number of
   * jumps left.
   */
  spin() {
    if (!this.repeats || this.forced >= 0) return 0;
    const instruction = this.block.instructions[this.pc];
    if ((instruction & 0xe01f) !== this.pc) return 0;
    const condition = (instruction >> 5) & 7;
    if (condition !== 0 && condition !== 2 && condition !== 4) return 0;
    this.counter = condition === 0 ? 'forever' : condition === 2 ? 'x' : 'y';
    return this[this.counter] === 0
      ? 0
      : (1 + ((instruction >> 8) & this.delayMask)) * this.divider;
  }

  /**
   * Called when a condition may have changed at `now` (in cycles): the machine checks at its next
   * tick.
   */
  wake(now) {
    if (!this.stalled) return;
    this.stalled = false;
    this.repeats = false;
    this.time = this.tickFrom(now + 1);
  }

  get waitsForInput() {
    if (!this.stalled) return false;
    const instruction = this.forced >= 0 ? this.forced : this.block.instructions[this.pc];
    return instruction >> 13 === 1;
  }

  /** Whether there is an instruction to execute. */
  get active() {
    return !this.stalled && (this.enabled || this.forced >= 0);
  }
}

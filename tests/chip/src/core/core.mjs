// A Cortex-M0+ (ARMv6-M): registers, exceptions, sleep, and the loop that runs instructions.
//
// Defects of the core in rp2040js 1.4.1, all observed:
// - SEV does nothing, so that an executor that sleeps in WFE is never woken from thread mode
//   (ARMv6-M B1.5.18).
// - ADCS and SBCS add the carry to an operand before they compute the overflow flag: 0 < i64::MAX
//   is
//   false.
// - There are no faults: UDF, an unaligned or an unmapped access have no effect. On the chip each
//   is
//   a HardFault.
// - An exception takes no time; PUSH {.., LR} and POP {.., PC} are one cycle short (Cortex-M0+ TRM,
//   table 3-1 and 3.9).
// - An interrupt is lost if its line falls before it is taken; SCR and AIRCR are missing
//   (repairs/ppb.mjs).
// - Every instruction takes up to eighty comparisons; here a table gives its function
//   (instructions.mjs).
//
// The fields that other parts of rp2040js read and write keep its names (`pendingInterrupts`,
// `interruptPriorities`, ...).
import { FAULT } from './bus.mjs';
import { FUNCTIONS, KINDS } from './instructions.mjs';

const NMI = 2;
const HARD_FAULT = 3;
const SV_CALL = 11;
const PEND_SV = 14;
const SYS_TICK = 15;
const FIRST_IRQ = 16;
const THREAD = 4; // below every configurable priority
/**
 * TRM 3.9: 15 cycles from an interrupt to its first instruction. The return is not published; 13 is
 * an estimate.
 */
const ENTRY_CYCLES = 15;
const EXIT_CYCLES = 13;
const SLEEP_ON_EXIT = 1 << 1;
const SEV_ON_PEND = 1 << 4;

export class Core {
  /**
   * @param {import('./bus.mjs').Bus} bus
   * @param {import('../clock.mjs').VirtualClock} clock
   */
  constructor(bus, clock) {
    this.bus = bus;
    this.clock = clock;
    /** r0 to r12, SP (of the current stack), LR; the program counter is `pc`. */
    this.r = new Int32Array(16);
    this.pc = 0;
    /** Address of the current instruction. */
    this.at = 0;
    // Flags: N is n < 0, Z is z === 0; C and V are 0 or 1.
    this.n = 0;
    this.z = 1;
    this.c = 0;
    this.v = 0;
    this.otherStack = 0;
    this.onProcessStack = false;
    this.primask = false;
    this.IPSR = 0;
    this.VTOR = 0;
    this.SHPR2 = 0;
    this.SHPR3 = 0;
    this.SCR = 0;
    this.lines = 0;
    this.pendingInterrupts = 0;
    this.enabledInterrupts = 0;
    this.interruptPriorities = [0xffffffff | 0, 0, 0, 0];
    this.pendingNMI = false;
    this.pendingPendSV = false;
    this.pendingSVCall = false;
    this.pendingSystick = false;
    this.interruptsUpdated = false;
    this.eventRegistered = false;
    this.waiting = false;
    this.waitsForEvent = false;
    /** Set by a fault within a fault; only a reset clears it (ARMv6-M B1.5.15). */
    this.lockedUp = false;
    /** Cause of the last HardFault: { address, kind }. */
    this.fault = null;
    /** Number of instructions executed. */
    this.instructions = 0;
    /**
     * rp2040js adds the divider's eight cycles here; the chip's processor does not wait (datasheet
     * 2.3.1.5).
     */
    this.cycles = 0;
  }

  /** Starts at an address, with a stack below it, as the boot ROM starts the second stage. */
  start(address) {
    this.r[13] = address;
    this.r[14] = 0;
    this.pc = address;
  }

  /** Runs until the clock's horizon, or until the processor sleeps. */
  run() {
    const { clock } = this;
    while (clock.now < clock.horizon && !this.waiting) {
      try {
        this.runUnlessFaulting(clock, this.bus, this.r);
      } catch (error) {
        if (error !== FAULT) throw error;
        this.hardFault('bus fault');
      }
    }
  }

  runUnlessFaulting(clock, bus, r) {
    while (clock.now < clock.horizon && !this.waiting) {
      if (this.interruptsUpdated) this.checkForInterrupts();
      const piece = bus.pieceAt(this.pc);
      // Not `clock.now += ...`: an exception within adds to it as well.
      let cycles;
      if (piece !== null && clock.now + piece.reach < clock.horizon)
        cycles = piece.run(this, bus, clock, r, FUNCTIONS);
      else cycles = this.step(bus);
      clock.now += cycles;
      if (bus.stall !== 0) clock.now += bus.takeStall();
    }
  }

  /** Executes one instruction. */
  step(bus) {
    const { pc } = this;
    this.at = pc;
    const instruction = bus.fetch(pc);
    if (bus.stall !== 0) this.clock.now += bus.takeStall();
    this.pc = pc + 2;
    this.instructions++;
    return FUNCTIONS[KINDS[instruction]](this, instruction);
  }

  /** Returns a register as an operand: the program counter is four bytes ahead. */
  operand(register) {
    return register === 15 ? this.at + 4 : this.r[register];
  }

  get xpsr() {
    return (
      (this.n < 0 ? 1 << 31 : 0) |
      (this.z === 0 ? 1 << 30 : 0) |
      (this.c << 29) |
      (this.v << 28) |
      this.IPSR
    );
  }

  setFlags(xpsr) {
    this.n = xpsr;
    this.z = xpsr & (1 << 30) ? 0 : 1;
    this.c = (xpsr >>> 29) & 1;
    this.v = (xpsr >>> 28) & 1;
  }

  /**
   * Sets a peripheral's interrupt line. A rising line is pending until it is served (ARMv6-M B3.4).
   */
  setInterrupt(irq, level) {
    const bit = 1 << irq;
    if (!level) {
      this.lines &= ~bit;
    } else if (!(this.lines & bit)) {
      this.lines |= bit;
      this.pendingInterrupts |= bit;
      this.interruptsUpdated = true;
      if (this.SCR & SEV_ON_PEND) this.eventRegistered = true;
    }
  }

  priority(exception) {
    switch (exception) {
      case 0:
        return THREAD;
      case NMI:
        return -2;
      case HARD_FAULT:
        return -1;
      case SV_CALL:
        return this.SHPR2 >>> 30;
      case PEND_SV:
        return (this.SHPR3 >>> 22) & 3;
      case SYS_TICK:
        return this.SHPR3 >>> 30;
      default:
        return this.interruptPriorities.findIndex((irqs) => irqs & (1 << (exception - FIRST_IRQ)));
    }
  }

  /**
   * Returns the exception to take at a priority above (a number below) `limit`; 0 if there is none.
   */
  candidate(limit) {
    if (this.pendingNMI && limit > -2) return NMI;
    const ready = this.pendingInterrupts & this.enabledInterrupts;
    for (let priority = 0; priority < limit; priority++) {
      if (this.pendingSVCall && this.priority(SV_CALL) === priority) return SV_CALL;
      if (this.pendingPendSV && this.priority(PEND_SV) === priority) return PEND_SV;
      if (this.pendingSystick && this.priority(SYS_TICK) === priority) return SYS_TICK;
      const irqs = ready & this.interruptPriorities[priority];
      if (irqs) return FIRST_IRQ + 31 - Math.clz32(irqs & -irqs);
    }
    return 0;
  }

  get vectPending() {
    return this.candidate(THREAD);
  }

  get limit() {
    const active = this.priority(this.IPSR);
    return this.primask ? Math.min(active, 0) : active;
  }

  checkForInterrupts() {
    const exception = this.candidate(this.limit);
    if (exception === 0) {
      this.interruptsUpdated = false;
      return;
    }
    if (exception === NMI) this.pendingNMI = false;
    else if (exception === SV_CALL) this.pendingSVCall = false;
    else if (exception === PEND_SV) this.pendingPendSV = false;
    else if (exception === SYS_TICK) this.pendingSystick = false;
    else this.pendingInterrupts &= ~(1 << (exception - FIRST_IRQ));
    this.enter(exception, this.pc);
  }

  /** Wakes the processor from WFI or WFE if there is a wake-up event (ARMv6-M B1.5.17, B1.5.18). */
  wakeIfReady() {
    if (this.lockedUp) return;
    // PRIMASK prevents an interrupt from being taken, but not from ending WFI.
    const wakes = this.waitsForEvent
      ? this.eventRegistered || this.candidate(this.limit)
      : this.candidate(this.priority(this.IPSR));
    if (!wakes) {
      this.interruptsUpdated = false;
      return;
    }
    if (this.waitsForEvent) this.eventRegistered = false;
    this.waiting = false;
  }

  sleep(forEvent) {
    if (forEvent && this.eventRegistered) {
      this.eventRegistered = false;
      return;
    }
    this.waiting = true;
    this.waitsForEvent = forEvent;
    this.interruptsUpdated = true;
  }

  /** Pushes the frame and enters the handler (ARMv6-M B1.5.6). */
  enter(exception, returnAddress) {
    const { r, bus } = this;
    const handler = this.IPSR !== 0;
    const onProcessStack = this.onProcessStack && !handler;
    const aligned = r[13] & 4;
    const frame = (r[13] - 32) & ~7;
    const link = handler ? 0xfffffff1 : onProcessStack ? 0xfffffffd : 0xfffffff9;
    const words = [
      r[0],
      r[1],
      r[2],
      r[3],
      r[12],
      r[14],
      returnAddress & ~1,
      (this.xpsr & ~(1 << 9)) | (1 << 24) | (aligned << 7),
    ];
    try {
      words.forEach((word, i) => bus.write32(frame + 4 * i, word));
    } catch (error) {
      if (error !== FAULT) throw error;
      // The frame of a fault may have no memory: the handler runs, unless the fault was in the
      // handler (B1.5.14).
      if (exception !== HARD_FAULT) return this.hardFault('stacking fault');
    }
    r[13] = frame;
    if (onProcessStack) this.switchStack(false);
    r[14] = link | 0;
    this.IPSR = exception;
    this.eventRegistered = true;
    this.pc = bus.read32(this.VTOR + 4 * exception) & ~1;
    this.clock.now += ENTRY_CYCLES;
  }

  /** Pops the frame that `link` (an EXC_RETURN value) names (ARMv6-M B1.5.8). */
  leave(link) {
    const { r, bus } = this;
    this.switchStack((link & 0xf) === 0xd);
    const frame = r[13];
    const words = Array.from({ length: 8 }, (_, i) => bus.read32(frame + 4 * i));
    [r[0], r[1], r[2], r[3], r[12], r[14]] = words;
    const left = this.IPSR - FIRST_IRQ;
    this.pc = words[6] & ~1;
    this.setFlags(words[7]);
    this.IPSR = words[7] & 0x3f;
    r[13] = (frame + 32) | (words[7] & (1 << 9) ? 4 : 0);
    // A line that is still high is pending again.
    if (left >= 0) this.pendingInterrupts |= this.lines & (1 << left);
    this.interruptsUpdated = true;
    this.eventRegistered = true;
    this.clock.now += EXIT_CYCLES;
    if (this.SCR & SLEEP_ON_EXIT && this.IPSR === 0) this.sleep(false);
  }

  switchStack(toProcess) {
    if (this.onProcessStack === toProcess) return;
    [this.r[13], this.otherStack] = [this.otherStack, this.r[13]];
    this.onProcessStack = toProcess;
  }

  /** BX, and POP into the program counter: a return from an exception, or a jump. */
  branchTo(target) {
    if (this.IPSR !== 0 && target >>> 28 === 0xf) this.leave(target);
    else if (!(target & 1)) this.hardFault('branch to ARM code');
    else this.pc = target & ~1;
  }

  hardFault(kind) {
    this.fault = { address: this.at, kind };
    if (this.IPSR === HARD_FAULT || this.IPSR === NMI) {
      this.lockedUp = true;
      this.waiting = true;
      return;
    }
    try {
      this.enter(HARD_FAULT, this.at);
    } catch (error) {
      if (error !== FAULT) throw error;
      this.lockedUp = true;
      this.waiting = true;
    }
  }

  readSpecial(register) {
    if (register <= 7) return register & 4 ? this.IPSR : this.xpsr & ~0x3f;
    if (register === 8) return this.onProcessStack ? this.otherStack : this.r[13];
    if (register === 9) return this.onProcessStack ? this.r[13] : this.otherStack;
    if (register === 16) return this.primask ? 1 : 0;
    return register === 20 && this.onProcessStack ? 2 : 0;
  }

  writeSpecial(register, value) {
    if (register < 4) this.setFlags(value);
    else if (register === 8 || register === 9) {
      if ((register === 9) === this.onProcessStack) this.r[13] = value & ~3;
      else this.otherStack = value & ~3;
    } else if (register === 16) this.setPrimask(value & 1);
    else if (register === 20 && this.IPSR === 0) this.switchStack((value & 2) !== 0);
  }

  setPrimask(masked) {
    this.primask = !!masked;
    this.interruptsUpdated = true;
  }
}

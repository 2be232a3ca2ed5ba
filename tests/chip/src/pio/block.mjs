// A PIO block: the registers, instruction memory, pins and flags that four state machines share
// (RP2040 datasheet 3.2, 3.5, 3.7).
import { Machine, SUBCYCLES } from './machine.mjs';

const CTRL = 0x00;
const FSTAT = 0x04;
const FDEBUG = 0x08;
const FLEVEL = 0x0c;
const TXF0 = 0x10;
const RXF0 = 0x20;
const IRQ = 0x30;
const IRQ_FORCE = 0x34;
const INPUT_SYNC_BYPASS = 0x38;
const DBG_PADOUT = 0x3c;
const DBG_PADOE = 0x40;
const DBG_CFGINFO = 0x44;
const INSTR_MEM0 = 0x48;
const SM0 = 0xc8;
const SM_BYTES = 0x18;
const SM_REGISTERS = ['clkdiv', 'execctrl', 'shiftctrl', 'addr', 'instr', 'pinctrl'];
const INTR = 0x128;
const INTE = [0x12c, 0x138];
const INTF = [0x130, 0x13c];
const INTS = [0x134, 0x140];
const PINS = 30;
const BLOCK_DREQS = 8;
const RX_DREQ = 4;

/** Bits `base` and up, `count` of them, wrapping after bit 31 as the pins do. */
function rotate(bits, base) {
  return base ? (bits << base) | (bits >>> (32 - base)) : bits;
}

export class Block {
  constructor(mcu, engine, index, firstIrq) {
    this.mcu = mcu;
    this.engine = engine;
    this.index = index;
    this.firstIrq = firstIrq;
    this.instructions = new Uint16Array(32);
    this.irq = 0;
    /** Flags raised in this cycle: visible to others in the next. */
    this.raising = 0;
    this.fdebug = 0;
    this.inte = [0, 0];
    this.intf = [0, 0];
    this.syncBypass = 0;
    // rp2040js' pins read a block's outputs by these names.
    this.pinValues = 0;
    this.pinDirections = 0;
    this.values = 0;
    this.directions = 0;
    this.machines = [0, 1, 2, 3].map((n) => new Machine(this, n));
    for (const machine of this.machines) this.requestData(machine);
  }

  /** Drives pins for a machine; visible at the end of the cycle (`commit`). */
  drive(what, value, base, count) {
    if (count === 0) return;
    const mask = rotate(count >= 32 ? -1 : (1 << count) - 1, base);
    this[what] = (this[what] & ~mask) | (rotate(value, base) & mask);
  }

  input(pin) {
    return pin < PINS && this.mcu.gpio[pin].inputValue;
  }

  inputs() {
    return this.mcu.gpioValues;
  }

  raiseFlags(flags) {
    this.raising |= flags;
  }

  clearFlags(flags) {
    this.irq &= ~flags;
    this.flagsChanged();
  }

  flagsChanged() {
    for (const machine of this.machines) machine.wake(this.engine.now);
    this.updateInterrupts();
  }

  /** Ends a cycle: makes the machines' outputs and flags visible. */
  commit() {
    if (this.raising) {
      this.irq |= this.raising;
      this.raising = 0;
      this.flagsChanged();
    }
    let changed = (this.values ^ this.pinValues) | (this.directions ^ this.pinDirections);
    if (!changed) return;
    this.pinValues = this.values;
    this.pinDirections = this.directions;
    for (; changed; changed &= changed - 1) {
      const pin = 31 - Math.clz32(changed & -changed);
      if (pin < PINS) this.mcu.gpio[pin].checkForUpdates();
    }
  }

  /** Called when a FIFO has gained or lost a word. */
  fifosChanged(machine) {
    this.requestData(machine);
    machine.wake(this.engine.now);
    if (this.inte[0] | this.inte[1]) this.updateInterrupts();
  }

  requestData(machine) {
    const { dma } = this.mcu;
    const tx = this.index * BLOCK_DREQS + machine.index;
    if (machine.tx.full) dma.clearDREQ(tx);
    else dma.setDREQ(tx);
    if (machine.rx.empty) dma.clearDREQ(tx + RX_DREQ);
    else dma.setDREQ(tx + RX_DREQ);
  }

  get intr() {
    let bits = (this.irq & 15) << 8;
    for (const { index, tx, rx } of this.machines)
      bits |= (rx.empty ? 0 : 1 << index) | (tx.full ? 0 : 16 << index);
    return bits;
  }

  updateInterrupts() {
    for (const n of [0, 1])
      this.mcu.setInterrupt(this.firstIrq + n, ((this.intr & this.inte[n]) | this.intf[n]) !== 0);
  }

  /** Writes a word to a machine's FIFO, from the processor or from DMA. */
  writeFifo(machine, word) {
    if (machine.tx.full) {
      this.fdebug |= 1 << (16 + machine.index);
      return;
    }
    machine.tx.push(word);
    // An empty OSR takes it at once, unless an OUT is due in this cycle (datasheet 3.5.4.2).
    const outNow = !machine.stalled && machine.time <= machine.tickFrom(this.engine.now + 1);
    if (
      machine.autopull &&
      machine.enabled &&
      machine.osrCount >= machine.pullThreshold &&
      !machine.stalled &&
      !outNow
    ) {
      machine.refill();
    } else {
      this.fifosChanged(machine);
    }
  }

  readFifo(machine) {
    if (machine.rx.empty) {
      this.fdebug |= 1 << (8 + machine.index);
      return 0;
    }
    const word = machine.rx.pull();
    this.fifosChanged(machine);
    return word;
  }

  readUint32(offset) {
    this.engine.catchUp();
    const value = this.read(offset);
    this.engine.plan();
    return value >>> 0;
  }

  writeUint32Atomic(offset, value, alias) {
    this.engine.catchUp();
    const clearing = offset === IRQ || offset === FDEBUG;
    const old = alias === 0 || clearing ? 0 : this.read(offset);
    this.write(
      offset,
      [value, old ^ value, old | value, clearing ? value : old & ~value][alias] >>> 0,
    );
    this.engine.plan();
  }

  read(offset) {
    const { machines } = this;
    if (offset >= RXF0 && offset < IRQ) return this.readFifo(machines[(offset - RXF0) >> 2]);
    if (offset >= SM0 && offset < INTR)
      return this.readMachine(
        machines[Math.floor((offset - SM0) / SM_BYTES)],
        (offset - SM0) % SM_BYTES,
      );
    switch (offset) {
      case CTRL:
        return machines.reduce(
          (bits, machine) => bits | (machine.enabled ? 1 << machine.index : 0),
          0,
        );
      case FSTAT:
        return machines.reduce(
          (bits, { index, tx, rx }) =>
            bits |
            (((tx.empty ? 1 << 24 : 0) |
              (tx.full ? 1 << 16 : 0) |
              (rx.empty ? 1 << 8 : 0) |
              (rx.full ? 1 : 0)) <<
              index),
          0,
        );
      case FDEBUG:
        return this.fdebug;
      case FLEVEL:
        return machines.reduce(
          (bits, { index, tx, rx }) => bits | ((tx.count | (rx.count << 4)) << (8 * index)),
          0,
        );
      case IRQ:
        return this.irq;
      case INPUT_SYNC_BYPASS:
        return this.syncBypass;
      case DBG_PADOUT:
        return this.pinValues;
      case DBG_PADOE:
        return this.pinDirections;
      case DBG_CFGINFO:
        return (32 << 16) | (4 << 8) | 4;
      case INTR:
        return this.intr;
      default:
        return this.readInterrupt(offset);
    }
  }

  readInterrupt(offset) {
    for (const n of [0, 1]) {
      if (offset === INTE[n]) return this.inte[n];
      if (offset === INTF[n]) return this.intf[n];
      if (offset === INTS[n]) return (this.intr & this.inte[n]) | this.intf[n];
    }
    return 0;
  }

  readMachine(machine, offset) {
    const register = SM_REGISTERS[offset >> 2];
    if (register === 'addr') return machine.pc;
    if (register === 'instr')
      return machine.forced >= 0 ? machine.forced : this.instructions[machine.pc];
    return machine[register];
  }

  write(offset, value) {
    const { machines } = this;
    if (offset >= TXF0 && offset < RXF0) {
      this.writeFifo(machines[(offset - TXF0) >> 2], value);
    } else if (offset >= INSTR_MEM0 && offset < SM0) {
      this.instructions[(offset - INSTR_MEM0) >> 2] = value;
    } else if (offset >= SM0 && offset < INTR) {
      this.writeMachine(
        machines[Math.floor((offset - SM0) / SM_BYTES)],
        (offset - SM0) % SM_BYTES,
        value,
      );
    } else if (offset === CTRL) {
      this.control(value);
    } else if (offset === FDEBUG) {
      this.fdebug &= ~value;
    } else if (offset === IRQ) {
      this.clearFlags(value);
    } else if (offset === IRQ_FORCE) {
      this.irq |= value & 255;
      this.flagsChanged();
    } else if (offset === INPUT_SYNC_BYPASS) {
      this.syncBypass = value;
    } else {
      this.writeInterrupt(offset, value);
    }
  }

  writeInterrupt(offset, value) {
    for (const n of [0, 1]) {
      if (offset === INTE[n]) this.inte[n] = value & 0xfff;
      if (offset === INTF[n]) this.intf[n] = value & 0xfff;
    }
    this.updateInterrupts();
  }

  control(value) {
    const now = this.engine.now * SUBCYCLES;
    for (const machine of this.machines) {
      const [enabled, restarts, inPhase] = [0, 4, 8].map(
        (shift) => ((value >> (shift + machine.index)) & 1) === 1,
      );
      if (enabled === machine.enabled && !restarts && !inPhase) continue;
      // A delay pauses and continues with its machine.
      let left = machine.enabled ? Math.max(0, machine.time - now) : machine.left;
      if (restarts) {
        machine.restart();
        left = 0;
      }
      if (inPhase) left = Math.ceil(left / machine.divider) * machine.divider;
      machine.enabled = enabled;
      machine.left = left;
      machine.time = now + left;
    }
  }

  writeMachine(machine, offset, value) {
    const register = SM_REGISTERS[offset >> 2];
    if (register === 'addr') return;
    if (register === 'instr') {
      // Executed at once, also by a machine that is disabled or stalled (datasheet 3.7,
      // SM0_INSTR).
      machine.time = this.engine.now * SUBCYCLES;
      machine.left = 0;
      machine.forced = value & 0xffff;
      machine.raised = false;
      machine.step();
      this.commit();
    } else {
      machine.configure(
        register,
        register === 'execctrl' ? (value & 0x7fffffff) | (machine.execctrl & (1 << 31)) : value,
      );
      machine.wake(this.engine.now);
    }
  }
}

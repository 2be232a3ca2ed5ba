// The nine PIO instructions (RP2040 datasheet 3.4). Each function executes one and returns whether
// it is complete.

/** The instruction is complete. */
export const DONE = 1;
/** The instruction is stalled until its condition may have changed. */
export const WAITS = 0;
/** The instruction needs another cycle. */
export const AGAIN = 2;

const FDEBUG_TXSTALL = 24;
const FDEBUG_RXSTALL = 0;

function reverse(word) {
  let result = 0;
  for (let i = 0; i < 32; i++) result |= ((word >>> i) & 1) << (31 - i);
  return result >>> 0;
}

const mask = (bits) => (bits >= 32 ? 0xffffffff : (1 << bits) - 1);

/** An IRQ flag's number; with bit 4 it is counted from the machine's own (modulo 4). */
const flagOf = (machine, field) =>
  field & 16 ? (field & 4) | ((field + machine.index) & 3) : field & 7;

function jump(machine, target) {
  machine.pc = target & 31;
  machine.jumped = true;
}

const CONDITIONS = [
  () => true,
  (machine) => machine.x === 0,
  (machine) => {
    const before = machine.x;
    machine.x = (before - 1) >>> 0;
    return before !== 0;
  },
  (machine) => machine.y === 0,
  (machine) => {
    const before = machine.y;
    machine.y = (before - 1) >>> 0;
    return before !== 0;
  },
  (machine) => machine.x !== machine.y,
  (machine) => machine.block.input(machine.jumpPin),
  (machine) => machine.osrCount < machine.pullThreshold,
];

function jmp(machine, field) {
  if (CONDITIONS[field >> 5](machine)) jump(machine, field);
  return DONE;
}

function wait(machine, field) {
  const wanted = field >> 7 === 1;
  const { block } = machine;
  const index = field & 31;
  switch ((field >> 5) & 3) {
    case 0:
      return block.input(index) === wanted ? DONE : WAITS;
    case 1:
      return block.input((machine.inBase + index) & 31) === wanted ? DONE : WAITS;
    case 2: {
      const flag = 1 << flagOf(machine, index);
      if (((block.irq & flag) !== 0) !== wanted) return WAITS;
      if (wanted) block.clearFlags(flag);
      return DONE;
    }
    default:
      throw new Error('PIO: WAIT with a reserved source');
  }
}

function sourceOf(machine, source) {
  switch (source) {
    case 0: {
      const pins = machine.block.inputs();
      return (
        ((pins >>> machine.inBase) | (machine.inBase ? pins << (32 - machine.inBase) : 0)) >>> 0
      );
    }
    case 1:
      return machine.x;
    case 2:
      return machine.y;
    case 3:
      return 0;
    case 5: {
      const fifo = machine.execctrl & 16 ? machine.rx : machine.tx;
      return fifo.count < (machine.execctrl & 15) ? 0xffffffff : 0;
    }
    case 6:
      return machine.isr;
    case 7:
      return machine.osr;
    default:
      throw new Error('PIO: reserved source');
  }
}

function shiftIn(machine, field) {
  const bits = field & 31 || 32;
  const count = Math.min(32, machine.isrCount + bits);
  const pushes = machine.autopush && count >= machine.pushThreshold;
  if (pushes && machine.rx.full) return stall(machine, FDEBUG_RXSTALL);
  const value = sourceOf(machine, field >> 5) & mask(bits);
  if (bits === 32) machine.isr = value >>> 0;
  else if (machine.inRight) machine.isr = ((machine.isr >>> bits) | (value << (32 - bits))) >>> 0;
  else machine.isr = ((machine.isr << bits) | value) >>> 0;
  machine.isrCount = count;
  if (pushes) machine.pushWord();
  return DONE;
}

function stall(machine, flag) {
  machine.block.fdebug |= 1 << (flag + machine.index);
  return WAITS;
}

/**
 * Writes a value to the destination PINS (0), X (1) or Y (2), whose codes OUT, MOV and SET share;
 * the pins are `count` from `base` on. Returns whether it was one of them.
 */
function writeShared(machine, destination, value, base, count) {
  if (destination === 0) machine.block.drive('values', value, base, count);
  else if (destination === 1) machine.x = value;
  else if (destination === 2) machine.y = value;
  else return false;
  return true;
}

function shiftOut(machine, field) {
  const bits = field & 31 || 32;
  if (machine.autopull && machine.osrCount >= machine.pullThreshold) {
    // An empty OSR cannot be filled and used in the same cycle (datasheet 3.5.4.2).
    if (!machine.refill()) return stall(machine, FDEBUG_TXSTALL);
    return AGAIN;
  }
  const value = (machine.outRight ? machine.osr & mask(bits) : machine.osr >>> (32 - bits)) >>> 0;
  if (bits === 32) machine.osr = 0;
  else machine.osr = (machine.outRight ? machine.osr >>> bits : machine.osr << bits) >>> 0;
  machine.osrCount = Math.min(32, machine.osrCount + bits);
  const { block, outBase, outCount } = machine;
  if (writeShared(machine, field >> 5, value, outBase, outCount)) return DONE;
  switch (field >> 5) {
    case 3:
      break;
    case 4:
      block.drive('directions', value, outBase, outCount);
      break;
    case 5:
      jump(machine, value);
      break;
    case 6:
      machine.isr = value;
      machine.isrCount = bits;
      break;
    default:
      machine.forced = value & 0xffff;
  }
  return DONE;
}

function push(machine, ifFull, block) {
  if (ifFull && machine.isrCount < machine.pushThreshold) return DONE;
  if (!machine.rx.full) {
    machine.pushWord();
    return DONE;
  }
  stall(machine, FDEBUG_RXSTALL);
  if (block) return WAITS;
  machine.isr = 0;
  machine.isrCount = 0;
  return DONE;
}

function pull(machine, ifEmpty, block) {
  if (ifEmpty && machine.osrCount < machine.pullThreshold) return DONE;
  // With autopull, PULL of a full OSR does nothing, which makes it a fence (datasheet 3.4.7.2).
  if (machine.autopull && machine.osrCount === 0) return DONE;
  if (machine.tx.empty) {
    stall(machine, FDEBUG_TXSTALL);
    if (block) return WAITS;
    machine.osr = machine.x;
  } else {
    machine.osr = machine.pullWord();
  }
  machine.osrCount = 0;
  return DONE;
}

function pushOrPull(machine, field) {
  const conditional = (field & 64) !== 0;
  const block = (field & 32) !== 0;
  return field & 128 ? pull(machine, conditional, block) : push(machine, conditional, block);
}

function mov(machine, field) {
  const source = sourceOf(machine, field & 7);
  const operation = (field >> 3) & 3;
  const value = (operation === 1 ? ~source : operation === 2 ? reverse(source) : source) >>> 0;
  if (writeShared(machine, field >> 5, value, machine.outBase, machine.outCount)) return DONE;
  switch (field >> 5) {
    case 4:
      machine.forced = value & 0xffff;
      break;
    case 5:
      jump(machine, value);
      break;
    case 6:
      machine.isr = value;
      machine.isrCount = 0;
      break;
    case 7:
      machine.osr = value;
      machine.osrCount = 0;
      break;
    default:
      throw new Error('PIO: MOV to a reserved destination');
  }
  return DONE;
}

function irq(machine, field) {
  const { block } = machine;
  const flag = 1 << flagOf(machine, field & 31);
  if (field & 64) {
    block.clearFlags(flag);
    return DONE;
  }
  if (!machine.raised) {
    block.raiseFlags(flag);
    machine.raised = (field & 32) !== 0;
    return machine.raised ? WAITS : DONE;
  }
  if ((block.irq | block.raising) & flag) return WAITS;
  machine.raised = false;
  return DONE;
}

function set(machine, field) {
  const value = field & 31;
  const { block, setBase, setCount } = machine;
  if (writeShared(machine, field >> 5, value, setBase, setCount)) return DONE;
  if (field >> 5 !== 4) throw new Error('PIO: SET of a reserved destination');
  block.drive('directions', value, setBase, setCount);
  return DONE;
}

/** By bits 15 to 13. */
export const OPERATIONS = [jmp, wait, shiftIn, shiftOut, pushOrPull, mov, irq, set];

// The Thumb instructions of ARMv6-M (reference manual A6.7), one small function each: it changes
// the core and returns its cycles (Cortex-M0+ TRM, table 3-1, with the RP2040's one-cycle
// multiplier). KINDS and FUNCTIONS map a halfword to its function.
import {
  BY_IMMEDIATE,
  BY_REGISTER,
  loadLiteral,
  loadMultiple,
  loadStack,
  pop,
  push,
  storeMultiple,
  storeStack,
} from './memory.mjs';

const low = (op) => op & 7;
const middle = (op) => (op >> 3) & 7;
const upper = (op) => (op >> 6) & 7;
const named = (op) => (op >> 8) & 7;
const imm5 = (op) => (op >> 6) & 31;
const high = (op) => ((op >> 4) & 8) | (op & 7);
const source = (op) => (op >> 3) & 15;

function nz(core, result) {
  core.n = result;
  core.z = result;
  return result;
}

/** a + b + carry, with all flags. Subtraction is the same with b inverted (A2.2.1). */
function add(core, a, b, carry) {
  const wide = (a >>> 0) + (b >>> 0) + carry;
  const result = wide | 0;
  core.c = wide > 0xffffffff ? 1 : 0;
  core.v = ((a ^ result) & (b ^ result)) >>> 31;
  return nz(core, result);
}

// Shifts by 0 to 255, with the carry out (A2.2.1).
function lsl(core, value, by) {
  if (by > 0) core.c = by <= 32 ? (value >>> (32 - by)) & 1 : 0;
  return nz(core, by < 32 ? value << by : 0);
}

function lsr(core, value, by) {
  if (by > 0) core.c = by <= 32 ? (value >>> (by - 1)) & 1 : 0;
  return nz(core, by < 32 ? (value >>> by) | 0 : 0);
}

function asr(core, value, by) {
  const n = by < 32 ? by : 31;
  if (by > 0) core.c = (value >> (by < 32 ? by - 1 : 31)) & 1;
  return nz(core, value >> n);
}

function ror(core, value, by) {
  const n = by & 31;
  const result = n ? (value >>> n) | (value << (32 - n)) : value;
  if (by > 0) core.c = result >>> 31;
  return nz(core, result);
}

/** Register-register operations, 010000: Rdn and Rm. */
const DATA = [
  /* and */ (core, op) => ((core.r[low(op)] = nz(core, core.r[low(op)] & core.r[middle(op)])), 1),
  /* eor */ (core, op) => ((core.r[low(op)] = nz(core, core.r[low(op)] ^ core.r[middle(op)])), 1),
  /* lsl */ (core, op) => (
    (core.r[low(op)] = lsl(core, core.r[low(op)], core.r[middle(op)] & 255)),
    1
  ),
  /* lsr */ (core, op) => (
    (core.r[low(op)] = lsr(core, core.r[low(op)], core.r[middle(op)] & 255)),
    1
  ),
  /* asr */ (core, op) => (
    (core.r[low(op)] = asr(core, core.r[low(op)], core.r[middle(op)] & 255)),
    1
  ),
  /* adc */ (core, op) => (
    (core.r[low(op)] = add(core, core.r[low(op)], core.r[middle(op)], core.c)),
    1
  ),
  /* sbc */ (core, op) => (
    (core.r[low(op)] = add(core, core.r[low(op)], ~core.r[middle(op)], core.c)),
    1
  ),
  /* ror */ (core, op) => (
    (core.r[low(op)] = ror(core, core.r[low(op)], core.r[middle(op)] & 255)),
    1
  ),
  /* tst */ (core, op) => (nz(core, core.r[low(op)] & core.r[middle(op)]), 1),
  /* rsb */ (core, op) => ((core.r[low(op)] = add(core, 0, ~core.r[middle(op)], 1)), 1),
  /* cmp */ (core, op) => (add(core, core.r[low(op)], ~core.r[middle(op)], 1), 1),
  /* cmn */ (core, op) => (add(core, core.r[low(op)], core.r[middle(op)], 0), 1),
  /* orr */ (core, op) => ((core.r[low(op)] = nz(core, core.r[low(op)] | core.r[middle(op)])), 1),
  /* mul */ (core, op) => (
    (core.r[low(op)] = nz(core, Math.imul(core.r[low(op)], core.r[middle(op)]))),
    1
  ),
  /* bic */ (core, op) => ((core.r[low(op)] = nz(core, core.r[low(op)] & ~core.r[middle(op)])), 1),
  /* mvn */ (core, op) => ((core.r[low(op)] = nz(core, ~core.r[middle(op)])), 1),
];

/** Shift by an immediate, add, subtract: 00. An immediate of 0 means 32 for LSR and ASR. */
const ARITHMETIC = {
  lsl: (core, op) => ((core.r[low(op)] = lsl(core, core.r[middle(op)], imm5(op))), 1),
  lsr: (core, op) => ((core.r[low(op)] = lsr(core, core.r[middle(op)], imm5(op) || 32)), 1),
  asr: (core, op) => ((core.r[low(op)] = asr(core, core.r[middle(op)], imm5(op) || 32)), 1),
  addRegister: (core, op) => (
    (core.r[low(op)] = add(core, core.r[middle(op)], core.r[upper(op)], 0)),
    1
  ),
  subRegister: (core, op) => (
    (core.r[low(op)] = add(core, core.r[middle(op)], ~core.r[upper(op)], 1)),
    1
  ),
  addSmall: (core, op) => ((core.r[low(op)] = add(core, core.r[middle(op)], upper(op), 0)), 1),
  subSmall: (core, op) => ((core.r[low(op)] = add(core, core.r[middle(op)], ~upper(op), 1)), 1),
  mov: (core, op) => ((core.r[named(op)] = nz(core, op & 255)), 1),
  cmp: (core, op) => (add(core, core.r[named(op)], ~(op & 255), 1), 1),
  add: (core, op) => ((core.r[named(op)] = add(core, core.r[named(op)], op & 255, 0)), 1),
  sub: (core, op) => ((core.r[named(op)] = add(core, core.r[named(op)], ~(op & 255), 1)), 1),
};

/** Any register: 010001. */
const SPECIAL = {
  add: (core, op) => writeAny(core, high(op), core.operand(high(op)) + core.operand(source(op))),
  cmp: (core, op) => (add(core, core.operand(high(op)), ~core.operand(source(op)), 1), 1),
  mov: (core, op) => writeAny(core, high(op), core.operand(source(op))),
  bx: (core, op) => (core.branchTo(core.operand(source(op))), 2),
  blx: (core, op) => {
    const target = core.operand(source(op));
    core.r[14] = core.pc | 1;
    core.branchTo(target);
    return 2;
  },
};

function writeAny(core, register, value) {
  if (register === 15) {
    core.pc = value & ~1;
    return 2;
  }
  core.r[register] = register === 13 ? value & ~3 : value;
  return 1;
}

const adr = (core, op) => ((core.r[named(op)] = ((core.at + 4) & ~3) + 4 * (op & 255)), 1);
const addStack = (core, op) => ((core.r[named(op)] = core.r[13] + 4 * (op & 255)), 1);
const moveStack = (core, op) => ((core.r[13] += (op & 128 ? -4 : 4) * (op & 127)), 1);

/** Extensions and byte orders, by bits 11 to 6. */
const BYTES = {
  0b001000: (core, op) => ((core.r[low(op)] = (core.r[middle(op)] << 16) >> 16), 1),
  0b001001: (core, op) => ((core.r[low(op)] = (core.r[middle(op)] << 24) >> 24), 1),
  0b001010: (core, op) => ((core.r[low(op)] = core.r[middle(op)] & 0xffff), 1),
  0b001011: (core, op) => ((core.r[low(op)] = core.r[middle(op)] & 0xff), 1),
  0b101000: (core, op) => ((core.r[low(op)] = swapBytes(swapHalves(core.r[middle(op)]))), 1),
  0b101001: (core, op) => ((core.r[low(op)] = swapBytes(core.r[middle(op)])), 1),
  0b101011: (core, op) => ((core.r[low(op)] = (swapBytes(core.r[middle(op)]) << 16) >> 16), 1),
};
function swapBytes(word) {
  return ((word & 0x00ff00ff) << 8) | ((word >>> 8) & 0x00ff00ff);
}
function swapHalves(word) {
  return (word << 16) | (word >>> 16);
}

function branchShort(core, op) {
  core.pc = core.at + 4 + ((op << 24) >> 23);
  return 2;
}
/** B with a condition, by bits 11 to 8: EQ, NE, CS, CC, MI, PL, VS, VC, HI, LS, GE, LT, GT, LE. */
const BRANCHES = [
  (core, op) => (core.z === 0 ? branchShort(core, op) : 1),
  (core, op) => (core.z !== 0 ? branchShort(core, op) : 1),
  (core, op) => (core.c === 1 ? branchShort(core, op) : 1),
  (core, op) => (core.c === 0 ? branchShort(core, op) : 1),
  (core, op) => (core.n < 0 ? branchShort(core, op) : 1),
  (core, op) => (core.n >= 0 ? branchShort(core, op) : 1),
  (core, op) => (core.v === 1 ? branchShort(core, op) : 1),
  (core, op) => (core.v === 0 ? branchShort(core, op) : 1),
  (core, op) => (core.c === 1 && core.z !== 0 ? branchShort(core, op) : 1),
  (core, op) => (core.c === 0 || core.z === 0 ? branchShort(core, op) : 1),
  (core, op) => (core.n < 0 === (core.v === 1) ? branchShort(core, op) : 1),
  (core, op) => (core.n < 0 !== (core.v === 1) ? branchShort(core, op) : 1),
  (core, op) => (core.z !== 0 && core.n < 0 === (core.v === 1) ? branchShort(core, op) : 1),
  (core, op) => (core.z === 0 || core.n < 0 !== (core.v === 1) ? branchShort(core, op) : 1),
];
const branch = (core, op) => ((core.pc = core.at + 4 + ((op << 21) >> 20)), 2);

/** 32-bit instructions: BL, MRS, MSR, the barriers. */
function wide(core, op) {
  const second = core.bus.fetch(core.at + 2);
  core.pc = core.at + 4;
  if ((second & 0xd000) === 0xd000) {
    const s = (op >> 10) & 1;
    const i1 = 1 - (((second >> 13) & 1) ^ s);
    const i2 = 1 - (((second >> 11) & 1) ^ s);
    const offset =
      ((s ? -1 : 0) << 24) |
      (i1 << 23) |
      (i2 << 22) |
      ((op & 0x3ff) << 12) |
      ((second & 0x7ff) << 1);
    core.r[14] = core.pc | 1;
    core.pc += offset;
  } else if (op >> 4 === 0xf38 && second >> 8 === 0x88) {
    core.writeSpecial(second & 255, core.r[op & 15]);
  } else if (op === 0xf3ef && second >> 12 === 8) {
    core.r[(second >> 8) & 15] = core.readSpecial(second & 255);
  } else if (op !== 0xf3bf) {
    return undefinedInstruction(core);
  }
  return 3;
}

function undefinedInstruction(core) {
  core.hardFault('undefined instruction');
  return 1;
}

const supervisorCall = (core) => {
  core.pendingSVCall = true;
  core.interruptsUpdated = true;
  return 1;
};
/**
 * A breakpoint in the boot ROM calls a function of bootrom.mjs; elsewhere, without a debugger, it
 * is a HardFault.
 */
const breakpoint = (core, op) => {
  if (core.at < core.bus.romSize) return core.onRomCall(op & 255);
  core.hardFault('breakpoint');
  return 1;
};
const hint = (core, op) => {
  if (op === 0xbf40) core.eventRegistered = true;
  else if (op === 0xbf20) core.sleep(true);
  else if (op === 0xbf30) core.sleep(false);
  return op === 0xbf20 || op === 0xbf30 ? 2 : 1;
};
const maskInterrupts = (core, op) => (core.setPrimask(op & 16), 1);

function decodeMiscellaneous(op) {
  if (op >> 8 === 0xb0) return moveStack;
  if ((op & 0xfe00) === 0xb400) return push;
  if ((op & 0xfe00) === 0xbc00) return pop;
  if ((op & 0xffef) === 0xb662) return maskInterrupts;
  if (op >> 8 === 0xbe) return breakpoint;
  if ((op & 0xff0f) === 0xbf00) return hint;
  return BYTES[(op >> 6) & 63] ?? undefinedInstruction;
}

function decodeArithmetic(op) {
  const { lsl: l, lsr: r, asr: a, mov, cmp, add: plus, sub: minus } = ARITHMETIC;
  const three = [
    ARITHMETIC.addRegister,
    ARITHMETIC.subRegister,
    ARITHMETIC.addSmall,
    ARITHMETIC.subSmall,
  ];
  return [l, r, a, three[(op >> 9) & 3], mov, cmp, plus, minus][op >> 11];
}

function decodeSpecial(op) {
  const exchange = op & 128 ? SPECIAL.blx : SPECIAL.bx;
  return [SPECIAL.add, SPECIAL.cmp, SPECIAL.mov, exchange][(op >> 8) & 3];
}

/** By the highest four bits (A5.2). */
function decode(op) {
  switch (op >> 12) {
    case 0:
    case 1:
    case 2:
    case 3:
      return decodeArithmetic(op);
    case 4:
      if (op & 0x800) return loadLiteral;
      return op & 0x400 ? decodeSpecial(op) : DATA[(op >> 6) & 15];
    case 5:
      return BY_REGISTER[(op >> 9) & 7];
    case 6:
    case 7:
    case 8:
      return BY_IMMEDIATE[(op >> 11) - 12];
    case 9:
      return op & 0x800 ? loadStack : storeStack;
    case 10:
      return op & 0x800 ? addStack : adr;
    case 11:
      return decodeMiscellaneous(op);
    case 12:
      return op & 0x800 ? loadMultiple : storeMultiple;
    case 13:
      if (((op >> 8) & 15) === 15) return supervisorCall;
      return ((op >> 8) & 15) === 14 ? undefinedInstruction : BRANCHES[(op >> 8) & 15];
    case 14:
      return op & 0x800 ? undefinedInstruction : branch;
    default:
      return op & 0x800 ? undefinedInstruction : wide;
  }
}

/**
 * The functions, and the index of a function for each halfword: a small and a dense table that stay
 * in the cache.
 */
export const FUNCTIONS = [];
export const KINDS = Uint8Array.from({ length: 0x10000 }, (_, op) => {
  const operation = decode(op);
  const known = FUNCTIONS.indexOf(operation);
  return known >= 0 ? known : FUNCTIONS.push(operation) - 1;
});

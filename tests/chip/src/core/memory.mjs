// Loads and stores of ARMv6-M (reference manual A6.7), one function each, as in instructions.mjs.
// Each is written out, so that V8 compiles it separately: most instructions of a program are loads
// and stores.
//
// The cycles of a store are computed before the write, because the write may read the clock.

const low = (op) => op & 7;
const middle = (op) => (op >> 3) & 7;
const upper = (op) => (op >> 6) & 7;
const named = (op) => (op >> 8) & 7;
const imm5 = (op) => (op >> 6) & 31;
const READ = 3;
const WRITE = 4;

function loadWord(core, op) {
  const at = core.r[middle(op)] + imm5(op) * 4;
  core.r[low(op)] = core.bus.read32(at);
  return core.bus.cost(at, READ);
}

function storeWord(core, op) {
  const at = core.r[middle(op)] + imm5(op) * 4;
  const cycles = core.bus.cost(at, WRITE);
  core.bus.write32(at, core.r[low(op)]);
  return cycles;
}

function loadHalf(core, op) {
  const at = core.r[middle(op)] + imm5(op) * 2;
  core.r[low(op)] = core.bus.read16(at);
  return core.bus.cost(at, READ);
}

function storeHalf(core, op) {
  const at = core.r[middle(op)] + imm5(op) * 2;
  const cycles = core.bus.cost(at, WRITE);
  core.bus.write16(at, core.r[low(op)]);
  return cycles;
}

function loadByte(core, op) {
  const at = core.r[middle(op)] + imm5(op);
  core.r[low(op)] = core.bus.read8(at);
  return core.bus.cost(at, READ);
}

function storeByte(core, op) {
  const at = core.r[middle(op)] + imm5(op);
  const cycles = core.bus.cost(at, WRITE);
  core.bus.write8(at, core.r[low(op)]);
  return cycles;
}

function loadWordByRegister(core, op) {
  const at = core.r[middle(op)] + core.r[upper(op)];
  core.r[low(op)] = core.bus.read32(at);
  return core.bus.cost(at, READ);
}

function storeWordByRegister(core, op) {
  const at = core.r[middle(op)] + core.r[upper(op)];
  const cycles = core.bus.cost(at, WRITE);
  core.bus.write32(at, core.r[low(op)]);
  return cycles;
}

function loadHalfByRegister(core, op) {
  const at = core.r[middle(op)] + core.r[upper(op)];
  core.r[low(op)] = core.bus.read16(at);
  return core.bus.cost(at, READ);
}

function storeHalfByRegister(core, op) {
  const at = core.r[middle(op)] + core.r[upper(op)];
  const cycles = core.bus.cost(at, WRITE);
  core.bus.write16(at, core.r[low(op)]);
  return cycles;
}

function loadByteByRegister(core, op) {
  const at = core.r[middle(op)] + core.r[upper(op)];
  core.r[low(op)] = core.bus.read8(at);
  return core.bus.cost(at, READ);
}

function storeByteByRegister(core, op) {
  const at = core.r[middle(op)] + core.r[upper(op)];
  const cycles = core.bus.cost(at, WRITE);
  core.bus.write8(at, core.r[low(op)]);
  return cycles;
}

function loadSignedHalf(core, op) {
  const at = core.r[middle(op)] + core.r[upper(op)];
  core.r[low(op)] = (core.bus.read16(at) << 16) >> 16;
  return core.bus.cost(at, READ);
}

function loadSignedByte(core, op) {
  const at = core.r[middle(op)] + core.r[upper(op)];
  core.r[low(op)] = (core.bus.read8(at) << 24) >> 24;
  return core.bus.cost(at, READ);
}

/** By bits 11 to 9 of 0101. */
export const BY_REGISTER = [
  storeWordByRegister,
  storeHalfByRegister,
  storeByteByRegister,
  loadSignedByte,
  loadWordByRegister,
  loadHalfByRegister,
  loadByteByRegister,
  loadSignedHalf,
];
/** By bits 15 to 11, from 01100 on. */
export const BY_IMMEDIATE = [storeWord, loadWord, storeByte, loadByte, storeHalf, loadHalf];

export function loadLiteral(core, op) {
  const at = ((core.at + 4) & ~3) + 4 * (op & 255);
  core.r[named(op)] = core.bus.read32(at);
  return 2;
}

export function storeStack(core, op) {
  const at = core.r[13] + 4 * (op & 255);
  const cycles = core.bus.cost(at, WRITE);
  core.bus.write32(at, core.r[named(op)]);
  return cycles;
}

export function loadStack(core, op) {
  const at = core.r[13] + 4 * (op & 255);
  core.r[named(op)] = core.bus.read32(at);
  return core.bus.cost(at, READ);
}

export function push(core, op) {
  const { r, bus } = core;
  let count = op & 256 ? 1 : 0;
  for (let list = op & 255; list; list &= list - 1) count++;
  let at = r[13] - 4 * count;
  r[13] = at;
  for (let i = 0; i < 8; i++) {
    if (op & (1 << i)) {
      bus.write32(at, r[i]);
      at += 4;
    }
  }
  if (op & 256) bus.write32(at, r[14]);
  return 1 + count;
}

export function pop(core, op) {
  const { r, bus } = core;
  let at = r[13];
  let cycles = 1;
  for (let i = 0; i < 8; i++) {
    if (op & (1 << i)) {
      r[i] = bus.read32(at);
      at += 4;
      cycles++;
    }
  }
  if (!(op & 256)) {
    r[13] = at;
    return cycles;
  }
  const target = bus.read32(at);
  r[13] = at + 4;
  core.branchTo(target);
  return cycles + 3;
}

export function storeMultiple(core, op) {
  const { r, bus } = core;
  let at = r[named(op)];
  let cycles = 1;
  for (let i = 0; i < 8; i++) {
    if (op & (1 << i)) {
      bus.write32(at, r[i]);
      at += 4;
      cycles++;
    }
  }
  r[named(op)] = at;
  return cycles;
}

export function loadMultiple(core, op) {
  const { r, bus } = core;
  let at = r[named(op)];
  let cycles = 1;
  for (let i = 0; i < 8; i++) {
    if (op & (1 << i)) {
      r[i] = bus.read32(at);
      at += 4;
      cycles++;
    }
  }
  if (!(op & (1 << named(op)))) r[named(op)] = at;
  return cycles;
}

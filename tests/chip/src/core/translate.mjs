// Translation of straight pieces of code to JavaScript: the effect of each instruction's function,
// without its lookup and without flags that no instruction reads. The result equals that of
// instructions.mjs, to the cycle. An instruction that is not here ends a piece and is left to it.
//
// A piece runs only if all its instructions start before the clock's horizon. SRAM is accessed
// directly; any other access is made at its own cycle and ends the piece, because its effect may be
// an event. A store into translated code is such an access: the bus then discards its translations
// of SRAM.
import { linesOf } from './cache.mjs';
import { KINDS } from './instructions.mjs';

const SRAM = 0x20000000;
const LONGEST = 32;

/** Flag set-up by an addition of `a`, `b` and `carry` (JavaScript texts); `to` gets the sum. */
const sum = (a, b, carry, to) => ({
  full: `a = ${a}; b = ${b}; w = (a >>> 0) + (b >>> 0) + ${carry}; t = w | 0;
    core.c = w > 0xffffffff ? 1 : 0; core.v = ((a ^ t) & (b ^ t)) >>> 31;
    core.n = core.z = t; ${to ? `${to} = t;` : ''}`,
  bare: to ? `${to} = ${a} + ${b} + ${carry};` : '',
  kills: true,
});
/** A result that sets N and Z, and C by `carry` if given. */
const result = (value, to, carry = '') => ({
  full: `${carry} t = ${value}; core.n = core.z = t; ${to ? `${to} = t;` : ''}`,
  bare: `${carry} ${to ? `${to} = ${value};` : ''}`,
});
const plain = (code) => ({ full: code, bare: code, flagless: true });

function shiftImmediate(op, d, m) {
  const n = (op >> 6) & 31;
  const value = `r[${m}]`;
  if (op >> 11 === 0)
    return n === 0
      ? result(value, d)
      : result(`${value} << ${n}`, d, `core.c = (${value} >>> ${32 - n}) & 1;`);
  const by = n || 32;
  const carry = `core.c = (${value} >>> ${by - 1}) & 1;`;
  if (op >> 11 === 1) return result(by === 32 ? '0' : `(${value} >>> ${by}) | 0`, d, carry);
  return result(`${value} >> ${Math.min(by, 31)}`, d, carry);
}

function arithmetic(op) {
  const [d, m, n] = [op & 7, (op >> 3) & 7, (op >> 6) & 7].map((i) => `r[${i}]`);
  const named = `r[${(op >> 8) & 7}]`;
  const imm = op & 255;
  switch (op >> 11) {
    case 0:
    case 1:
    case 2:
      return shiftImmediate(op, d, (op >> 3) & 7);
    case 3: {
      const operand = op & 0x400 ? `${(op >> 6) & 7}` : n;
      return op & 0x200 ? sum(m, `~${operand}`, 1, d) : sum(m, operand, 0, d);
    }
    case 4:
      return result(`${imm}`, named);
    case 5:
      return sum(named, `${~imm}`, 1, null);
    case 6:
      return sum(named, `${imm}`, 0, named);
    default:
      return sum(named, `${~imm}`, 1, named);
  }
}

/** Register-register operations, except for shifts by a register. */
function data(op) {
  const [d, m] = [`r[${op & 7}]`, `r[${(op >> 3) & 7}]`];
  switch ((op >> 6) & 15) {
    case 0:
      return result(`${d} & ${m}`, d);
    case 1:
      return result(`${d} ^ ${m}`, d);
    case 5:
      return { ...sum(d, m, 'core.c', d), reads: true };
    case 6:
      return { ...sum(d, `~${m}`, 'core.c', d), reads: true };
    case 8:
      return result(`${d} & ${m}`, null);
    case 9:
      return sum('0', `~${m}`, 1, d);
    case 10:
      return sum(d, `~${m}`, 1, null);
    case 11:
      return sum(d, m, 0, null);
    case 12:
      return result(`${d} | ${m}`, d);
    case 13:
      return result(`Math.imul(${d}, ${m})`, d);
    case 14:
      return result(`${d} & ~${m}`, d);
    case 15:
      return result(`~${m}`, d);
    default:
      return { ...plain(`F[${KINDS[op]}](core, ${op});`), reads: true, flagless: false };
  }
}

function special(op, at) {
  const [to, from] = [((op >> 4) & 8) | (op & 7), (op >> 3) & 15];
  const kind = (op >> 8) & 3;
  if (kind === 3 || to === 15 || (kind === 1 && from === 15)) return null;
  const value = from === 15 ? `${at + 4}` : `r[${from}]`;
  if (kind === 1) return sum(`r[${to}]`, `~${value}`, 1, null);
  const moved = kind === 0 ? `r[${to}] + ${value}` : value;
  return plain(`r[${to}] = ${to === 13 ? `(${moved}) & ~3` : moved};`);
}

const VIEWS = {
  4: ['sram32', 2, 'read32', 'write32'],
  2: ['sram16', 1, 'read16', 'write16'],
  1: ['sram8', 0, 'read8', 'write8'],
};

/** A load or store of `width` bytes; `extend` is the number of bits to sign-extend by. */
function access(stores, width, address, register, extend = 0) {
  const [view, shift, read, write] = VIEWS[width];
  const signed = (text) => (extend ? `(${text} << ${extend}) >> ${extend}` : text);
  const slow = stores
    ? `{ const cost = bus.cost(a, 4); bus.${write}(a, r[${register}]); return cost; }`
    : `{ r[${register}] = ${signed(`bus.${read}(a)`)}; return bus.cost(a, 3); }`;
  const cell = `bus.${view}[(a - ${SRAM}) >> ${shift}]`;
  const inSram = `a - ${SRAM} >>> 0 < bus.sramSize && !(a & ${width - 1})`;
  return {
    memory: true,
    address,
    test: stores ? `${inSram} && !bus.code[(a - ${SRAM}) >> 2]` : inSram,
    fast: stores ? `${cell} = r[${register}];` : `r[${register}] = ${signed(cell)};`,
    slow,
  };
}

function transfer(op) {
  const [d, m] = [op & 7, `r[${(op >> 3) & 7}]`];
  if (op >> 12 === 5) {
    const address = `(${m} + r[${(op >> 6) & 7}]) | 0`;
    const [stores, width, extend] = [
      [true, 4],
      [true, 2],
      [true, 1],
      [false, 1, 24],
      [false, 4],
      [false, 2],
      [false, 1],
      [false, 2, 16],
    ][(op >> 9) & 7];
    return access(stores, width, address, d, extend);
  }
  if (op >> 12 === 9)
    return access(!(op & 0x800), 4, `(r[13] + ${4 * (op & 255)}) | 0`, (op >> 8) & 7);
  const width = { 6: 4, 7: 1, 8: 2 }[op >> 12];
  return access(!(op & 0x800), width, `(${m} + ${((op >> 6) & 31) * width}) | 0`, d);
}

/** PUSH, and POP without the program counter. */
function stack(op) {
  const list = [0, 1, 2, 3, 4, 5, 6, 7].filter((i) => op & (1 << i));
  const pushes = !(op & 0x800);
  if (pushes && op & 256) list.push(14);
  const size = 4 * list.length;
  const overCode = `(bus.code[(a - ${SRAM}) >> 2] | bus.code[(r[13] - ${SRAM + 4}) >> 2])`;
  const cells = list
    .map((i, k) => (pushes ? `bus.sram32[w + ${k}] = r[${i}];` : `r[${i}] = bus.sram32[w + ${k}];`))
    .join(' ');
  return {
    memory: true,
    cycles: 1 + list.length,
    address: pushes ? `(r[13] - ${size}) | 0` : 'r[13]',
    test: `a - ${SRAM} >>> 0 <= bus.sramSize - ${size}${pushes ? ` && !${overCode}` : ''}`,
    fast: `w = (a - ${SRAM}) >> 2; ${cells} r[13] = ${pushes ? 'a' : `a + ${size}`};`,
    slow: `return F[${KINDS[op]}](core, ${op});`,
  };
}

/** Returns an instruction's text and properties, or null if a piece ends before it. */
function translateOne(op, at, bus) {
  switch (op >> 12) {
    case 0:
    case 1:
    case 2:
    case 3:
      return arithmetic(op);
    case 4:
      if (op & 0x800) return literal(op, at, bus);
      return op & 0x400 ? special(op, at) : data(op);
    case 5:
    case 6:
    case 7:
    case 8:
    case 9:
      return transfer(op);
    case 10:
      return plain(
        `r[${(op >> 8) & 7}] = ${op & 0x800 ? 'r[13]' : (at + 4) & ~3} + ${4 * (op & 255)};`,
      );
    case 11:
      if (op >> 8 === 0xb0) return plain(`r[13] += ${(op & 128 ? -4 : 4) * (op & 127)};`);
      if ((op & 0xfe00) === 0xb400 || (op & 0xff00) === 0xbc00) return stack(op);
      return (op & 0xff00) === 0xb200 ? plain(`F[${KINDS[op]}](core, ${op});`) : null;
    default:
      return null;
  }
}

/** A literal in the same memory as the code is as constant as the code. */
function literal(op, at, bus) {
  const from = ((at + 4) & ~3) + 4 * (op & 255);
  if (from >>> 24 !== at >>> 24) return null;
  const value = bus.codeAt(from) | (bus.codeAt(from + 2) << 16);
  return { ...plain(`r[${(op >> 8) & 7}] = ${value};`), cycles: 2, literal: from };
}

/** The end of a piece: a branch, a call or a return. */
const ends = (op) =>
  (op >> 12 === 13 && ((op >> 8) & 15) < 14) ||
  op >> 11 === 28 ||
  op >> 11 === 30 ||
  (op & 0xff00) === 0xbd00 ||
  (op & 0xff00) === 0x4700;

/** B with a condition, by bits 11 to 8: whether it branches (instructions.mjs, BRANCHES). */
const CONDITIONS = [
  'core.z === 0',
  'core.z !== 0',
  'core.c === 1',
  'core.c === 0',
  'core.n < 0',
  'core.n >= 0',
  'core.v === 1',
  'core.v === 0',
  'core.c === 1 && core.z !== 0',
  'core.c === 0 || core.z === 0',
  'core.n < 0 === (core.v === 1)',
  'core.n < 0 !== (core.v === 1)',
  'core.z !== 0 && core.n < 0 === (core.v === 1)',
  'core.z === 0 || core.n < 0 !== (core.v === 1)',
];

/** Returns the text of a piece's last instruction, which returns the cycles of the piece. */
function end(op, at, before) {
  if (op >> 12 === 13) {
    const taken = `core.pc = ${at + 4 + ((op << 24) >> 23)}; return ${before + 2};`;
    return `if (${CONDITIONS[(op >> 8) & 15]}) { ${taken} } return ${before + 1};`;
  }
  if (op >> 11 === 28) return `core.pc = ${at + 4 + ((op << 21) >> 20)}; return ${before + 2};`;
  return `return ${before} + F[${KINDS[op]}](core, ${op});`;
}

/** Marks instructions whose flags are set again before they are read. */
function findDeadFlags(parts) {
  let live = true;
  for (const part of [...parts].reverse()) {
    if (part.memory || part.reads) live = true;
    else if (!part.flagless) {
      part.dead = !live && !part.reads;
      if (part.kills) live = false;
    }
  }
}

/** Collects the instructions of the piece at `start`. */
function collect(bus, start) {
  const parts = [];
  for (let at = start; parts.length < LONGEST && bus.isCode(at + 2); at += 2) {
    const op = bus.codeAt(at);
    if (ends(op)) {
      parts.push({ at, op, last: true, cycles: 0, reads: true });
      break;
    }
    const part = translateOne(op, at, bus);
    if (part === null) break;
    parts.push({ cycles: part.memory ? 2 : 1, ...part, at, op });
  }
  return parts;
}

/**
 * Translates the piece of code at an address. Returns { run(core, bus, clock, r, F), reach, lines,
 * seen }, or null if the piece is too short.
 * `run` returns the cycles to add to the clock; `reach` is the cycle, from the start, at which the
 * last instruction starts. `lines` are those of the cache that the piece is in, null in SRAM; they
 * were all there when the cache had changed `seen` times.
 */
export function translate(bus, start) {
  const parts = collect(bus, start);
  if (parts.length < 2) return null;
  for (const { at, literal: from } of parts) {
    bus.markCode(at);
    bus.markCode(at + 2);
    if (from !== undefined) bus.markCode(from);
  }
  findDeadFlags(parts);
  let spent = 0;
  let reach = 0;
  const lines = parts.map((part, i) => {
    const { at, op } = part;
    reach = spent;
    const here = `core.at = ${at}; core.pc = ${at + 2}; core.instructions += ${i + 1};`;
    const before = spent;
    spent += part.cycles;
    if (part.last) return `${here} ${end(op, at, before)}`;
    if (part.memory) {
      const slow = `${here} clock.now += ${before}; ${part.slow}`;
      return `a = ${part.address}; if (${part.test}) { ${part.fast} } else { ${slow} }`;
    }
    return part.dead ? part.bare : part.full;
  });
  const { at, last } = parts.at(-1);
  if (!last) {
    const done = `core.at = ${at}; core.pc = ${at + 2}; core.instructions += ${parts.length};`;
    lines.push(`${done} return ${spent};`);
  }
  const run = compile(lines.join('\n'));
  return { run, reach, lines: start < SRAM ? linesOf(addressesOf(parts)) : null, seen: -1 };
}

/** Returns the addresses of a piece's halfwords and literals. */
const addressesOf = (parts) =>
  parts.flatMap(({ at, op, literal }) => [
    at,
    ...(op >> 11 === 30 ? [at + 2] : []),
    ...(literal === undefined ? [] : [literal]),
  ]);

/**
 * Functions by their text: the same code in another chip, or after a reset, is not compiled again.
 */
const COMPILED = new Map();

function compile(body) {
  const known = COMPILED.get(body);
  if (known) return known;
  const run = new Function('core', 'bus', 'clock', 'r', 'F', `let a, b, t, w;\n${body}`);
  COMPILED.set(body, run);
  return run;
}

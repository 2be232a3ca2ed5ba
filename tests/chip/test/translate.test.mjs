// Tests of translated code against single instructions: the same registers, flags, memory and
// cycles.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { MS, Program, random, TIMER, US } from './support.mjs';

const RAM = 0x20000400;
const ROUNDS = 60;

/**
 * Returns an instruction that does not change r6 (rounds) and r7 (memory), and sometimes reads the
 * timer through r8.
 */
function anyInstruction(next) {
  const pick = (list) => list[next() % list.length];
  const [d, m, n, five] = [next() % 6, next() % 8, next() % 8, next() % 32];
  switch (next() % 10) {
    case 0:
      return [((next() % 3) << 11) | (five << 6) | (m << 3) | d];
    case 1:
      return [0x1800 | ((next() % 4) << 9) | (n << 6) | (m << 3) | d];
    case 2:
      return [0x2000 | ((next() % 4) << 11) | (d << 8) | (next() % 256)];
    case 3:
    case 4:
      return [0x4000 | ((next() % 16) << 6) | (m << 3) | d];
    case 5:
      return [pick([0x6000, 0x6800, 0x7000, 0x7800, 0x8000, 0x8800]) | (five << 6) | (7 << 3) | d];
    case 6:
      return [pick([0xb200, 0xb240, 0xb280, 0xb2c0, 0xba00, 0xba40, 0xbac0]) | (m << 3) | d];
    case 7:
      return pick([
        [0xb43f, 0xbc3f],
        [0xb510, 0xb001],
        [0x9000 | (d << 8)],
        [0x9800 | (d << 8)],
        [0xa800 | (d << 8)],
        [0xa000 | (d << 8) | five],
      ]).concat([0xb000]);
    case 8:
      return pick([
        [0x4644, 0x6aa3],
        [0x4644, 0x63a3],
        [0x4600 | (m << 3) | d],
        [0x4480 | (m << 3) | 1],
        [0x4580 | (m << 3)],
        [0x463d, 0x5deb, 0x57ea],
      ]);
    default:
      // A branch over one instruction, so that pieces end and flags are read.
      return [0xd000 | ((next() % 14) << 8), 0x3001 | (d << 8)];
  }
}

function anyProgram(seed) {
  const next = random(seed);
  // r8 = TIMER; sub sp, #16
  const program = new Program().load(0, TIMER).raw(0x4680).load(7, RAM).load(6, ROUNDS).raw(0xb084);
  program.label('loop');
  for (let i = 0; i < 40; i++) program.raw(...anyInstruction(next));
  // BL over nothing, and back with a decision on r6.
  return program.raw(0xf000, 0xf800, 0x3e01).jump('loop', 1).sleep();
}

function outcome(chip) {
  const { core } = chip;
  return {
    registers: [...core.r],
    flags: core.xpsr,
    fault: core.fault,
    slept: chip.sleepCycles,
    instructions: core.instructions,
    memory: Buffer.from(chip.peek(RAM, 256)).toString('hex'),
    stack: Buffer.from(chip.peek(0x20041e00, 512)).toString('hex'),
  };
}

test('translated random programs are equal, for any division into steps', () => {
  let translated = 0;
  for (let seed = 1; seed <= 150; seed++) {
    const [plain, fast] = [anyProgram(seed * 7919).chip(), anyProgram(seed * 7919).chip()];
    plain.bus.pieceAt = () => null;
    fast.bus.often = 20;
    plain.runFor(MS);
    for (let i = 0; i < 500; i++) fast.runFor(2 * US);
    assert.deepEqual(outcome(fast), outcome(plain), `seed ${seed}`);
    translated += fast.bus.pieces.filter((piece) => piece).length;
  }
  assert.ok(translated > 1000, `${translated} pieces`);
});

test('code in SRAM is translated again after a write over it', () => {
  // A function in SRAM: movs r0, #n; adds r1, r1, r0; bx lr. It is called a hundred times, then n
  // is changed, and again.
  const CODE = 0x20003000;
  const program = new Program().load(4, CODE + 1).raw(0x2100);
  for (const n of [1, 2]) {
    program
      .load(2, CODE)
      .load(3, 0x2000 | n)
      .raw(0x8013)
      .raw(0x2564)
      .label(`loop${n}`)
      .raw(0x47a0, 0x3d01)
      .jump(`loop${n}`, 1);
  }
  const chip = program.sleep().chip();
  chip.bus.often = 20;
  chip.poke(CODE, [0, 0, 0x09, 0x18, 0x70, 0x47]);
  chip.poke(CODE + 2, [0x09, 0x18]);
  chip.runFor(MS);
  assert.equal(chip.core.r[1], 100 + 200);
  assert.ok(chip.bus.pieceAt(CODE), 'translated');
});

test('a faulting access within translated code faults at its instruction', () => {
  // Reads at increasing addresses, beyond the end of memory.
  const program = new Program()
    .load(1, 0x20041f80)
    .label('loop')
    .raw(0x2005, 0x680a, 0x2006, 0x3104)
    .jump('loop');
  const run = (translates) => {
    const chip = program.chip();
    if (!translates) chip.bus.pieceAt = () => null;
    chip.runFor(MS);
    return {
      fault: chip.core.fault,
      r0: chip.core.r[0],
      slept: chip.sleepCycles,
      locked: chip.core.lockedUp,
    };
  };
  const faulted = run(true);
  assert.equal(faulted.fault.kind, 'bus fault');
  assert.equal(faulted.r0, 5, 'what comes before it is done, what comes after it is not');
  assert.deepEqual(faulted, run(false));
});

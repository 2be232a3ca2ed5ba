// A substitute for the boot ROM: the function table in which firmware looks up its flash and memory
// functions (RP2040 datasheet 2.8.3).
//
// rp2040js has no boot ROM, and the real one is Raspberry Pi's. Each function here is `bkpt #n; bx
// lr` at its address. This file executes the breakpoint, which takes as long as the flash does. A
// lookup of an unknown function returns 0, as on the chip; the real ROM's floating-point functions
// are missing.
import { FAULT } from './core/bus.mjs';

const LOOKUP = 0x20;
const FUNCTION_TABLE = 0x40;
const DATA_TABLE = 0xc0;
const CODE = 0x200;
const BKPT = 0xbe00;
const BX_LR = 0x4770;
const LOOKUP_CALL = 0xff;
const CALL_CYCLES = 10;
/** Address of the boot over USB, for the watchdog's scratch registers. */
export const USB_BOOT = 0x101;
const LEAVING_MS = 10;

const copy = (chip, [to, from, length]) => {
  for (let i = 0; i < length >>> 0; i++) chip.bus.write8(to + i, chip.bus.read8(from + i));
  return CALL_CYCLES + (length >>> 0);
};
const fill = (chip, [to, byte, length]) => {
  for (let i = 0; i < length >>> 0; i++) chip.bus.write8(to + i, byte);
  return CALL_CYCLES + (length >>> 0);
};
const leaveXip = (chip) => {
  chip.bus.flashReadable = false;
  return CALL_CYCLES;
};
const flushCache = (chip) => {
  chip.bus.cache.flush();
  return CALL_CYCLES;
};
const enterXip = (chip) => {
  chip.bus.flashReadable = true;
  return CALL_CYCLES;
};
const count = (bits) => {
  let n = 0;
  for (let left = bits >>> 0; left; left = (left & (left - 1)) >>> 0) n++;
  return n;
};
const pure =
  (result) =>
  (chip, [a]) => {
    chip.core.r[0] = result(a);
    return CALL_CYCLES;
  };
const reverse = (word) =>
  Number.parseInt((word >>> 0).toString(2).padStart(32, '0').split('').reverse().join(''), 2);


/**
 * reset_to_usb_boot: its arguments and the address of the USB boot go to scratch registers, and the
 * watchdog resets the chip. The processor waits until then, with its interrupts as they are.
 */
function resetToUsbBoot(chip, [mask, interfaces]) {
  const { core, clock, watchdog } = chip;
  if (!chip.isLeaving) {
    chip.isLeaving = true;
    watchdog.scratch[0] = mask;
    watchdog.scratch[1] = interfaces;
    watchdog.reboot(USB_BOOT, LEAVING_MS);
  }
  core.pc = core.at;
  return Math.max(1, clock.horizon - clock.now);
}

/** Functions by their two-letter names (datasheet 2.8.3.1). Each returns its cycles. */
const FUNCTIONS = {
  IF: () => CALL_CYCLES, // connect_internal_flash
  EX: leaveXip, // flash_exit_xip
  RE: (chip, [offset, length]) => write(chip, offset, length), // flash_range_erase
  RP: (chip, [offset, data, length]) => write(chip, offset, length, data), // flash_range_program
  FC: flushCache, // flash_flush_cache
  CX: enterXip, // flash_enter_cmd_xip
  UB: resetToUsbBoot,
  MC: copy, // memcpy
  C4: copy, // memcpy44
  MS: fill, // memset
  S4: fill, // memset4
  P3: pure(count), // popcount32
  R3: pure(reverse), // reverse32
  L3: pure(Math.clz32), // clz32
  T3: pure((word) => (word === 0 ? 32 : 31 - Math.clz32(word & -word))), // ctz32
};

/** Erases or programs. The processor stays at its breakpoint in the ROM until the flash is done. */
function write(chip, offset, length, from) {
  const { flash, core, clock } = chip;
  if (chip.bus.flashReadable)
    throw new Error(
      'a flash function was called with flash still mapped: flash_exit_xip comes first',
    );
  if (!flash.busy) {
    const data =
      from === undefined
        ? undefined
        : Uint8Array.from({ length }, (_, i) => chip.bus.read8(from + i));
    flash.begin(offset, length, data, chip.cycles);
  }
  const left = flash.work(chip.cycles);
  if (left > 0) {
    core.pc = core.at;
    return Math.max(1, Math.min(left, clock.horizon - clock.now));
  }
  chip.mcu.flash.set(flash.bytes);
  chip.bus.flashChanged();
  return CALL_CYCLES;
}

/** Writes the ROM into `chip.mcu.bootrom`, and executes its functions. */
export function installBootrom(chip) {
  const rom = new DataView(chip.mcu.bootrom.buffer);
  const names = Object.keys(FUNCTIONS);
  // 0x10: "Mu", 1, version; then half-word pointers to the tables and to the lookup function.
  [0x4d, 0x75, 0x01, 0x03].forEach((byte, i) => rom.setUint8(0x10 + i, byte));
  [FUNCTION_TABLE, DATA_TABLE, LOOKUP | 1].forEach((pointer, i) =>
    rom.setUint16(0x14 + 2 * i, pointer, true),
  );
  const stub = (address, call) => {
    rom.setUint16(address, BKPT | call, true);
    rom.setUint16(address + 2, BX_LR, true);
  };
  stub(LOOKUP, LOOKUP_CALL);
  const letters = (name) => name.charCodeAt(0) | (name.charCodeAt(1) << 8);
  names.forEach((name, i) => {
    stub(CODE + 4 * i, i);
    rom.setUint16(FUNCTION_TABLE + 4 * i, letters(name), true);
    rom.setUint16(FUNCTION_TABLE + 4 * i + 2, (CODE + 4 * i) | 1, true);
  });
  const { core } = chip;
  core.onRomCall = (call) => {
    if (call < names.length) return FUNCTIONS[names[call]](chip, core.r);
    if (call !== LOOKUP_CALL) throw FAULT;
    const wanted = core.r[1] & 0xffff;
    const found = names.findIndex((name) => letters(name) === wanted);
    core.r[0] = core.r[0] === FUNCTION_TABLE && found >= 0 ? (CODE + 4 * found) | 1 : 0;
    return CALL_CYCLES;
  };
}

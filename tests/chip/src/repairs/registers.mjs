// Registers that firmware only expects to exist.
//
// Defects of rp2040js 1.4.1: XIP_CTRL is missing; ROSC and VREG_AND_CHIP_RESET return 0xffffffff,
// which means an unstable oscillator and every reset cause at once; RESET_DONE never shows a
// peripheral in reset.

/**
 * A block of plain registers: a read returns the last write; `fixed` has the values that the chip
 * sets.
 */
export class Registers {
  constructor(values = {}, fixed = {}) {
    this.values = values;
    this.fixed = fixed;
  }

  readUint32(offset) {
    const fixed = this.fixed[offset];
    if (fixed !== undefined) return (typeof fixed === 'function' ? fixed() : fixed) >>> 0;
    return (this.values[offset] ?? 0) >>> 0;
  }

  writeUint32Atomic(offset, value, alias) {
    const old = this.values[offset] ?? 0;
    this.values[offset] = [value, old ^ value, old | value, old & ~value][alias] >>> 0;
  }
}

const XIP_CTRL = 0x14000;
const RESETS = 0x4000c;
const ROSC = 0x40060;
const VREG_AND_CHIP_RESET = 0x40064;
const IO_QSPI = 0x40018;
const RESETS_ALL = 0x1ffffff;
/** CHIP_RESET (datasheet 2.11.5): the cause of the last reset of the chip. */
const CHIP_RESET = 0x08;
const HAD = { power: 1 << 8, run: 1 << 16 };

/**
 * @param {'power' | 'run'} cause of the last reset of the whole chip; a watchdog reset does not
 * change it
 * @param {Record<number, number>} held values of RESETS, which a reset of the processor alone
 * keeps; otherwise all peripherals are in reset
 * @param {(bits: number) => void} onReset called with the peripherals that are put into reset
 * @returns the values of RESETS
 */
export function installRegisters(mcu, cause, held = { 0x00: RESETS_ALL }, onReset = () => {}) {
  // XIP_CTRL (2.6.3): cache on; FLUSH reads as done; STAT: FIFO empty, flush ready; no stream is
  // running.
  mcu.peripherals[XIP_CTRL] = new Registers({ 0x00: 3 }, { 0x04: 0, 0x08: 3, 0x18: 0, 0x1c: 0 });
  // ROSC (2.17.8): STATUS is stable and enabled; RANDOMBIT is not random here, so that two runs are
  // the same.
  mcu.peripherals[ROSC] = new Registers(
    { 0x00: 0xfab000 },
    { 0x18: (1 << 31) | (1 << 12), 0x1c: 1 },
  );
  mcu.peripherals[VREG_AND_CHIP_RESET] = new Registers(
    { 0x00: 0xb1, 0x04: 0x91 },
    { [CHIP_RESET]: HAD[cause] },
  );
  // The pins of the flash have no selectable function (2.19.6.2).
  mcu.peripherals[IO_QSPI] = new Registers();
  const resets = new Registers(held);
  resets.fixed[0x08] = () => RESETS_ALL & ~resets.values[0x00];
  const write = resets.writeUint32Atomic.bind(resets);
  resets.writeUint32Atomic = (offset, value, alias) => {
    const before = resets.values[0x00];
    write(offset, value, alias);
    const bits = resets.values[0x00] & ~before;
    if (offset === 0x00 && bits !== 0) onReset(bits);
  };
  mcu.peripherals[RESETS] = resets;
  return resets.values;
}

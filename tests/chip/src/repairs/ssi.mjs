// The serial interface to the flash (datasheet 4.10), as far as it decides whether flash is
// readable as memory, how long a line of the cache takes, and the one command that reads something
// else: the flash's unique number.
//
// Defect of rp2040js 1.4.1: flash is readable for all settings of these registers, at once. On the
// chip it is readable while the interface is enabled and set to send an address and then read
// (TMOD = 3); commands to the flash use other settings. The second boot stage makes flash readable
// in this way, and firmware runs it again from RAM after it has written flash. The data register is
// a number that never changes; the answer to a command is not in it.

const SSI = 0x18000;
const CTRLR0 = 0x00;
const CTRLR1 = 0x04;
const SSIENR = 0x08;
const BAUDR = 0x14;
const SR = 0x28;
const DR0 = 0x60;
const SPI_CTRLR0 = 0xf4;
/** Bit of SR: bytes were received. */
const RFNE = 8;
/** Instruction of the flash: after four bytes of no meaning, its unique number (W25Q16JV, 8.2). */
const READ_UNIQUE_ID = 0x4b;
const DUMMY_BYTES = 4;
/** Settings of the boot ROM: 32 bits, address and then read; enabled. */
const READING = { [CTRLR0]: 0x001f0300, [SSIENR]: 1 };
/** Bits of a line of the cache. */
const LINE = 64;

/**
 * Returns the clocks of clk_sys in which a line is transferred: the instruction, the address with
 * its mode bits, the wait cycles and the data, times the divider (datasheet 4.10.13:
 * CTRLR0.SPI_FRF, SPI_CTRLR0, BAUDR).
 */
function transferCycles(ssi) {
  const settings = ssi.readUint32(SPI_CTRLR0);
  const width = 1 << ((ssi.readUint32(CTRLR0) >>> 21) & 3);
  const [kind, wait] = [settings & 3, (settings >>> 11) & 31];
  const instruction = [0, 4, 8, 16][(settings >>> 8) & 3] / (kind === 2 ? width : 1);
  const address = (4 * ((settings >>> 2) & 15)) / (kind === 0 ? 1 : width);
  return (instruction + address + wait + LINE / width) * ssi.readUint32(BAUDR);
}

export function repairSsi(mcu, bus, hasCache, id) {
  const ssi = mcu.peripherals[SSI];
  const write = ssi.writeUint32.bind(ssi);
  const read = ssi.readUint32.bind(ssi);
  /** Bytes that the flash has sent; null while no command of this file is under way. */
  let received = null;
  const readsOnly = () => (read(SSIENR) & 1) === 1 && ((read(CTRLR0) >> 8) & 3) === 3;
  for (const [offset, value] of Object.entries(READING)) write(Number(offset), value);
  ssi.writeUint32 = (offset, value) => {
    write(offset, value);
    if (offset === SSIENR) {
      received = null;
      bus.flashReadable = readsOnly();
      if (bus.flashReadable && hasCache) bus.cache.missCycles = transferCycles(ssi);
    } else if (offset === DR0 && (value & 0xff) === READ_UNIQUE_ID && readsOnly()) {
      const answer = [...new Array(DUMMY_BYTES).fill(0xff), ...id];
      received = answer.slice(0, (read(CTRLR1) & 0xffff) + 1);
    }
  };
  ssi.readUint32 = (offset) => {
    if (received !== null && offset === DR0) return received.shift() ?? 0;
    if (received?.length === 0 && offset === SR) return read(SR) & ~RFNE;
    return read(offset);
  };
}

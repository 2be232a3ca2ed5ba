// The serial interface to the flash (datasheet 4.10), as far as it decides whether flash is
// readable as memory, and how long a line of the cache takes.
//
// Defect of rp2040js 1.4.1: flash is readable for all settings of these registers, at once. On the
// chip it is readable while the interface is enabled and set to send an address and then read
// (TMOD = 3); commands to the flash use other settings. The second boot stage makes flash readable
// in this way, and firmware runs it again from RAM after it has written flash.

const SSI = 0x18000;
const CTRLR0 = 0x00;
const SSIENR = 0x08;
const BAUDR = 0x14;
const SPI_CTRLR0 = 0xf4;
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

export function repairSsi(mcu, bus, hasCache) {
  const ssi = mcu.peripherals[SSI];
  const write = ssi.writeUint32.bind(ssi);
  for (const [offset, value] of Object.entries(READING)) write(Number(offset), value);
  ssi.writeUint32 = (offset, value) => {
    write(offset, value);
    if (offset !== SSIENR) return;
    bus.flashReadable = (value & 1) === 1 && ((ssi.readUint32(CTRLR0) >> 8) & 3) === 3;
    if (bus.flashReadable && hasCache) bus.cache.missCycles = transferCycles(ssi);
  };
}

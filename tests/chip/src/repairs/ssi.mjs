// The serial interface to the flash (datasheet 4.10), as far as it decides whether flash is
// readable as memory.
//
// Defect of rp2040js 1.4.1: flash is readable for all settings of these registers. On the chip it
// is readable while the interface is enabled and set to send an address and then read (TMOD = 3);
// commands to the flash use other settings. A second boot stage makes flash readable in this way,
// and firmware runs it again from RAM after it has written flash.

const SSI = 0x18000;
const CTRLR0 = 0x00;
const SSIENR = 0x08;
/** Settings after the second stage: quad, 32 bits, address and then read; enabled. */
const READING = { [CTRLR0]: 0x005f0300, [SSIENR]: 1 };

export function repairSsi(mcu, bus) {
  const ssi = mcu.peripherals[SSI];
  const write = ssi.writeUint32.bind(ssi);
  for (const [offset, value] of Object.entries(READING)) write(Number(offset), value);
  ssi.writeUint32 = (offset, value) => {
    write(offset, value);
    if (offset === SSIENR)
      bus.flashReadable = (value & 1) === 1 && ((ssi.readUint32(CTRLR0) >> 8) & 3) === 3;
  };
}

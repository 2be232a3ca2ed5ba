// The serial interface to the flash (datasheet 4.10), as far as it decides whether flash can be read as memory.
//
// What is wrong in rp2040js 1.4.1: flash is memory whatever these registers say. On the chip it is while the interface is enabled and set
// to send an address and then read (TMOD = 3); commands to the flash are sent with it set otherwise. That is how a second boot stage
// makes flash readable, which firmware runs again from RAM after it has written flash.

const SSI = 0x18000;
const CTRLR0 = 0x00;
const SSIENR = 0x08;
/** As the second stage leaves them: quad, 32 bits, address and then read; enabled. */
const READING = { [CTRLR0]: 0x005f0300, [SSIENR]: 1 };

export function repairSsi(mcu, bus) {
  const ssi = mcu.peripherals[SSI];
  const write = ssi.writeUint32.bind(ssi);
  for (const [offset, value] of Object.entries(READING)) write(Number(offset), value);
  ssi.writeUint32 = (offset, value) => {
    write(offset, value);
    if (offset === SSIENR) bus.flashReadable = (value & 1) === 1 && ((ssi.readUint32(CTRLR0) >> 8) & 3) === 3;
  };
}

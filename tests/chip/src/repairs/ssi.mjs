// The serial interface to the flash (datasheet 4.10), as far as it decides whether flash is
// readable as memory, and the one command that reads something else: the flash's unique number.
//
// Defect of rp2040js 1.4.1: flash is readable for all settings of these registers. On the chip it
// is readable while the interface is enabled and set to send an address and then read (TMOD = 3);
// commands to the flash use other settings. A second boot stage makes flash readable in this way,
// and firmware runs it again from RAM after it has written flash. The data register is a number
// that never changes; the answer to a command is not in it.

const SSI = 0x18000;
const CTRLR0 = 0x00;
const CTRLR1 = 0x04;
const SSIENR = 0x08;
const SR = 0x28;
const DR0 = 0x60;
/** Bit of SR: bytes were received. */
const RFNE = 8;
/** Instruction of the flash: after four bytes of no meaning, its unique number (W25Q16JV, 8.2). */
const READ_UNIQUE_ID = 0x4b;
const DUMMY_BYTES = 4;
/** Settings after the second stage: quad, 32 bits, address and then read; enabled. */
const READING = { [CTRLR0]: 0x005f0300, [SSIENR]: 1 };

export function repairSsi(mcu, bus, id) {
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

// The registers of the flash's cache (datasheet 2.6.3.6), as far as they switch and flush it.
//
// Defect of rp2040js 1.4.1: they are missing, and so is the cache (core/cache.mjs).

const XIP_CTRL = 0x14000;
const CTRL = 0x00;
const FLUSH = 0x04;

/**
 * @param {import('../core/cache.mjs').Cache} cache
 */
export function repairCache(mcu, cache) {
  const registers = mcu.peripherals[XIP_CTRL];
  const write = registers.writeUint32Atomic.bind(registers);
  registers.writeUint32Atomic = (offset, value, alias) => {
    write(offset, value, alias);
    if (offset === CTRL) cache.isEnabled = (registers.values[CTRL] & 1) === 1;
    if (offset === FLUSH && value & 1) cache.flush();
  };
}

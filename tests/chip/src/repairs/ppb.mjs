// The processor's own registers: NVIC and system control.
//
// Defects of rp2040js 1.4.1: clearing a pending interrupt (NVIC_ICPR) has no effect for the chip's
// peripherals; SCR and AIRCR are missing, so that SEVONPEND has no effect and a request for a
// system reset is ignored (ARMv6-M B3.2.6, B3.2.7); the memory protection is missing
// (core/mpu.mjs). SysTick is not used and not changed.
const NVIC_ICPR = 0x280;
const AIRCR = 0xd0c;
const SCR = 0xd10;
const CCR = 0xd14;
const SHCSR = 0xd24;
const VECTKEY = 0x05fa;
const SYSRESETREQ = 1 << 2;

export function repairPpb(mcu, core, requestReset) {
  const { ppb } = mcu;
  const { mpu } = core.bus;
  const read = ppb.readUint32.bind(ppb);
  const write = ppb.writeUint32.bind(ppb);
  ppb.readUint32 = (offset) => {
    switch (offset) {
      case AIRCR:
        return 0xfa050000;
      case SCR:
        return core.SCR;
      case CCR:
        return 0x208; // STKALIGN and UNALIGN_TRP are always set
      case SHCSR:
        return core.pendingSVCall ? 1 << 15 : 0;
      default:
        return mpu.read(offset) ?? read(offset);
    }
  };
  ppb.writeUint32 = (offset, value) => {
    if (offset === NVIC_ICPR)
      core.pendingInterrupts = (core.pendingInterrupts & ~value) | (core.lines & value);
    else if (offset === SCR) core.SCR = value & 0x16;
    else if (mpu.write(offset, value)) return;
    else if (offset !== AIRCR) write(offset, value);
    else if (value >>> 16 === VECTKEY && value & SYSRESETREQ) requestReset('system');
  };
}

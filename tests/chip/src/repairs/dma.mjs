// Timing of DMA.
//
// Defects of rp2040js 1.4.1: a transfer takes no time, so that a block of memory is copied within
// one instruction; a request that is withdrawn before its transfer is served; a pacing timer runs
// at the inverse of its rate (datasheet 2.5.5.1: X/Y transfers per cycle). Here a transfer is some
// cycles after its request, and the next of an unpaced block is one cycle later (2.5: a read and a
// write in each cycle).

/**
 * Cycles from a data request to its word. Not published: an estimate of the handshake, a read and a
 * write.
 */
const REQUEST_CYCLES = 4;
const PERMANENT = 63;
const TIMER0 = 59;
const SRAM = 0x20000000;

export function repairDma(mcu, clock, bus) {
  const { dma } = mcu;
  for (const name of ['writeUint8', 'writeUint16', 'writeUint32']) tellBus(mcu, name, bus);
  for (const channel of dma.channels) {
    const requested = () =>
      channel.treqValue === PERMANENT ||
      channel.treqValue >= TIMER0 ||
      dma.dreq[channel.treqValue] === true;
    channel.transferAlarm = clock.createAlarm(() => {
      if (channel.active && requested()) channel.transfer();
    });
    channel.scheduleTransfer = () => {
      if (!requested()) return;
      const cycles = pace(dma, channel.treqValue);
      if (cycles > 0 && !channel.transferAlarm.scheduled)
        channel.transferAlarm.scheduleAt(clock.now + cycles);
    };
  }
}

/** Returns the cycles to a channel's next transfer; 0 if its timer is stopped. */
function pace(dma, request) {
  if (request === PERMANENT) return 1;
  if (request < TIMER0) return REQUEST_CYCLES;
  const ratio = [dma.timer0, dma.timer1, dma.timer2, dma.timer3][request - TIMER0];
  const [x, y] = [ratio >>> 16, ratio & 0xffff];
  return x === 0 || y === 0 ? 0 : Math.max(1, Math.round(y / x));
}

/** DMA bypasses the processor's bus. The bus must be informed of overwritten code. */
function tellBus(mcu, name, bus) {
  const write = mcu[name].bind(mcu);
  mcu[name] = (address, value) => {
    write(address, value);
    if (bus.code[(address - SRAM) >> 2] === 1) bus.sramChanged();
  };
}

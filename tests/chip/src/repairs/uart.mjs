// Timing of a PL011 UART (RP2040 datasheet 4.2): bytes take the time that the baud rate gives.
//
// Defects of rp2040js 1.4.1: a byte is sent in no time and there is no transmit FIFO, so that
// firmware never waits; the receive timeout interrupt, the FIFO levels, overruns and the receiver's
// data requests are missing.

const DR = 0x00;
const RSR = 0x04;
const FR = 0x18;
const IBRD = 0x24;
const FBRD = 0x28;
const LCR_H = 0x2c;
const CR = 0x30;
const IFLS = 0x34;
const IMSC = 0x38;
const RIS = 0x3c;
const MIS = 0x40;
const ICR = 0x44;
const DMACR = 0x48;
const RX = 1 << 4;
const TX = 1 << 5;
const RX_TIMEOUT = 1 << 6;
const OVERRUN = 1 << 10;
const ENABLED = 1;
const TX_ENABLED = 1 << 8;
const RX_ENABLED = 1 << 9;
const LEVELS = [4, 8, 16, 24, 28];
const TIMEOUT_BITS = 32;
const WRITE_ONLY_CLEAR = new Set([DR, ICR]);

export class Uart {
  /** @param {{ irq: number, tx: number, rx: number }} lines interrupt and data request numbers */
  constructor(mcu, clock, lines) {
    this.mcu = mcu;
    this.clock = clock;
    this.lines = lines;
    this.registers = { [CR]: RX_ENABLED | TX_ENABLED, [IFLS]: 0x12 };
    this.raw = 0;
    this.received = [];
    this.sending = [];
    this.shifting = null;
    /** Bytes on the wire to the chip. */
    this.arriving = [];
    this.overruns = 0;
    this.onByte = () => {};
    this.txAlarm = clock.createAlarm(() => this.sent());
    this.rxAlarm = clock.createAlarm(() => this.arrived());
    this.timeout = clock.createAlarm(() => this.timedOut());
  }

  /** rp2040js calls this after a change of clk_peri; here the rate is computed at each use. */
  clkPeriChanged() {}

  get(register) {
    return this.registers[register] ?? 0;
  }

  get bitCycles() {
    const divider = this.get(IBRD) + this.get(FBRD) / 64;
    return 16 * (divider || 1) * (this.mcu.clkSys / this.mcu.clkPeri);
  }

  get byteCycles() {
    const control = this.get(LCR_H);
    const bits = 1 + 5 + ((control >> 5) & 3) + ((control >> 1) & 1) + ((control >> 3) & 1) + 1;
    return Math.round(bits * this.bitCycles);
  }

  get depth() {
    return this.get(LCR_H) & 16 ? 32 : 1;
  }

  level(shift) {
    return this.depth === 1 ? 1 : (LEVELS[(this.get(IFLS) >> shift) & 7] ?? 16);
  }

  on(bits) {
    return (this.get(CR) & (ENABLED | bits)) === (ENABLED | bits);
  }

  /** Updates interrupts and data requests after a change. */
  update() {
    if (this.received.length >= this.level(3)) this.raw |= RX;
    else this.raw &= ~RX;
    if (this.received.length === 0) this.raw &= ~RX_TIMEOUT;
    const { dma } = this.mcu;
    const paced = this.get(DMACR);
    if (paced & 2 && this.on(TX_ENABLED) && this.sending.length < this.depth)
      dma.setDREQ(this.lines.tx);
    else dma.clearDREQ(this.lines.tx);
    if (paced & 1 && this.on(RX_ENABLED) && this.received.length > 0) dma.setDREQ(this.lines.rx);
    else dma.clearDREQ(this.lines.rx);
    this.mcu.setInterrupt(this.lines.irq, (this.raw & this.get(IMSC)) !== 0);
  }

  send() {
    if (this.shifting !== null || this.sending.length === 0 || !this.on(TX_ENABLED)) return;
    this.shifting = this.sending.shift();
    // The interrupt is at the fall to the level, not while the level is low (4.2.6.2).
    if (this.sending.length === (this.depth === 1 ? 0 : this.level(0))) this.raw |= TX;
    this.txAlarm.scheduleAt(this.clock.now + this.byteCycles);
  }

  sent() {
    const byte = this.shifting;
    this.shifting = null;
    this.onByte(byte);
    this.send();
    this.update();
  }

  /** Sends bytes to the chip, one after the other. */
  feed(bytes) {
    this.arriving.push(...bytes);
    if (!this.rxAlarm.scheduled && this.arriving.length > 0)
      this.rxAlarm.scheduleAt(this.clock.now + this.byteCycles);
  }

  arrived() {
    this.receive(this.arriving.shift());
    if (this.arriving.length > 0) this.rxAlarm.scheduleAt(this.clock.now + this.byteCycles);
  }

  /** Takes in a byte that is whole at this moment. */
  receive(byte) {
    if (this.on(RX_ENABLED)) {
      if (this.received.length < this.depth) {
        this.received.push(byte);
      } else {
        this.overruns++;
        this.raw |= OVERRUN;
      }
    }
    this.timeout.scheduleAt(this.clock.now + Math.round(TIMEOUT_BITS * this.bitCycles));
    this.update();
  }

  timedOut() {
    if (this.received.length > 0) this.raw |= RX_TIMEOUT;
    this.update();
  }

  readUint32(offset) {
    switch (offset) {
      case DR: {
        const byte = this.received.shift() ?? 0;
        if (this.received.length > 0)
          this.timeout.scheduleAt(this.clock.now + Math.round(TIMEOUT_BITS * this.bitCycles));
        this.update();
        return byte;
      }
      case RSR:
        return this.raw & OVERRUN ? 8 : 0;
      case FR:
        return this.flags;
      case RIS:
        return this.raw;
      case MIS:
        return this.raw & this.get(IMSC);
      default:
        return this.get(offset);
    }
  }

  get flags() {
    const { sending, received, depth, shifting } = this;
    const transmit = (sending.length === 0 ? 1 << 7 : 0) | (sending.length >= depth ? 1 << 5 : 0);
    const receive = (received.length === 0 ? 1 << 4 : 0) | (received.length >= depth ? 1 << 6 : 0);
    return transmit | receive | (sending.length > 0 || shifting !== null ? 1 << 3 : 0);
  }

  writeUint32Atomic(offset, value, alias) {
    const old = alias === 0 || WRITE_ONLY_CLEAR.has(offset) ? 0 : this.readUint32(offset);
    this.write(offset, [value, old ^ value, old | value, old & ~value][alias] >>> 0);
    this.send();
    this.update();
  }

  write(offset, value) {
    if (offset === DR) {
      if (this.sending.length < this.depth) this.sending.push(value & 255);
      if (this.sending.length > this.level(0)) this.raw &= ~TX;
    } else if (offset === ICR) {
      this.raw &= ~value;
    } else if (offset === RSR) {
      this.raw &= ~OVERRUN;
    } else {
      this.registers[offset] = value;
    }
  }
}

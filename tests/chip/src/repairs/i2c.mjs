// Timing of the I2C bus, and the controller's level-sensitive interrupts.
//
// Defects of rp2040js 1.4.1: TX_EMPTY and RX_FULL are set and cleared by events, but they are
// levels of the FIFOs (datasheet 4.3.17, IC_RAW_INTR_STAT), so that a driver that waits for room
// waits forever; the registers of DMA and of some settings are missing; a target answers in no
// time. Here each condition and byte takes its clock periods.
const DATA_CMD = 0x10;
const INTR_STAT = 0x2c;
const INTR_MASK = 0x30;
const RAW_INTR_STAT = 0x34;
const SDA_HOLD = 0x7c;
const SLV_DATA_NACK_ONLY = 0x84;
const ACK_GENERAL_CALL = 0x98;
const CLR_RESTART_DET = 0xa8;
const TX_EMPTY = 1 << 4;
const RX_FULL = 1 << 2;
const ENABLE = 1;
const ALL_INTERRUPTS = 0x1fff;
const BYTE_PERIODS = 9;

/** The outside of one bus: targets by address, with a call for each condition and byte. */
export class I2cBus {
  /**
   * @param {{targets: Map<number, object>, isHeld: boolean}} outside targets by 7-bit address, and
   *   whether one holds the clock low; it survives resets of the chip
   */
  constructor(controller, clock, outside) {
    this.controller = controller;
    this.outside = outside;
    this.target = null;
    this.alarm = clock.createAlarm(() => this.end());
    this.next = null;
    controller.onStart = () => this.after(1, () => controller.completeStart());
    controller.onConnect = (address, mode) =>
      this.after(BYTE_PERIODS, () => this.connect(address, mode === 1));
    controller.onWriteByte = (byte) =>
      this.after(BYTE_PERIODS, () => controller.completeWrite(this.target.write?.(byte) ?? false));
    controller.onReadByte = (ack) =>
      this.after(BYTE_PERIODS, () => controller.completeRead(this.target.read?.(ack) ?? 0xff));
    controller.onStop = () => this.after(1, () => this.stop());
  }

  /** Cycles of one clock period, from the firmware's settings (clk_sys cycles). */
  get period() {
    return this.controller.sclHighPeriod + this.controller.sclLowPeriod;
  }

  /** Lets the clock go: what was under way goes on. */
  release() {
    if (this.next) this.after(1, this.next);
  }

  /** Ends a condition or a byte, unless a target holds the clock low. */
  end() {
    if (this.outside.isHeld) return;
    const then = this.next;
    this.next = null;
    then?.();
  }

  after(periods, then) {
    this.next = then;
    this.alarm.scheduleAt(this.alarm.clock.now + periods * this.period);
  }

  connect(address, reads) {
    this.target = this.outside.targets.get(address) ?? null;
    const acknowledged = this.target !== null && (this.target.start?.(reads) ?? true);
    this.controller.completeConnect(acknowledged);
  }

  stop() {
    this.target?.stop?.();
    this.target = null;
    this.controller.completeStop();
  }
}

export function repairI2c(controller) {
  const levels = () => {
    const { txFIFO, rxFIFO, txThreshold, rxThreshold, enable } = controller;
    const raw = controller.intRaw & ~(TX_EMPTY | RX_FULL);
    controller.intRaw =
      raw |
      (enable & ENABLE && txFIFO.itemCount <= txThreshold ? TX_EMPTY : 0) |
      (rxFIFO.itemCount > rxThreshold ? RX_FULL : 0);
    controller.rp2040.setInterrupt(controller.irq, controller.intStatus !== 0);
  };
  // Every change of a FIFO calls one of these.
  for (const name of ['nextCommand', 'pushRX', 'abort', 'clearInterrupts', 'setInterrupts']) {
    const original = controller[name].bind(controller);
    controller[name] = (...args) => {
      const result = original(...args);
      levels();
      return result;
    };
  }
  installRegisters(controller, levels);
}

/** Registers: the missing ones as plain values; the levels are updated before a read. */
function installRegisters(controller, levels) {
  const plain = {
    [SDA_HOLD]: 1,
    [SLV_DATA_NACK_ONLY]: 0,
    0x88: 0,
    0x8c: 0,
    0x90: 0,
    0x94: 100,
    [ACK_GENERAL_CALL]: 1,
  };
  const read = controller.readUint32.bind(controller);
  const write = controller.writeUint32.bind(controller);
  controller.readUint32 = (offset) => {
    if (offset in plain) return plain[offset];
    if (offset === CLR_RESTART_DET) return 0;
    if (offset === INTR_STAT || offset === RAW_INTR_STAT) levels();
    const value = read(offset);
    if (offset === DATA_CMD) levels();
    return value;
  };
  controller.writeUint32 = (offset, value) => {
    if (offset in plain) plain[offset] = value;
    else if (offset === INTR_MASK) controller.intEnable = value & ALL_INTERRUPTS;
    else write(offset, value);
    levels();
  };
}

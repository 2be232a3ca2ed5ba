// Targets on the I2C bus.

/**
 * A PCA9685 with sixteen channels of PWM: a register pointer that counts up if MODE1.AI is set, the
 * registers, and a record of
 * the writes (data sheet, 7.3).
 */
export class Pca9685 {
  constructor() {
    this.registers = new Uint8Array(256);
    this.registers[0x00] = 0x11; // MODE1 after power-on: asleep, answering to the all-call address
    this.registers[0x01] = 0x04; // MODE2: totem pole
    this.registers[0xfe] = 0x1e; // PRESCALE: 200 Hz
    /** Transactions: { register, bytes }, in their order. */
    this.writes = [];
    /** Number of bytes to acknowledge; Infinity for all, 0 for none, not even the address. */
    this.patience = Infinity;
    this.pointer = null;
    this.underWay = false;
  }

  start(reads) {
    if (this.patience <= 0) return false;
    if (!reads) this.pointer = null;
    this.underWay = false;
    return true;
  }

  write(byte) {
    if (this.patience-- <= 0) return false;
    if (this.pointer === null) {
      this.pointer = byte;
      this.writes.push({ register: byte, bytes: [] });
      this.underWay = true;
      return true;
    }
    this.writes.at(-1).bytes.push(byte);
    this.store(byte);
    this.advance();
    return true;
  }

  /** The ALL_LED registers (0xFA to 0xFD) write those of all sixteen channels. */
  store(byte) {
    this.registers[this.pointer] = byte;
    if (this.pointer < 0xfa || this.pointer > 0xfd) return;
    for (let channel = 0; channel < 16; channel++)
      this.registers[0x06 + 4 * channel + this.pointer - 0xfa] = byte;
  }

  read() {
    const byte = this.registers[this.pointer ?? 0];
    this.advance();
    return byte;
  }

  advance() {
    const increments = this.registers[0x00] & 0x20;
    if (increments && this.pointer !== null) this.pointer = (this.pointer + 1) & 255;
  }

  stop() {
    this.underWay = false;
  }

  /** Returns the completed writes since the last call. */
  take() {
    return this.writes.splice(0, this.writes.length - (this.underWay ? 1 : 0));
  }

  /** On- and off-count of a channel (0 to 4095; bit 12: fully on, fully off). */
  channel(n) {
    const at = 0x06 + 4 * n;
    const word = (i) => this.registers[at + i] | (this.registers[at + i + 1] << 8);
    return { on: word(0), off: word(2) };
  }
}

// A digest of all outputs of the chip, in their order and with their cycles: two runs with the same
// inputs have the same digest.

/** FNV-1a over 32-bit words, twice with different offsets. */
export class EventHash {
  constructor() {
    this.a = 0x811c9dc5;
    this.b = 0x01234567;
    this.count = 0;
  }

  /** @param {number} kind a small number @param {number} cycle @param {number} value */
  add(kind, cycle, value) {
    this.count++;
    for (const word of [kind, cycle >>> 0, Math.floor(cycle / 0x100000000), value]) {
      this.a = Math.imul(this.a ^ word, 0x01000193);
      this.b = Math.imul(this.b ^ this.a ^ (this.b >>> 15), 0x85ebca6b);
    }
  }

  toString() {
    const hex = (word) => (word >>> 0).toString(16).padStart(8, '0');
    return `${hex(this.a)}${hex(this.b)}`;
  }
}

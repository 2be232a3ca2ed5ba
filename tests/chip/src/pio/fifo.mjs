// A FIFO between the system and a state machine: four words; eight with the storage of its
// neighbour, none if the neighbour has its storage.

export class Fifo {
  constructor() {
    this.words = new Uint32Array(8);
    this.depth = 4;
    this.first = 0;
    this.count = 0;
  }

  /** Sets the depth; the contents are lost, as on the chip (datasheet 3.7, SHIFTCTRL.FJOIN_TX). */
  resize(depth) {
    this.depth = depth;
    this.first = 0;
    this.count = 0;
  }

  get empty() {
    return this.count === 0;
  }

  get full() {
    return this.count >= this.depth;
  }

  push(word) {
    this.words[(this.first + this.count++) & 7] = word;
  }

  pull() {
    const word = this.words[this.first];
    this.first = (this.first + 1) & 7;
    this.count--;
    return word;
  }
}

// The cache of the flash (RP2040 datasheet 2.6.3): 16 kB, two ways, lines of 8 bytes. A hit takes
// no time of its own. A miss waits for the transfer of its line, whose length follows from the
// registers of the flash's interface (repairs/ssi.mjs); what the interface needs besides is not
// published.
//
// The datasheet does not say which line of a set gives way. Here it is the older one, so that a hit
// changes nothing: then a piece of translated code whose lines were all there stays valid until
// something is read into the cache.

const SETS = 1024;
const LINE_SHIFT = 3;
const FLASH_ADDRESS = 0xffffff;
const EMPTY = -1;
/** Bits of an address: the access does not keep its line; it does not look for it. */
const NOT_ALLOCATING = 0x1000000;
const NOT_CACHED = 0x2000000;

export class Cache {
  constructor() {
    /** CTRL.EN: without it every access waits. */
    this.isEnabled = true;
    this.first = new Int32Array(SETS).fill(EMPTY);
    this.second = new Int32Array(SETS).fill(EMPTY);
    /** By set: whether the second way is replaced next. */
    this.next = new Uint8Array(SETS);
    /** Number of lines that were read into the cache, and of flushes. */
    this.changes = 0;
    /** Number of accesses that waited. */
    this.misses = 0;
    /** Cycles of a miss; 0 turns the cache's time off. */
    this.missCycles = 0;
  }

  flush() {
    this.first.fill(EMPTY);
    this.second.fill(EMPTY);
    this.changes++;
  }

  /** Returns whether a line, an address without its lowest three bits, is there. */
  has(line) {
    const set = line & (SETS - 1);
    return this.first[set] === line || this.second[set] === line;
  }

  /** Returns the cycles that an access waits, and keeps its line. */
  access(address) {
    const line = (address & FLASH_ADDRESS) >>> LINE_SHIFT;
    const isKept = this.has(line);
    if (isKept && this.isEnabled && !(address & NOT_CACHED)) return 0;
    this.misses++;
    if (!isKept && this.isEnabled && !(address & NOT_ALLOCATING)) this.keep(line);
    return this.missCycles;
  }

  keep(line) {
    const set = line & (SETS - 1);
    if (this.next[set]) this.second[set] = line;
    else this.first[set] = line;
    this.next[set] ^= 1;
    this.changes++;
  }
}

/** Returns the lines of some addresses. */
export const linesOf = (addresses) => [
  ...new Set(addresses.map((address) => (address & FLASH_ADDRESS) >>> LINE_SHIFT)),
];

// The memory protection of the processor (ARMv6-M B3.5), as far as a guard needs it: regions that
// refuse every access to data. SRAM cannot be refused, since translated code accesses it directly.

const TYPE = 0xd90;
const CTRL = 0xd94;
const RNR = 0xd98;
const RBAR = 0xd9c;
const RASR = 0xda0;
/** Eight regions. */
const REGIONS = 8;
const VALID = 1 << 4;
const ENABLED = 1;
const HANDLERS_TOO = 1 << 1;
const NO_ACCESS = 0;
const SRAM = 0x20000000;
const SRAM_END = 0x20042000;

export class Mpu {
  constructor() {
    this.control = 0;
    this.number = 0;
    this.bases = new Array(REGIONS).fill(0);
    this.attributes = new Array(REGIONS).fill(0);
    /** Ranges that are refused, { from, to }; empty while the protection is off. */
    this.refused = [];
  }

  /** Returns whether an access is refused to code of this exception. */
  refuses(address, exception) {
    const isFault = exception === 2 || exception === 3;
    if (isFault && !(this.control & HANDLERS_TOO)) return false;
    return this.refused.some(({ from, to }) => address >= from && address < to);
  }

  /** Returns a register, or null if it is none of these. */
  read(offset) {
    switch (offset) {
      case TYPE:
        return REGIONS << 8;
      case CTRL:
        return this.control;
      case RNR:
        return this.number;
      case RBAR:
        return (this.bases[this.number] | this.number) >>> 0;
      case RASR:
        return this.attributes[this.number];
      default:
        return null;
    }
  }

  /** Returns whether it is a register of the protection. */
  write(offset, value) {
    if (offset === CTRL) this.control = value & 7;
    else if (offset === RNR) this.number = value & (REGIONS - 1);
    else if (offset === RBAR) {
      if (value & VALID) this.number = value & (REGIONS - 1);
      this.bases[this.number] = value & ~0xff;
    } else if (offset === RASR) this.attributes[this.number] = value;
    else return offset === TYPE;
    this.update();
    return true;
  }

  update() {
    const isOn = (this.control & ENABLED) !== 0;
    const on = this.attributes.map((attributes, i) => ({ attributes, base: this.bases[i] }));
    this.refused = on
      .filter(({ attributes }) => isOn && attributes & 1 && ((attributes >>> 24) & 7) === NO_ACCESS)
      .map(({ attributes, base }) => {
        const size = 2 ** (((attributes >>> 1) & 31) + 1);
        const from = Math.floor((base >>> 0) / size) * size;
        if (from < SRAM_END && from + size > SRAM)
          throw new Error('the emulated memory protection cannot refuse SRAM');
        if (attributes & 0xff00) throw new Error('subregions are not emulated');
        return { from, to: from + size };
      });
  }
}

// TMC2209 stepper drivers on one wire, at the chip's UART1 (data sheet rev. 1.09; each method names
// its section).

/** Bit times of a byte, of a pause that ends a datagram, of a rest after a damaged one (4.1.1). */
const [BYTE_BITS, PAUSE_BITS, REST_BITS] = [10, 63, 12];
/** Rates that a driver follows, bit/s (4.1). */
const [SLOWEST, FASTEST] = [9600, 500_000];
const CLOCK_HZ = 125e6;
const UART = 2;
/** Cycles of 8 ns in 2^20 clocks of a driver at 12 MHz, after which a motor stands (5.5.3). */
const STANDSTILL_CYCLES = Math.round((2 ** 20 / 12e6) * CLOCK_HZ);
const [GCONF, GSTAT, IFCNT, NODECONF, IOIN] = [0x00, 0x01, 0x02, 0x03, 0x06];
const [IHOLD_IRUN, SG_RESULT, CHOPCONF, DRV_STATUS] = [0x10, 0x41, 0x6c, 0x6f];
const [WAS_RESET, SHUT_DOWN, UNDERVOLTAGE] = [1, 2, 4];
const VERSION = 0x21;
/** Values after a reset (chapter 5), without the OTP memory's. */
const RESET = [
  [GCONF, 0x141],
  [GSTAT, WAS_RESET],
  [NODECONF, 0],
  [IHOLD_IRUN, 0x0001_1f10],
  [0x11, 20],
  [CHOPCONF, 0x1000_0053],
  [0x70, 0xc10d_0024],
];
/** Registers that can be read (chapter 5). */
const READABLE = [GCONF, GSTAT, IFCNT, IOIN, SG_RESULT, CHOPCONF, DRV_STATUS, 0x12, 0x6a, 0x70];
/** Microsteps by MS1 and MS2 where no register sets them (stand-alone mode). */
const STRAPS = [8, 32, 64, 16];
/** Temperatures of the comparators, their bits in DRV_STATUS, and of the shut-down, °C (11.1). */
const COMPARATORS = [
  [120, 8],
  [143, 9],
  [150, 10],
  [157, 11],
];
const [PREWARNING_C, SHUT_DOWN_C] = [120, 150];
const AMBIENT_C = 25;

/** CRC-8 over a datagram: x^8 + x^2 + x + 1, the lowest bit of each byte first (4.2). */
export function crc8(bytes) {
  let crc = 0;
  for (const byte of bytes)
    for (let bit = 0; bit < 8; bit++)
      crc = ((crc << 1) ^ ((crc >> 7) ^ ((byte >> bit) & 1) ? 0x07 : 0)) & 255;
  return crc;
}

/** A driver: registers, datagrams, and the motor's position by its pins. */
export class Tmc2209 {
  /**
   * @param {import('./chip.mjs').Chip} chip
   * @param {{ address: number, step: number, direction: number, enable: number }} wired `address`:
   *   by MS1 and MS2; the others: pins of the chip
   */
  constructor(chip, wired) {
    this.chip = chip;
    Object.assign(this, wired);
    /** Position of the motor by the pulses while the driver is on, 1/256 full steps. */
    this.position = 0;
    /** Conditions from outside. */
    this.temperature = AMBIENT_C;
    this.isShorted = false;
    this.hasOpenLoad = false;
    this.isSilent = false;
    this.isUndervolted = false;
    this.stallGuard = 0;
    /** Accepted writes: [register, value], in their order. */
    this.writes = [];
    this.reset();
    chip.watch(this.step, (level, cycle) => level && this.pulse(cycle));
  }

  /** Resets the driver, as a loss of its supply does. */
  reset() {
    this.registers = new Map(RESET);
    this.count = 0;
    this.short = 0;
    this.isHot = false;
    this.lastPulse = -Infinity;
    this.received = [];
    this.rests = false;
    this.lastByte = -Infinity;
  }

  get(register) {
    return this.registers.get(register) ?? 0;
  }

  /** Whether the coils get current: ENN is low, and TOFF is not 0. */
  get isOn() {
    const isEnabled = this.chip.level(this.enable) === 0 && (this.get(CHOPCONF) & 15) !== 0;
    return isEnabled && this.short === 0 && !this.isHot && !this.isUndervolted;
  }

  /** Microsteps in a full step (5.5.1, MRES). */
  get microsteps() {
    const byRegister = this.get(GCONF) & 0x80;
    return byRegister ? 256 >> ((this.get(CHOPCONF) >>> 24) & 15) : STRAPS[this.address];
  }

  /** Current of a coil, root mean square, A, with this sense resistor in ohms (chapter 9). */
  current(sense = 0.11) {
    const scale = (this.get(IHOLD_IRUN) >> (this.isStanding ? 0 : 8)) & 31;
    const full = this.get(CHOPCONF) & (1 << 17) ? 0.18 : 0.325;
    return this.isOn ? (((scale + 1) / 32) * full) / (sense + 0.02) / Math.SQRT2 : 0;
  }

  get isStanding() {
    return this.chip.cycles - this.lastPulse >= STANDSTILL_CYCLES;
  }

  pulse(cycle) {
    this.update();
    if (!this.isOn) return;
    this.lastPulse = cycle;
    const step = 256 / this.microsteps;
    this.position += this.chip.level(this.direction) ? step : -step;
  }

  /** Lets the conditions act: a short circuit while the coils have current, the temperature. */
  update() {
    const isEnabled = this.chip.level(this.enable) === 0 && (this.get(CHOPCONF) & 15) !== 0;
    // The flags stay until TOFF is 0 or ENN is high (5.5.3).
    if (!isEnabled) this.short = 0;
    else if (this.isShorted) this.short = 1;
    // Off from the shut-down on until the prewarning ends too (5.5.3).
    if (this.temperature >= SHUT_DOWN_C) this.isHot = true;
    else if (this.temperature < PREWARNING_C) this.isHot = false;
    if (this.short || this.isHot) this.registers.set(GSTAT, this.get(GSTAT) | SHUT_DOWN);
  }

  /** Returns the value of a register that is read. */
  read(register) {
    this.update();
    switch (register) {
      case GSTAT:
        return this.get(GSTAT) | (this.isUndervolted ? UNDERVOLTAGE : 0);
      case IFCNT:
        return this.count;
      case IOIN:
        return this.inputs();
      case SG_RESULT:
        return this.stallGuard;
      case DRV_STATUS:
        return this.status();
      default:
        return READABLE.includes(register) ? this.get(register) : 0;
    }
  }

  /** IOIN: levels of the pins and the version (5.1). */
  inputs() {
    const level = (pin, bit) => this.chip.level(pin) << bit;
    const address = ((this.address & 1) << 2) | ((this.address >> 1) << 3);
    const pins = level(this.enable, 0) | level(this.step, 7) | level(this.direction, 9);
    return ((VERSION << 24) | pins | address | (1 << 6)) >>> 0;
  }

  /** DRV_STATUS (5.5.3). */
  status() {
    const reached = COMPARATORS.filter(([limit]) => this.temperature >= limit);
    const heat = reached.reduce((bits, [, bit]) => bits | (1 << bit), 0);
    const open = this.hasOpenLoad && this.isOn ? 0b01 << 6 : 0;
    const scale = (this.get(IHOLD_IRUN) >> (this.isStanding ? 0 : 8)) & 31;
    const isQuiet = (this.get(GCONF) & 4) === 0;
    return (
      ((this.isStanding ? 1 << 31 : 0) |
        (isQuiet ? 1 << 30 : 0) |
        (scale << 16) |
        heat |
        open |
        (this.short << 2) |
        (this.isHot ? 2 : 0) |
        (this.temperature >= PREWARNING_C ? 1 : 0)) >>>
      0
    );
  }

  write(register, value) {
    this.count = (this.count + 1) & 255;
    this.writes.push([register, value]);
    if (register === GSTAT) this.registers.set(GSTAT, this.get(GSTAT) & ~value);
    else this.registers.set(register, value);
    this.update();
  }

  /**
   * Takes a byte from the wire, whose last bit was at `cycle`. Returns the reply and its delay in
   * bits, or null (4.1).
   */
  hear(byte, cycle, bitCycles) {
    const pause = (cycle - this.lastByte) / bitCycles;
    this.lastByte = cycle;
    if (pause > PAUSE_BITS) this.received = [];
    if (this.rests) {
      // The datagram was damaged: the driver waits for a rest of the wire.
      if (pause - BYTE_BITS < REST_BITS) return null;
      this.rests = false;
      this.received = [];
    }
    this.received.push(byte);
    if ((this.received[0] & 15) !== 5) return this.rest();
    const isWrite = (this.received[2] & 0x80) !== 0;
    if (this.received.length < (this.received.length > 2 && isWrite ? 8 : 4)) return null;
    const datagram = this.received.splice(0);
    if (crc8(datagram.slice(0, -1)) !== datagram.at(-1)) return this.rest();
    return this.isSilent || datagram[1] !== this.address ? null : this.carryOut(datagram);
  }

  rest() {
    this.rests = true;
    return null;
  }

  carryOut([, , register, ...data]) {
    if (register & 0x80) {
      const [a, b, c, d] = data;
      this.write(register & 0x7f, ((a << 24) | (b << 16) | (c << 8) | d) >>> 0);
      return null;
    }
    const value = this.read(register);
    const reply = [5, 255, register, value >>> 24, value >>> 16, value >>> 8, value].map(
      (byte) => byte & 255,
    );
    // SENDDELAY: 8 bits, or an odd number of them (5.1).
    const delay = (this.get(NODECONF) >> 8) & 15;
    return { bytes: [...reply, crc8(reply)], delay: 8 * (delay | 1) };
  }
}

/** The wire between drivers and the chip's UART1, whose pins are connected to it. */
export class DriverWire {
  /** @param {import('./chip.mjs').Chip} chip @param {[number, number]} pins TX and RX */
  constructor(chip, [tx, rx]) {
    this.chip = chip;
    this.pins = { tx, rx };
    /** @type {Tmc2209[]} */
    this.drivers = [];
    /** Replies whose last byte is still to be damaged by noise. */
    this.noise = 0;
    chip.uart1.onByte = (byte) => this.carry(byte);
  }

  /** Adds a driver: see `Tmc2209`. */
  add(wired) {
    const driver = new Tmc2209(this.chip, wired);
    this.drivers.push(driver);
    return driver;
  }

  /** Whether UART1 is at this pin. */
  reaches(pin) {
    return this.chip.mcu.gpio[pin].functionSelect === UART;
  }

  /** Carries a byte that the chip has sent to the drivers, and back to the chip as its echo. */
  carry(byte) {
    const { chip } = this;
    const [uart] = chip.uarts.slice(1);
    const { bitCycles } = uart;
    const rate = CLOCK_HZ / bitCycles;
    if (!this.reaches(this.pins.tx)) return;
    if (this.reaches(this.pins.rx)) uart.receive(byte);
    if (rate < SLOWEST || rate > FASTEST) return;
    const replies = this.drivers.flatMap((driver) => {
      const reply = driver.hear(byte, chip.cycles, bitCycles);
      return reply === null ? [] : [reply];
    });
    if (replies.length > 0) this.answer(replies, bitCycles);
  }

  /**
   * Sends replies to the chip. Of several that begin at once, low wins in each bit; others are
   * taken as if they began with the first.
   */
  answer(replies, bitCycles) {
    const delay = Math.min(...replies.map((reply) => reply.delay));
    const bytes = replies[0].bytes.map((_, i) =>
      replies.reduce((byte, reply) => byte & reply.bytes[i], 255),
    );
    if (this.noise > 0) {
      this.noise--;
      bytes[bytes.length - 1] ^= 0x10;
    }
    const { chip } = this;
    const alarm = chip.clock.createAlarm(() => {
      // The drivers hear each other, and no request in that: they need a rest.
      const end = chip.cycles + bytes.length * BYTE_BITS * bitCycles;
      for (const driver of this.drivers) {
        driver.lastByte = end;
        driver.rest();
      }
      if (this.reaches(this.pins.rx)) chip.uarts[1].feed(bytes);
    });
    alarm.scheduleAt(chip.clock.now + Math.round(delay * bitCycles));
  }
}

// Commands to the chip, which serve.mjs passes over standard input and output: one command object,
// one reply object; see ../README.md.
import { Chip, CYCLE_NS, DriverWire, Pca9685 } from './chip.mjs';
import { Pulses } from './pulses.mjs';
import { Trace } from './trace.mjs';

const PINS = 30;
/** Time that the chip runs before `receive_us` looks again for bytes. */
const RECEIVE_STEP_NS = 200_000;

export class Session {
  /** @param {ConstructorParameters<typeof Chip>[0]} options */
  constructor(options) {
    this.start(options);
  }

  /** Starts a new chip, in place of the one before. */
  start(options) {
    this.chip = new Chip(options);
    this.hats = new Map();
    this.wire = null;
    this.steppers = [];
    this.tracer = null;
    this.listed = new Set();
    this.rises = new Uint32Array(PINS);
    this.clear();
    this.listen();
  }

  /** Clears the records that were reported. */
  clear() {
    this.told = { usb: [], control: [], uart: [], edges: [], resets: [], states: [], i2c: [] };
    this.rises.fill(0);
  }

  listen() {
    const { chip } = this;
    chip.usb.onData = (bytes) =>
      this.told.usb.push([chip.cycles, Buffer.from(bytes).toString('hex')]);
    chip.usb.onState = (state) => this.told.states.push([chip.cycles, state]);
    chip.uart0.onByte = (byte) => this.told.uart.push([chip.cycles, byte]);
    chip.onReset = (cause, cycle) => this.told.resets.push([cycle, cause]);
    for (let pin = 0; pin < PINS; pin++) {
      chip.watch(pin, (level, cycle) => {
        if (level) this.rises[pin]++;
        if (this.listed.has(pin)) this.told.edges.push([cycle, pin, level]);
      });
    }
  }

  /** Starts or stops the measurement of functions and handlers. */
  trace(what) {
    this.tracer?.end();
    if (!what) return void (this.tracer = null);
    const { functions = {}, handlers = {}, profile = false } = what;
    this.tracer = new Trace(this.chip, functions, handlers, profile);
  }

  /** Plugs a target onto a bus, or unplugs the one at the address if `kind` is null. */
  setTarget([bus, address, kind]) {
    if (kind === null) {
      this.chip.i2c[bus].targets.delete(address);
      this.hats.delete(address);
      return;
    }
    if (kind !== 'pca9685') throw new Error(`i2c: ${kind} is not known; there is pca9685`);
    const hat = new Pca9685();
    this.chip.i2c[bus].targets.set(address, hat);
    this.hats.set(address, hat);
  }

  /** Connects TMC2209 drivers to UART1 at these pins. */
  connectDrivers({ uart, drivers }) {
    this.wire = new DriverWire(this.chip, uart);
    for (const [address, step, direction, enable] of drivers)
      this.wire.add({ address, step, direction, enable });
  }

  /** Changes a driver: its conditions, or the noise on the wire. */
  disturb({ index, noise, reset, ...conditions }) {
    if (noise !== undefined) this.wire.noise = noise;
    const driver = this.wire.drivers[index];
    if (reset) driver.reset();
    for (const [name, value] of Object.entries(conditions)) {
      if (!(name in driver)) throw new Error(`a driver has no ${name}`);
      driver[name] = value;
    }
  }

  /** Executes the entries of a command in their order, and returns the reply. */
  do(command) {
    const answers = {};
    for (const [name, argument] of Object.entries(command)) {
      const carryOut = COMMANDS[name];
      if (!carryOut)
        throw new Error(`unknown command ${name}; there are ${Object.keys(COMMANDS).join(', ')}`);
      Object.assign(answers, carryOut(this, argument));
    }
    return { ...this.report(), ...answers };
  }

  /** Returns the events since the last reply, without empty lists. */
  report() {
    for (const [address, hat] of this.hats) {
      for (const { register, bytes } of hat.take())
        this.told.i2c.push([address, register, Buffer.from(bytes).toString('hex')]);
    }
    const reply = { cycle: this.chip.cycles };
    if (this.steppers.length > 0) reply.steps = this.steppers.map(({ position }) => position);
    for (const [name, list] of Object.entries(this.told)) if (list.length > 0) reply[name] = list;
    if (this.told.uart.length > 0) reply.uart = gather(this.told.uart);
    const rises = [...this.rises].flatMap((count, pin) => (count > 0 ? [[pin, count]] : []));
    if (rises.length > 0) reply.rises = rises;
    this.clear();
    return reply;
  }
}

/** Groups bytes with their cycles into runs: [cycle of the last, hex]. */
function gather(bytes) {
  return [[bytes.at(-1)[0], Buffer.from(bytes.map(([, byte]) => byte)).toString('hex')]];
}

const bytesOf = (hex) => {
  if (!/^([0-9a-f]{2})*$/i.test(hex)) throw new Error(`"${hex}" is not bytes in hexadecimal`);
  return Buffer.from(hex, 'hex');
};

const COMMANDS = {
  image: (session, image) => session.start({ image }),
  run_us: ({ chip }, micros) => chip.runFor(micros * 1000),
  run_cycles: ({ chip }, cycles) => chip.runFor(cycles * CYCLE_NS),
  receive_us: ({ chip, told }, micros) =>
    void chip.runUntil(() => told.usb.length > 0, micros * 1000, RECEIVE_STEP_NS),
  usb: ({ chip }, hex) => chip.usb.send(bytesOf(hex)),
  uart: ({ chip }, hex) => chip.uart0.feed(bytesOf(hex)),
  gpio: ({ chip }, [pin, level]) => chip.drive(pin, level),
  unplug: ({ chip }) => chip.usb.unplug(),
  plug: ({ chip }) => chip.usb.plug(),
  control: (session, [type, request, value, index, length]) =>
    session.chip.usb.request(type, request, value, index, length, (bytes) =>
      session.told.control.push([session.chip.cycles, Buffer.from(bytes).toString('hex')]),
    ),
  hang_usb: ({ chip }, how) => void (chip.port.hung = how),
  dtr: ({ chip }, open) => chip.usb.setDtr(open),
  pause_usb: ({ chip }, isPaused) => chip.usb.pause(isPaused),
  hang: ({ chip }) => chip.hang(),
  stall: ({ chip }, cycles) => void (chip.bus.stall += cycles),
  call: ({ chip }, [address, ...words]) => chip.call(address, words),
  reset: ({ chip }, cause) => chip.reset(cause),
  downloaded: ({ chip }, way) => chip.finishDownload(way),
  steppers: (session, steppers) =>
    session.steppers.push(...steppers.map((stepper) => new Pulses(session.chip, stepper))),
  pulses: (session) => ({ pulses: session.steppers.map((stepper) => stepper.take()) }),
  trace: (session, what) => session.trace(what),
  calls: (session) => ({ calls: session.tracer?.take() ?? {} }),
  profile: (session) => ({ profile: session.tracer?.profile() ?? [] }),
  list: (session, pins) => void (session.listed = new Set(pins)),
  i2c: (session, target) => session.setTarget(target),
  tmc2209: (session, wired) => session.connectDrivers(wired),
  driver: (session, changes) => session.disturb(changes),
  drivers: ({ wire }) => ({
    drivers: wire.drivers.map((driver) => ({
      position: driver.position,
      microsteps: driver.microsteps,
      milliamperes: Math.round(driver.current() * 1000),
      writes: driver.writes.length,
    })),
  }),
  hold_i2c: ({ chip }, [bus, isHeld]) => chip.holdI2c(bus, isHeld),
  levels: ({ chip }, pins) => ({ levels: pins.map((pin) => chip.level(pin)) }),
  peek: ({ chip }, [address, length]) => ({
    peek: Buffer.from(chip.peek(address, length)).toString('hex'),
  }),
  poke: ({ chip }, [address, hex]) => chip.poke(address, bytesOf(hex)),
  flash: ({ chip: { flash } }) => ({
    flash: {
      busy: flash.busy?.kind ?? null,
      log: flash.log.map(({ kind, offset, length, at }) => [at, kind, offset, length]),
    },
  }),
  vectors: ({ chip }) => ({ vectors: chip.core.VTOR }),
  load: ({ chip }) => ({ load: chip.load }),
  fault: ({ chip }) => ({ fault: chip.core.fault }),
  hash: ({ chip }) => ({ hash: String(chip.hash) }),
  warnings: ({ chip }) => ({ warnings: [...chip.warnings] }),
};

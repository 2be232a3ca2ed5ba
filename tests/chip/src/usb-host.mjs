// A USB host with one port, and its driver for a serial device (CDC-ACM): it enumerates the device,
// sets the line up, and transfers bytes. It survives resets of the chip, as a computer does.
import { CYCLES_PER_US } from './clock.mjs';

const ATTACH_US = 1_000;
const RESET_US = 10_000;
const SUSPEND_US = 3_000;
const FRAME_US = 1_000;
/**
 * Bits of a transaction besides its data: token, sync, identifiers, checksums, handshake,
 * turn-around.
 */
const OVERHEAD_BYTES = 13;
const CYCLES_PER_BYTE = (8 / 12) * CYCLES_PER_US;
const PACKET = 64;
const IN = 0x80;
const GET_DESCRIPTOR = 6;
const SET_ADDRESS = 5;
const SET_CONFIGURATION = 9;
const SET_LINE_CODING = 0x20;
const SET_CONTROL_LINE_STATE = 0x22;
const CLASS_INTERFACE = 0x21;
const DEVICE = 0x100;
const CONFIGURATION = 0x200;
const CDC_CONTROL = 2;
const CDC_DATA = 10;
const LINE_CODING = [0x00, 0xc2, 0x01, 0x00, 0, 0, 8]; // 115 200 baud, 8N1

export class UsbHost {
  /**
   * @param {{ data(bytes: Uint8Array): void, state(name: string): void }} record is called before
   * the callbacks
   */
  constructor(record) {
    this.record = record;
    /** Called with a Uint8Array for every packet of data. */
    this.onData = () => {};
    /** Called with 'attached' | 'ready' | 'lost' | 'stalled'. */
    this.onState = () => {};
    this.plugged = true;
    this.dtr = true;
    /** Whether the host neither sends nor fetches data; its frames go on. */
    this.paused = false;
    this.port = null;
    this.outgoing = [];
    this.forget();
  }

  /** Whether the serial port is configured. */
  get ready() {
    return this.state === 'ready';
  }

  tell(state) {
    this.record.state(state);
    this.onState(state);
  }

  forget() {
    this.state = 'absent';
    this.transfers = [];
    this.stage = null;
    this.endpoints = null;
    this.data1 = false;
    this.outgoing.length = 0;
  }

  /** Called at a start of the chip: the device is gone, and may return. */
  attach(port, clock) {
    if (this.state !== 'absent') this.lose();
    this.port = port;
    this.bus = clock.createAlarm(() => this.after());
    this.outAlarm = clock.createAlarm(() => this.deliver());
    this.inAlarm = clock.createAlarm(() => this.fetch());
    this.controlAlarm = clock.createAlarm(() => this.control());
    this.frameAlarm = clock.createAlarm(() => this.frame());
    port.onOffer = (endpoint) => this.offered(endpoint);
    port.onPullup = (up) => this.connection(up && this.plugged);
    port.onResetSeen = () => this.enumerate();
  }

  later(micros, then) {
    this.after = then;
    this.bus.schedule(micros * 1000);
  }

  connection(present) {
    if (!present) {
      this.lose();
      return;
    }
    this.state = 'attached';
    this.tell('attached');
    this.later(ATTACH_US + RESET_US, () => {
      this.port.busReset();
      this.frame();
    });
  }

  /** Begins a frame, and has the next one begin a millisecond later. */
  frame() {
    this.port.frame();
    this.frameAlarm.schedule(FRAME_US * 1000);
  }

  lose() {
    if (this.state !== 'absent') this.tell('lost');
    const { bus, outAlarm, inAlarm, controlAlarm, frameAlarm } = this;
    for (const alarm of [bus, outAlarm, inAlarm, controlAlarm, frameAlarm]) alarm?.cancel();
    this.forget();
  }

  /**
   * Unplugs the cable. The board stays powered; for a board with bus power, also reset it with
   * 'power'.
   */
  unplug() {
    this.plugged = false;
    this.lose();
    if (this.port?.pullup) this.later(SUSPEND_US, () => this.port.suspend());
  }

  plug() {
    this.plugged = true;
    if (this.port?.pullup) this.connection(true);
  }

  /** Opens or closes the port on the host. While it is closed, the host receives no data. */
  setDtr(open) {
    this.dtr = open;
    if (this.state === 'ready')
      this.request(
        CLASS_INTERFACE,
        SET_CONTROL_LINE_STATE,
        open ? 3 : 0,
        this.endpoints.control,
        [],
        () => {},
      );
    if (open) this.poll();
  }

  /** Pauses the transfers of data, or goes on with them: a program that does not run. */
  pause(isPaused) {
    this.paused = isPaused;
    this.poll();
  }

  /** Queues bytes for the device. They are lost if it goes away before they are sent. */
  send(bytes) {
    for (const byte of bytes) this.outgoing.push(byte);
    this.poll();
  }

  enumerate() {
    if (this.state === 'absent') return;
    this.transfers = [];
    this.stage = null;
    this.data1 = false;
    this.request(0, SET_ADDRESS, 1, 0, [], () => {});
    this.request(IN, GET_DESCRIPTOR, DEVICE, 0, 18, () => {});
    this.request(IN, GET_DESCRIPTOR, CONFIGURATION, 0, 9, (head) => {
      this.request(IN, GET_DESCRIPTOR, CONFIGURATION, 0, head[2] | (head[3] << 8), (all) =>
        this.configure(all),
      );
    });
  }

  configure(descriptors) {
    this.endpoints = serialEndpoints(descriptors);
    const { control } = this.endpoints;
    this.request(0, SET_CONFIGURATION, 1, 0, [], () => {});
    this.request(CLASS_INTERFACE, SET_LINE_CODING, 0, control, LINE_CODING, () => {});
    this.request(CLASS_INTERFACE, SET_CONTROL_LINE_STATE, this.dtr ? 3 : 0, control, [], () => {
      this.state = 'ready';
      this.tell('ready');
      this.poll();
    });
  }

  /** Queues a control transfer; `data` are the bytes to send, or the number of bytes to receive. */
  request(type, request, value, index, data, then) {
    const length = typeof data === 'number' ? data : data.length;
    const setup = [
      type,
      request,
      value & 255,
      value >> 8,
      index & 255,
      index >> 8,
      length & 255,
      length >> 8,
    ];
    this.transfers.push({
      setup,
      sent: [...(data.length ? data : [])],
      wanted: type & IN ? length : 0,
      received: [],
      then,
    });
    if (this.transfers.length === 1) this.begin();
  }

  begin() {
    this.stage = 'setup';
    this.controlAlarm.scheduleAt(this.controlAlarm.clock.now + packetCycles(8));
  }

  offered(endpoint) {
    if (endpoint === 0) this.pollControl();
    else this.poll();
  }

  /** Continues the control transfer if the device is ready for its next packet. */
  pollControl() {
    const { port, stage } = this;
    if (stage === null || stage === 'setup' || this.controlAlarm.scheduled) return;
    const out = stage === 'out' || stage === 'status out';
    if (!port.isOffered(0, out) && !port.isStalled(0, out)) return;
    this.controlAlarm.scheduleAt(this.controlAlarm.clock.now + packetCycles(PACKET));
  }

  /** Transfers the next packet of the control transfer, if the device is ready. */
  control() {
    const { port } = this;
    const [transfer] = this.transfers;
    if (!transfer) return;
    if (this.stage === 'setup') {
      this.stage = transfer.wanted ? 'in' : transfer.sent.length ? 'out' : 'status in';
      port.setup(transfer.setup);
    } else if (port.isStalled(0, false) || port.isStalled(0, true)) {
      this.tell('stalled');
      this.finish(transfer);
    } else if (this.stage === 'in' && port.isOffered(0, false)) {
      const { bytes } = port.take(0);
      transfer.received.push(...bytes);
      if (bytes.length < PACKET || transfer.received.length >= transfer.wanted)
        this.stage = 'status out';
    } else if (this.stage === 'out' && port.isOffered(0, true)) {
      port.put(0, Uint8Array.from(transfer.sent));
      this.stage = 'status in';
    } else if (this.stage === 'status in' && port.isOffered(0, false)) {
      port.take(0);
      this.finish(transfer);
    } else if (this.stage === 'status out' && port.isOffered(0, true)) {
      port.put(0, new Uint8Array(0));
      this.finish(transfer);
    }
    this.pollControl();
  }

  finish(transfer) {
    this.transfers.shift();
    this.stage = null;
    transfer.then(transfer.received);
    if (this.transfers.length > 0 && this.stage === null) this.begin();
  }

  /** Starts the transactions for which both sides are ready. */
  poll() {
    if (!this.endpoints || this.state === 'absent' || this.paused) return;
    const { port, endpoints } = this;
    if (this.dtr && !this.inAlarm.scheduled && port.isOffered(endpoints.in, false)) {
      this.inAlarm.scheduleAt(
        this.inAlarm.clock.now + packetCycles(port.control(endpoints.in, false) & 0x3ff),
      );
    }
    if (
      this.ready &&
      this.outgoing.length > 0 &&
      !this.outAlarm.scheduled &&
      port.isOffered(endpoints.out, true)
    ) {
      const length = Math.min(PACKET, this.outgoing.length, port.room(endpoints.out));
      this.outAlarm.scheduleAt(this.outAlarm.clock.now + packetCycles(length));
    }
  }

  fetch() {
    const { port, endpoints } = this;
    if (!port.isOffered(endpoints.in, false)) return;
    const { bytes, data1 } = port.take(endpoints.in);
    // A packet with the wrong toggle is a repetition: it is acknowledged and dropped
    // (USB 2.0, 8.6).
    if (data1 === this.data1) {
      this.data1 = !this.data1;
      if (bytes.length > 0) {
        this.record.data(bytes);
        this.onData(bytes);
      }
    }
    this.poll();
  }

  deliver() {
    const { port, endpoints } = this;
    if (!port.isOffered(endpoints.out, true)) return;
    const length = Math.min(PACKET, this.outgoing.length, port.room(endpoints.out));
    port.put(endpoints.out, Uint8Array.from(this.outgoing.splice(0, length)));
    this.poll();
  }
}

function packetCycles(bytes) {
  return Math.ceil((bytes + OVERHEAD_BYTES) * CYCLES_PER_BYTE);
}

/**
 * Returns the serial function of a configuration: its control interface and the data interface's
 * bulk endpoints.
 */
function serialEndpoints(descriptors) {
  const found = {};
  let interfaceClass = 0;
  for (let i = 0; i < descriptors.length && descriptors[i] >= 2; i += descriptors[i]) {
    const [, type, a, b, , c] = descriptors.slice(i, i + 6);
    if (type === 4) {
      interfaceClass = c;
      if (c === CDC_CONTROL) found.control = a;
    } else if (type === 5 && interfaceClass === CDC_DATA && (b & 3) === 2) {
      found[a & IN ? 'in' : 'out'] = a & 15;
    }
  }
  if (found.control === undefined || !found.in || !found.out)
    throw new Error('USB: the device has no serial function');
  return found;
}

// Buffers and bus state of the USB device controller.
//
// Defects of rp2040js 1.4.1: a receive buffer loses its AVAILABLE bit at once, so that a driver
// that polls this bit reads a packet that has not arrived; a transmit buffer is reported as sent
// before a host has requested it, so that the loss of the host is never detected; suspend, frames,
// the state of the line and the reset of the controller are missing. On the chip the controller
// owns the buffer until the host's packet was transferred (RP2040 datasheet 4.1.2.7, 4.1.3.2 buffer
// control).

const BUFFER_CONTROL = 0x80;
const BUFFER_CONTROL_END = 0x100;
const SIE_CTRL = 0x4c;
const SIE_STATUS = 0x50;
const SOF_RD = 0x48;
const DEV_SOF = 1 << 17;
const FRAMES = 0x800;
/** SIE_STATUS.LINE_STATE: J while nothing is on the line, and K in turn with it otherwise. */
const LINE_STATE = 3 << 2;
const LINE_J = 1 << 2;
const LINE_K = 2 << 2;
const PULLUP = 1 << 16;
const SETUP_REC = 1 << 17;
const BUS_RESET = 1 << 19;
const SUSPENDED = 1 << 4;
const DEV_SUSPEND = 1 << 14;
const AVAILABLE = 1 << 10;
const STALL = 1 << 11;
const DATA1 = 1 << 13;
const FULL = 1 << 15;
const LENGTH = 0x3ff;
const EP0_BUFFER = 0x100;

/** The bus side of the controller. A host (usb-host.mjs) sets the callbacks. */
export class UsbPort {
  constructor(mcu) {
    this.mcu = mcu;
    this.controller = mcu.usbCtrl;
    this.memory = mcu.usbDPRAMView;
    /** Called with (endpoint, out) when the firmware offers a buffer. */
    this.onOffer = () => {};
    /** Called with true or false when the firmware connects or disconnects its pull-up. */
    this.onPullup = () => {};
    /** Called when the firmware has acknowledged the bus reset. */
    this.onResetSeen = () => {};
    this.pullup = false;
    this.suspendFlag = false;
    /**
     * A controller that hangs (erratum E15): 'in' for one that transfers no data to the host,
     * 'deaf' for one that hears nothing at all.
     */
    this.hung = null;
    this.looks = 0;
    this.repair();
  }

  repair() {
    const { controller } = this;
    controller.DPRAMUpdated = (offset, value) => {
      if (offset < BUFFER_CONTROL || offset >= BUFFER_CONTROL_END || !(value & (AVAILABLE | STALL)))
        return;
      this.onOffer((offset - BUFFER_CONTROL) >> 3, (offset & 4) !== 0);
    };
    const write = controller.writeUint32.bind(controller);
    controller.writeUint32 = (offset, value) => {
      if (offset === SIE_STATUS && controller.rawWriteValue & SUSPENDED) this.suspendFlag = false;
      write(offset, value);
      if (offset === SIE_CTRL && this.pullup !== ((value & PULLUP) !== 0)) {
        this.pullup = !this.pullup;
        this.onPullup(this.pullup);
      }
    };
    const read = controller.readUint32.bind(controller);
    controller.readUint32 = (offset) => {
      if (offset === SIE_STATUS) return ((read(offset) & ~LINE_STATE) | this.lineState()) >>> 0;
      if (offset === SOF_RD) this.setReason(DEV_SOF, false);
      return read(offset);
    };
    const update = controller.sieStatusUpdated.bind(controller);
    controller.sieStatusUpdated = () => {
      update();
      // DEV_SUSPEND reports a change, not the state (4.1.4, INTR).
      controller.intRaw = (controller.intRaw & ~DEV_SUSPEND) | (this.suspendFlag ? DEV_SUSPEND : 0);
      controller.checkInterrupts();
    };
    controller.onResetReceived = () => this.onResetSeen();
  }

  setReason(bit, isSet) {
    const { controller } = this;
    controller.intRaw = isSet ? controller.intRaw | bit : controller.intRaw & ~bit;
    controller.checkInterrupts();
  }

  /** Begins a frame. */
  frame() {
    if (this.hung === 'deaf') return;
    this.controller.sofFrameNumber = (this.controller.sofFrameNumber + 1) % FRAMES;
    this.setReason(DEV_SOF, true);
  }

  /** The line as it looks: packets for a controller that does not hear them are always there. */
  lineState() {
    if (!this.pullup) return 0;
    this.looks++;
    return this.hung === 'deaf' && this.looks & 1 ? LINE_K : LINE_J;
  }

  /** Called when the controller is put into reset: its registers go, its memory stays. */
  reset() {
    const { controller } = this;
    this.hung = null;
    this.suspendFlag = false;
    for (const name of ['addrEndp', 'mainCtrl', 'sieCtrl', 'sieStatus', 'buffStatus', 'usbPwr'])
      controller[name] = 0;
    Object.assign(controller, { intRaw: 0, intEnable: 0, intForce: 0, intEpCtrl: 0 });
    controller.checkInterrupts();
    if (!this.pullup) return;
    this.pullup = false;
    this.onPullup(false);
  }

  control(endpoint, out) {
    return this.memory.getUint32(BUFFER_CONTROL + 8 * endpoint + (out ? 4 : 0), true);
  }

  /** Returns the offset of an endpoint's buffer in USB memory. */
  buffer(endpoint, out) {
    if (endpoint === 0) return EP0_BUFFER;
    return this.memory.getUint32(8 * endpoint + (out ? 4 : 0), true) & 0xffc0;
  }

  isOffered(endpoint, out) {
    if (this.hung === 'deaf' || (this.hung === 'in' && endpoint !== 0 && !out)) return false;
    return (this.control(endpoint, out) & AVAILABLE) !== 0;
  }

  isStalled(endpoint, out) {
    return (this.control(endpoint, out) & STALL) !== 0;
  }

  done(endpoint, out, control) {
    this.memory.setUint32(
      BUFFER_CONTROL + 8 * endpoint + (out ? 4 : 0),
      control & ~AVAILABLE,
      true,
    );
    this.controller.indicateBufferReady(endpoint, out);
  }

  /** Takes the packet of a transmit buffer for the host: { bytes, data1 }. */
  take(endpoint) {
    const control = this.control(endpoint, false);
    const from = this.buffer(endpoint, false);
    const bytes = this.mcu.usbDPRAM.slice(from, from + (control & LENGTH));
    this.done(endpoint, false, control & ~FULL);
    return { bytes, data1: (control & DATA1) !== 0 };
  }

  /** Puts the host's packet into the receive buffer. */
  put(endpoint, bytes) {
    const control = this.control(endpoint, true);
    this.mcu.usbDPRAM.set(bytes.slice(0, control & LENGTH), this.buffer(endpoint, true));
    this.done(endpoint, true, (control & ~LENGTH) | bytes.length | FULL);
  }

  /** Returns the size of the receive buffer. */
  room(endpoint) {
    return this.control(endpoint, true) & LENGTH;
  }

  setup(packet) {
    if (this.hung === 'deaf') return;
    this.mcu.usbDPRAM.set(packet, 0);
    this.status(SETUP_REC, 0);
  }

  busReset() {
    if (this.hung === 'deaf') return;
    this.suspendFlag = false;
    this.status(BUS_RESET, SUSPENDED);
  }

  suspend() {
    this.suspendFlag = true;
    this.status(SUSPENDED, 0);
  }

  status(set, clear) {
    this.controller.sieStatus = (this.controller.sieStatus | set) & ~clear;
    this.controller.sieStatusUpdated();
  }
}

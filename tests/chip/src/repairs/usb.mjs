// The USB device controller's buffers and bus state.
//
// What is wrong in rp2040js 1.4.1: a buffer that the firmware offers for reception loses its AVAILABLE bit at once, so that a driver
// that polls this bit reads a packet that has not come; one offered for sending is reported as sent before any host has asked for it,
// so that a host that has gone is never noticed; suspend is missing. On the chip the buffer belongs to the controller until the
// host's packet has come or gone (RP2040 datasheet 4.1.2.7, 4.1.3.2 buffer control).

const BUFFER_CONTROL = 0x80;
const BUFFER_CONTROL_END = 0x100;
const SIE_CTRL = 0x4c;
const SIE_STATUS = 0x50;
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

/** The controller as the bus sees it. A host (usb-host.mjs) sets the callbacks. */
export class UsbPort {
  constructor(mcu) {
    this.mcu = mcu;
    this.controller = mcu.usbCtrl;
    this.memory = mcu.usbDPRAMView;
    /** Called with (endpoint, out) when the firmware offers a buffer. */
    this.onOffer = () => {};
    /** Called with true or false when the firmware connects or disconnects its pull-up. */
    this.onPullup = () => {};
    /** Called when the firmware has seen the bus reset. */
    this.onResetSeen = () => {};
    this.pullup = false;
    this.suspendFlag = false;
    this.repair();
  }

  repair() {
    const { controller } = this;
    controller.DPRAMUpdated = (offset, value) => {
      if (offset < BUFFER_CONTROL || offset >= BUFFER_CONTROL_END || !(value & (AVAILABLE | STALL))) return;
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
    const update = controller.sieStatusUpdated.bind(controller);
    controller.sieStatusUpdated = () => {
      update();
      // DEV_SUSPEND tells of a change, not of the state (4.1.4, INTR).
      controller.intRaw = (controller.intRaw & ~DEV_SUSPEND) | (this.suspendFlag ? DEV_SUSPEND : 0);
      controller.checkInterrupts();
    };
    controller.onResetReceived = () => this.onResetSeen();
  }

  control(endpoint, out) {
    return this.memory.getUint32(BUFFER_CONTROL + 8 * endpoint + (out ? 4 : 0), true);
  }

  /** Where an endpoint's buffer is in USB memory. */
  buffer(endpoint, out) {
    if (endpoint === 0) return EP0_BUFFER;
    return this.memory.getUint32(8 * endpoint + (out ? 4 : 0), true) & 0xffc0;
  }

  isOffered(endpoint, out) {
    return (this.control(endpoint, out) & AVAILABLE) !== 0;
  }

  isStalled(endpoint, out) {
    return (this.control(endpoint, out) & STALL) !== 0;
  }

  done(endpoint, out, control) {
    this.memory.setUint32(BUFFER_CONTROL + 8 * endpoint + (out ? 4 : 0), control & ~AVAILABLE, true);
    this.controller.indicateBufferReady(endpoint, out);
  }

  /** The host takes the packet that is offered for sending: { bytes, data1 }. */
  take(endpoint) {
    const control = this.control(endpoint, false);
    const from = this.buffer(endpoint, false);
    const bytes = this.mcu.usbDPRAM.slice(from, from + (control & LENGTH));
    this.done(endpoint, false, control & ~FULL);
    return { bytes, data1: (control & DATA1) !== 0 };
  }

  /** The host's packet arrives in the buffer that is offered for it. */
  put(endpoint, bytes) {
    const control = this.control(endpoint, true);
    this.mcu.usbDPRAM.set(bytes.slice(0, control & LENGTH), this.buffer(endpoint, true));
    this.done(endpoint, true, (control & ~LENGTH) | bytes.length | FULL);
  }

  /** How many bytes the buffer offered for reception takes. */
  room(endpoint) {
    return this.control(endpoint, true) & LENGTH;
  }

  setup(packet) {
    this.mcu.usbDPRAM.set(packet, 0);
    this.status(SETUP_REC, 0);
  }

  busReset() {
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

// The processor's view of memory.
//
// Defects of rp2040js 1.4.1: an access to an unmapped address returns 0xffffffff, and an unaligned
// access is executed. On the chip both are a HardFault (datasheet 2.1, ARMv6-M A3.2.1). Reserved
// addresses on the flash's own port, up to SRAM, are an exception: nothing promises a fault there,
// so they read as 0 here and keep nothing. This file also reads memory without a call into
// rp2040js, for speed.
//
// Accesses to flash go through its cache (cache.mjs), and those that the memory protection refuses
// are a HardFault (mpu.mjs).

import { Cache } from './cache.mjs';
import { Mpu } from './mpu.mjs';
import { translate } from './translate.mjs';

/** Thrown by an access that is a bus fault on the chip; the core converts it to a HardFault. */
export const FAULT = new Error('bus fault');

const SRAM = 0x20000000;
const XIP = 0x10000000;
const XIP_END = 0x14000000;
const DPRAM = 0x50100000;
const SIO = 0xd0000000;
const PPB = 0xe0000000;
const PPB_END = 0xe0100000;

/** Returns whether an address is on the flash's port, beyond the flash. */
const isReserved = (address) => address >= XIP_END && address < SRAM;

/** Halfwords at the beginning of flash that may be translated: 1 MB. */
const FLASH_PIECES = 512 * 1024;
/** Number of runs, up to 254, after which code is translated: most of a start runs less often. */
const OFTEN = 250;

export class Bus {
  constructor(mcu) {
    this.mcu = mcu;
    this.sram8 = mcu.sram;
    this.sram16 = new Uint16Array(mcu.sram.buffer);
    this.sram32 = new Int32Array(mcu.sram.buffer);
    this.flash8 = mcu.flash;
    this.flash16 = new Uint16Array(mcu.flash.buffer);
    this.flash32 = new Int32Array(mcu.flash.buffer);
    this.rom8 = new Uint8Array(mcu.bootrom.buffer);
    this.rom16 = new Uint16Array(mcu.bootrom.buffer);
    this.rom32 = new Int32Array(mcu.bootrom.buffer);
    this.sramSize = mcu.sram.length;
    this.romSize = this.rom8.length;
    this.flashMask = mcu.flash.length - 1;
    /** Translations by address, and the number of runs of code without one. */
    this.pieces = new Array(FLASH_PIECES + this.sramSize / 2).fill(undefined);
    this.visits = new Uint8Array(this.pieces.length);
    this.often = OFTEN;
    /** Which words of SRAM have been translated. */
    this.code = new Uint8Array(this.sramSize / 4);
    /**
     * False while flash is being erased or programmed: then it cannot be read (datasheet
     * 2.8.3.1.3).
     */
    this.flashReadable = true;
    this.cache = new Cache();
    /** Cycles that accesses to flash have waited since the processor last counted them. */
    this.stall = 0;
    this.mpu = new Mpu();
  }

  /** Returns the cycles that accesses to flash have waited since the last call. */
  takeStall() {
    const { stall } = this;
    this.stall = 0;
    return stall;
  }

  /**
   * Cycles of a load or store: 2; 1 to SIO (datasheet 2.3.1); 3 more to read and 4 to write across
   * the APB bridge (2.1.4).
   */
  cost(address, apb) {
    const region = address >>> 28;
    if (region < 4) return 2;
    if (region === 4) return 1 + apb;
    return region === 13 ? 1 : 2;
  }

  /** Returns whether code at this address may be translated. */
  isCode(address) {
    return (address - XIP) >>> 0 < 2 * FLASH_PIECES || (address - SRAM) >>> 0 < this.sramSize;
  }

  /**
   * Returns the translation of code that runs often, or null (translate.mjs). Code in flash is
   * executed by single instructions until all of its lines are in the cache.
   */
  pieceAt(address) {
    let index = (address - XIP) >>> 1;
    if (index >= FLASH_PIECES) {
      if ((address - SRAM) >>> 0 >= this.sramSize) return null;
      index = FLASH_PIECES + ((address - SRAM) >> 1);
    } else if (!this.flashReadable) {
      return null;
    }
    let piece = this.pieces[index];
    if (piece === undefined) {
      if (this.visits[index]++ < this.often) return null;
      piece = translate(this, address);
      this.pieces[index] = piece;
    }
    if (piece === null || piece.lines === null || piece.seen === this.cache.changes) return piece;
    for (const line of piece.lines) if (!this.cache.has(line)) return null;
    piece.seen = this.cache.changes;
    return piece;
  }

  markCode(address) {
    if ((address - SRAM) >>> 0 < this.sramSize) this.code[(address - SRAM) >> 2] = 1;
  }

  /** Called after a change of the flash contents. */
  flashChanged() {
    this.pieces.fill(undefined, 0, FLASH_PIECES);
    this.visits.fill(0, 0, FLASH_PIECES);
  }

  /** Called after a write over translated code in SRAM. */
  sramChanged() {
    this.pieces.fill(undefined, FLASH_PIECES);
    this.visits.fill(0, FLASH_PIECES);
    this.code.fill(0);
  }

  /** Returns whether an access is one to flash, and lets it wait for its line. */
  inFlash(address) {
    if (address < XIP || address >= XIP_END) return false;
    if (!this.flashReadable) throw FAULT;
    this.stall += this.cache.access(address);
    return true;
  }

  /** Returns a halfword of code, for the translation: no time passes. */
  codeAt(address) {
    if ((address - SRAM) >>> 0 < this.sramSize) return this.sram16[(address - SRAM) >> 1];
    return this.flash16[(address & this.flashMask) >> 1];
  }

  fetch(address) {
    if ((address - XIP) >>> 0 < 0x4000000 && this.flashReadable) {
      this.stall += this.cache.access(address);
      return this.flash16[(address & this.flashMask) >> 1];
    }
    if ((address - SRAM) >>> 0 < this.sramSize) return this.sram16[(address - SRAM) >> 1];
    if (address < this.romSize) return this.rom16[address >> 1];
    throw FAULT;
  }

  read32(address) {
    address >>>= 0;
    if (address & 3) throw FAULT;
    if ((address - SRAM) >>> 0 < this.sramSize) return this.sram32[(address - SRAM) >> 2];
    if (this.inFlash(address)) return this.flash32[(address & this.flashMask) >> 2];
    if (address < this.romSize) return this.rom32[address >> 2];
    return this.readDevice(address) | 0;
  }

  read16(address) {
    address >>>= 0;
    if (address & 1) throw FAULT;
    if ((address - SRAM) >>> 0 < this.sramSize) return this.sram16[(address - SRAM) >> 1];
    if (this.inFlash(address)) return this.flash16[(address & this.flashMask) >> 1];
    if (address < this.romSize) return this.rom16[address >> 1];
    return (this.readDevice(address & ~3) >>> (8 * (address & 2))) & 0xffff;
  }

  read8(address) {
    address >>>= 0;
    if ((address - SRAM) >>> 0 < this.sramSize) return this.sram8[address - SRAM];
    if (this.inFlash(address)) return this.flash8[address & this.flashMask];
    if (address < this.romSize) return this.rom8[address];
    return (this.readDevice(address & ~3) >>> (8 * (address & 3))) & 0xff;
  }

  write32(address, value) {
    address >>>= 0;
    if (address & 3) throw FAULT;
    if ((address - SRAM) >>> 0 < this.sramSize) {
      this.sram32[(address - SRAM) >> 2] = value;
      if (this.code[(address - SRAM) >> 2]) this.sramChanged();
    } else {
      this.writeDevice(address, value >>> 0);
    }
  }

  write16(address, value) {
    address >>>= 0;
    if (address & 1) throw FAULT;
    if ((address - SRAM) >>> 0 < this.sramSize) {
      this.sram16[(address - SRAM) >> 1] = value;
      if (this.code[(address - SRAM) >> 2]) this.sramChanged();
    } else {
      this.writeNarrow(address, value & 0xffff, 0xffff, 0x10001);
    }
  }

  write8(address, value) {
    address >>>= 0;
    if ((address - SRAM) >>> 0 < this.sramSize) {
      this.sram8[address - SRAM] = value;
      if (this.code[(address - SRAM) >> 2]) this.sramChanged();
    } else {
      this.writeNarrow(address, value & 0xff, 0xff, 0x1010101);
    }
  }

  /**
   * Writes less than a word: USB memory is written by bytes; a register gets the value in every
   * lane (datasheet 2.1.4).
   */
  writeNarrow(address, value, mask, lanes) {
    const word = (address & ~3) >>> 0;
    if ((word - DPRAM) >>> 0 < 4096) {
      const shift = 8 * (address & 3);
      this.writeDevice(word, ((this.readDevice(word) & ~(mask << shift)) | (value << shift)) >>> 0);
    } else {
      this.writeDevice(word, Math.imul(value, lanes) >>> 0);
    }
  }

  /** Refuses an access that the memory protection forbids. */
  check(address) {
    if (this.mpu.refused.length > 0 && this.mpu.refuses(address, this.mcu.core.IPSR)) throw FAULT;
  }

  readDevice(address) {
    address >>>= 0;
    const { mcu } = this;
    this.check(address);
    if ((address - DPRAM) >>> 0 < 4096) return mcu.usbDPRAMView.getUint32(address - DPRAM, true);
    if (address >= SIO && address < PPB) return mcu.sio.readUint32(address - SIO);
    if (address >= PPB && address < PPB_END) return mcu.ppb.readUint32(address & 0xfff);
    const peripheral = mcu.findPeripheral(address);
    if (peripheral) return peripheral.readUint32(address & 0xfff);
    if (isReserved(address)) return 0;
    throw FAULT;
  }

  writeDevice(address, value) {
    const { mcu } = this;
    this.check(address);
    if ((address - DPRAM) >>> 0 < 4096) {
      mcu.usbDPRAMView.setUint32(address - DPRAM, value, true);
      mcu.usbCtrl.DPRAMUpdated(address - DPRAM, value);
    } else if (address >= SIO && address < PPB) {
      mcu.sio.writeUint32(address - SIO, value);
    } else if (address >= PPB && address < PPB_END) {
      mcu.ppb.writeUint32(address & 0xfff, value);
    } else {
      const peripheral = mcu.findPeripheral(address);
      if (peripheral) peripheral.writeUint32Atomic(address & 0xfff, value, (address >>> 12) & 3);
      // A write to cached flash has no effect and is no fault; CTRL.ERR_BADWRITE (datasheet 2.6.3)
      // applies to the other aliases.
      else if ((address - XIP) >>> 0 >= 0x1000000 && !isReserved(address)) throw FAULT;
    }
  }
}

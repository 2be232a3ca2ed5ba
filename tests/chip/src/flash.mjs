// The board's flash chip (a W25Q16JV on the Pico): contents that outlive a reset, erased and programmed in steps that take time, so
// that the power can fail in the middle of one.
//
// Erasing sets a 4 KB sector to ones, programming a 256-byte page clears bits. When the power fails, the step being done is
// left in part (the data sheet calls what it then holds undefined; here the first part of its bytes is done, in proportion to
// the time that it had), and what had not been begun is untouched.
import { CYCLES_PER_US } from './clock.mjs';

/** The Pico's flash, in bytes. */
export const FLASH_BYTES = 2 * 1024 * 1024;
export const SECTOR = 4096;
export const PAGE = 256;
/** Typical times of the W25Q16JV's data sheet (9.6, AC characteristics): sector erase 45 ms, page program 0.4 ms. */
const ERASE_CYCLES = 45_000 * CYCLES_PER_US;
const PROGRAM_CYCLES = 400 * CYCLES_PER_US;

export class Flash {
  constructor() {
    this.bytes = new Uint8Array(FLASH_BYTES).fill(0xff);
    /** Steps done since the start: { kind: 'erase' | 'program', offset, length, at }, `at` being the chip's cycle at its end. */
    this.log = [];
    /** Steps that are asked for and not done; the first of them is being done. */
    this.queue = [];
    this.began = 0;
  }

  /** The step being done, { kind, offset, length, cycles }, or null. */
  get busy() {
    return this.queue[0] ?? null;
  }

  /** Begins an erase (no `data`) or program call at `now` (in the chip's cycles). */
  begin(offset, length, data, now) {
    const size = data ? PAGE : SECTOR;
    if (offset % size !== 0 || length % size !== 0 || offset + length > FLASH_BYTES) {
      throw new Error(`flash: ${data ? 'program' : 'erase'} of ${length} bytes at 0x${offset.toString(16)} is not whole steps of ${size}`);
    }
    for (let done = 0; done < length; done += size) {
      const kind = data ? 'program' : 'erase';
      const cycles = data ? PROGRAM_CYCLES : ERASE_CYCLES;
      this.queue.push({ kind, offset: offset + done, length: size, cycles, data: data?.slice(done, done + size) });
    }
    this.began = now;
  }

  /** Does what is finished by `now`. Returns the cycles to the end of the next step, 0 if all is done. */
  work(now) {
    while (this.queue.length > 0) {
      const [step] = this.queue;
      const end = this.began + step.cycles;
      if (now < end) return end - now;
      this.apply(step, step.length, end);
      this.queue.shift();
      this.began = end;
    }
    return 0;
  }

  /** The processor is reset: the chip finishes its step by itself. With the power gone, it does not. */
  interrupt(now, powerFails) {
    const step = this.busy;
    if (step) {
      const share = powerFails ? Math.min(1, (now - this.began) / step.cycles) : 1;
      this.apply(step, Math.floor(step.length * share), now);
    }
    this.queue = [];
  }

  apply({ kind, offset, data }, length, at) {
    const target = this.bytes.subarray(offset, offset + length);
    if (kind === 'erase') target.fill(0xff);
    else target.forEach((byte, i) => (target[i] = byte & data[i]));
    this.log.push({ kind, offset, length, at });
  }
}

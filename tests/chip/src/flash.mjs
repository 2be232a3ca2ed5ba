// The board's flash chip (a W25Q16JV on the Pico). Its contents survive a reset. Erasing and
// programming take time, so that the power can fail during a step.
//
// Erasing sets a 4 KB sector to ones, programming a 256-byte page clears bits. If the power fails,
// the current step is partly done: the data sheet calls the contents undefined; here the first
// bytes are done, in proportion to the time. Later steps are not started.
import { CYCLES_PER_US } from './clock.mjs';

/** The Pico's flash, in bytes. */
export const FLASH_BYTES = 2 * 1024 * 1024;
export const SECTOR = 4096;
export const PAGE = 256;
/**
 * Typical times of the W25Q16JV's data sheet (9.6, AC characteristics): sector erase 45 ms, page
 * program 0.4 ms.
 */
const ERASE_CYCLES = 45_000 * CYCLES_PER_US;
const PROGRAM_CYCLES = 400 * CYCLES_PER_US;

/** Unique number of a chip that is given none. */
const ID = Uint8Array.of(0xe6, 0x61, 0x18, 0x60, 0x4b, 0x7f, 0x5a, 0x21);

export class Flash {
  constructor() {
    /** The unique number that every chip has (instruction 4Bh). */
    this.id = ID;
    this.bytes = new Uint8Array(FLASH_BYTES).fill(0xff);
    /**
     * Steps done since the start: { kind: 'erase' | 'program', offset, length, at }, with the
     * chip's cycle `at` the end.
     */
    this.log = [];
    /** Steps requested and not done; the first is in progress. */
    this.queue = [];
    this.began = 0;
  }

  /** The step in progress, { kind, offset, length, cycles }, or null. */
  get busy() {
    return this.queue[0] ?? null;
  }

  /** Starts an erase (no `data`) or program call at `now` (in the chip's cycles). */
  begin(offset, length, data, now) {
    const size = data ? PAGE : SECTOR;
    if (offset % size !== 0 || length % size !== 0 || offset + length > FLASH_BYTES) {
      const call = `${data ? 'program' : 'erase'} of ${length} bytes at 0x${offset.toString(16)}`;
      throw new Error(`flash: ${call} is not whole steps of ${size}`);
    }
    for (let done = 0; done < length; done += size) {
      const kind = data ? 'program' : 'erase';
      const cycles = data ? PROGRAM_CYCLES : ERASE_CYCLES;
      this.queue.push({
        kind,
        offset: offset + done,
        length: size,
        cycles,
        data: data?.slice(done, done + size),
      });
    }
    this.began = now;
  }

  /**
   * Applies the steps that end by `now`. Returns the cycles to the end of the next step, 0 if all
   * are done.
   */
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

  /** Called at a reset: the flash chip completes its step, unless the power fails. */
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

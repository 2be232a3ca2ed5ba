// The newest samples of the run: what the curves and the path in space show.

/** Number of samples: 2 minutes at 30 pictures a second, as many as the program keeps. */
const CAPACITY = 3600;

/**
 * Samples of the run, oldest first: `{ frame, time_s, position_m, error_m, target_m }`;
 * `position_m` and `error_m` are null where the ball was not located.
 */
export class History {
  samples = [];

  /** Adds the samples of an update: [frame, time_s, position_m, error_m, target_m]. */
  add(samples) {
    for (const [frame, time_s, position, error_m, target_m] of samples) {
      const last = this.samples.at(-1);
      // After a reconnection the program sends what it keeps once more.
      if (last && frame <= last.frame) continue;
      const position_m = position[0] === null ? null : position;
      this.samples.push({ frame, time_s, position_m, error_m, target_m });
    }
    if (this.samples.length > CAPACITY) this.samples.splice(0, this.samples.length - CAPACITY);
  }

  /** Forgets the samples: another run has begun. */
  clear() {
    this.samples = [];
  }

  /** Returns the samples of the last `seconds`. */
  last(seconds) {
    const end = this.samples.at(-1)?.time_s ?? 0;
    return this.samples.filter((sample) => sample.time_s >= end - seconds);
  }

  /** Returns the mean rate of the last pictures, pictures/s; null if it is unknown. */
  rate() {
    const part = this.samples.slice(-30);
    const span = part.length > 1 ? part.at(-1).time_s - part[0].time_s : 0;
    return span > 0 ? (part.length - 1) / span : null;
  }
}

// The newest samples of the run: what the curves and the path in space show.

/** Number of samples: 2 minutes at 30 pictures a second, as many as the program keeps. */
const CAPACITY = 3600;

/**
 * Samples of the run, oldest first: `{ number, time, position, error, target }` in seconds and
 * metres; `position` and `error` are null where the ball was not located.
 */
export class History {
  samples = [];

  /** Adds the samples of an update: [number, time, [x, y, z], |e|, [x, y, z] of the target]. */
  add(samples) {
    for (const [number, time, position, error, target] of samples) {
      const last = this.samples.at(-1);
      // After a reconnection the program sends what it keeps once more.
      if (last && number <= last.number) continue;
      const located = position[0] !== null;
      this.samples.push({ number, time, position: located ? position : null, error, target });
    }
    if (this.samples.length > CAPACITY) this.samples.splice(0, this.samples.length - CAPACITY);
  }

  /** Forgets the samples: another run has begun. */
  clear() {
    this.samples = [];
  }

  /** Returns the samples of the last `seconds`. */
  last(seconds) {
    const end = this.samples.at(-1)?.time ?? 0;
    return this.samples.filter((sample) => sample.time >= end - seconds);
  }

  /** Returns the mean rate of the last pictures, pictures/s; null if it is unknown. */
  rate() {
    const part = this.samples.slice(-30);
    const span = part.length > 1 ? part.at(-1).time - part[0].time : 0;
    return span > 0 ? (part.length - 1) / span : null;
  }
}

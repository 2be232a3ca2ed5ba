// The chosen target in the camera's picture: the program knows the camera, the page asks it.

const byId = (id) => document.getElementById(id);

/** Least time between two questions where the chosen target is seen, ms. */
const INTERVAL = 100;

/** Time between two questions while the program has no answer: it has no picture yet, ms. */
const RETRY = 500;

/** Time for which what became of a click is shown, ms. */
const SHOWN = 6000;

const NOTHING = { pixel: null, lines: null };

/** Pixels and points. `send(command)` sends a question; `choose(x, y, z)` gets a clicked point. */
export class Aim {
  #send;
  #choose;
  #plane = null;
  #asked = { text: "", at: 0 };
  #answer = NOTHING;
  #told = { text: "", at: -SHOWN };

  constructor(send, choose) {
    [this.#send, this.#choose] = [send, choose];
  }

  /** Sets the coordinate that is the same on the plane; null where the camera's pose is unknown. */
  setPlane(axis) {
    this.#plane = axis;
    this.#asked.text = "";
    this.#answer = NOTHING;
    for (const element of document.querySelectorAll(".pick")) element.hidden = axis === null;
  }

  /** Asks where the choice is seen, if it is another one. Returns what is known. */
  look(choice) {
    if (this.#plane === null) return NOTHING;
    const value = choice["xyz".indexOf(this.#plane)];
    const name = Number.isFinite(value) ? `plane ${this.#plane} = ${value.toFixed(3)} m` : "plane";
    if (byId("plane-name").textContent !== name) byId("plane-name").textContent = name;
    if (!choice.every(Number.isFinite)) return NOTHING;
    const text = choice.join(" ");
    const wait = text !== this.#asked.text ? INTERVAL : this.#answer.lines ? Infinity : RETRY;
    const now = performance.now();
    if (now - this.#asked.at > wait) {
      const [x, y, z] = choice;
      this.#asked = { text, at: now };
      this.#send({ type: "project", x, y, z });
    }
    const { pixel, lines } = this.#answer;
    return { pixel, lines: byId("plane").checked ? lines : null };
  }

  /** Takes the answer to a question where a point is seen. */
  takeProjected({ pixel, plane }) {
    this.#answer = { pixel, lines: plane?.lines ?? null };
  }

  /** Asks which point a pixel means; the plane goes through `choice`. */
  pick([u, v], choice) {
    if (!choice.every(Number.isFinite)) {
      this.#tell("choose numbers for x, y and z first: the plane goes through them");
      return;
    }
    const [x, y, z] = choice;
    this.#send({ type: "pick", u, v, x, y, z, depth: byId("depth").checked });
  }

  /** Takes the answer to a click. */
  takePicked({ point, text }) {
    if (point) this.#choose(...point);
    this.#tell(text);
  }

  /** Returns what became of the last click; "" a while after it. */
  told() {
    return performance.now() - this.#told.at < SHOWN ? this.#told.text : "";
  }

  #tell(text) {
    this.#told = { text, at: performance.now() };
  }
}

// Zoom of a drawing: wheel, keys and buttons.

/** Greatest factor, and factor of one step of the wheel, a key or a button. */
const GREATEST = 8;
const STEP = 1.25;

/** Zoom of a canvas: places without it become places with it. CSS pixels. */
export class Zoom {
  factor = 1;
  #canvas;
  /** Distance of the middle of the drawing from the middle of the canvas. */
  #shift = [0, 0];
  #changed;

  /**
   * Listens to the wheel over the canvas, the keys +, - and 0 in it, and the buttons with
   * `data-zoom` in `buttons`. `changed()` is called after each change.
   */
  constructor(canvas, buttons, changed = () => {}) {
    [this.#canvas, this.#changed] = [canvas, changed];
    const actions = {
      in: () => this.#zoom(STEP, this.#middle()),
      out: () => this.#zoom(1 / STEP, this.#middle()),
      whole: () => this.#set(1, [0, 0]),
    };
    for (const button of buttons.querySelectorAll("[data-zoom]")) {
      button.addEventListener("click", actions[button.dataset.zoom]);
    }
    canvas.addEventListener("wheel", (event) => {
      const isIn = event.deltaY < 0;
      // Below the smallest factor the wheel scrolls the page.
      if (event.ctrlKey || (!isIn && this.factor === 1)) return;
      event.preventDefault();
      this.#zoom(isIn ? STEP : 1 / STEP, [event.offsetX, event.offsetY]);
    }, { passive: false });
    const keys = { "+": "in", "=": "in", "-": "out", 0: "whole" };
    canvas.addEventListener("keydown", (event) => {
      const action = keys[event.key];
      if (!action || event.ctrlKey || event.metaKey || event.altKey) return;
      event.preventDefault();
      actions[action]();
    });
  }

  /** Returns where a place is drawn. */
  apply([column, row]) {
    const middle = this.#middle();
    return [column, row].map((place, k) =>
      middle[k] + this.factor * (place - middle[k]) + this.#shift[k]);
  }

  /** Returns the place that is drawn here. */
  invert([column, row]) {
    const middle = this.#middle();
    return [column, row].map((place, k) =>
      middle[k] + (place - middle[k] - this.#shift[k]) / this.factor);
  }

  /** Moves the drawing. */
  pan(right, down) {
    this.#set(this.factor, [this.#shift[0] + right, this.#shift[1] + down]);
  }

  #middle() {
    return [this.#canvas.clientWidth / 2, this.#canvas.clientHeight / 2];
  }

  /** Zooms by a factor; the place below `fixed` stays there. */
  #zoom(by, fixed) {
    const factor = Math.min(GREATEST, Math.max(1, this.factor * by));
    const middle = this.#middle();
    const place = this.invert(fixed);
    this.#set(factor, [0, 1].map((k) => fixed[k] - middle[k] - factor * (place[k] - middle[k])));
  }

  /** Sets the zoom. The middle of the canvas stays on the drawing. */
  #set(factor, shift) {
    const isWhole = factor < 1.01;
    this.factor = isWhole ? 1 : factor;
    this.#shift = this.#middle().map((half, k) => {
      const most = (this.factor - 1) * half;
      return Math.min(most, Math.max(-most, shift[k]));
    });
    this.#canvas.classList.toggle("zoomed", !isWhole);
    this.#changed();
  }
}

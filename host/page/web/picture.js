// The camera's picture: the ball, the target, the chosen point with its plane, and the choice of a
// pixel.

import { fit } from "./canvas.js";
import { Zoom } from "./zoom.js";

/** Movement of the pointer above which a press is no choice, pixels of the screen. */
const CLICK = 6;

/** Distance that a key moves the crosshair, and the same with Shift, pixels of the picture. */
const STEP = { fine: 1, coarse: 10 };

const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

/** The ball's circle is bright in both themes: the picture has none. */
const BALL = "#3ce65a";
const TARGET = "#ff5a3c";
const CHOICE = "#ffc14d";

/** Picture of the camera. The middle of its first pixel is (0, 0). */
export class Picture {
  #canvas;
  #zoom;
  #pick;
  #bitmap = null;
  #frame = null;
  /** Whether a person can choose a pixel. */
  #isAim = false;
  /** Pixel of the crosshair, which the keys move; null while it is not used. */
  #cursor = null;
  /** Whether something has changed since the last drawing. */
  #isChanged = true;
  #drawn = "";

  /** The buttons in `buttons` zoom. `pick([u, v])` gets the pixel that a person chooses. */
  constructor(canvas, buttons, pick) {
    [this.#canvas, this.#pick] = [canvas, pick];
    this.#zoom = new Zoom(canvas, buttons, () => { this.#isChanged = true; });
    this.#listen();
    this.#listenToKeys();
  }

  /** Sets whether a person can choose a pixel. */
  setAim(isAim) {
    this.#isAim = isAim;
  }

  /** Takes the observation of a frame, and its picture. */
  show(frame, bitmap) {
    this.#bitmap?.close();
    [this.#frame, this.#bitmap] = [frame, bitmap];
    this.#canvas.style.aspectRatio = `${bitmap.width} / ${bitmap.height}`;
    this.#isChanged = true;
  }

  /**
   * Draws the picture, if something has changed: with the target if `isTarget`, and with `aim`:
   * pixel and plane of the chosen point, null where they are unknown.
   */
  draw(isTarget, { pixel, lines }) {
    const { clientWidth, clientHeight } = this.#canvas;
    const drawn = JSON.stringify([isTarget, pixel, lines, clientWidth, clientHeight]);
    if (!this.#bitmap || (!this.#isChanged && drawn === this.#drawn)) return;
    [this.#isChanged, this.#drawn] = [false, drawn];
    const { context } = fit(this.#canvas);
    const [left, top] = this.#place([-0.5, -0.5]);
    const [right, bottom] = this.#place([this.#bitmap.width - 0.5, this.#bitmap.height - 0.5]);
    // Single pixels are seen in a large zoom.
    context.imageSmoothingEnabled = right - left < 3 * this.#bitmap.width;
    context.drawImage(this.#bitmap, left, top, right - left, bottom - top);
    for (const line of lines ?? []) this.#trace(context, line);
    if (this.#hasBall()) this.#drawBall(context, this.#frame);
    if (isTarget && this.#frame?.target_px) this.#drawTarget(context, this.#frame.target_px);
    if (pixel) this.#drawCross(context, pixel, CHOICE, 0);
    if (this.#cursor) this.#drawCross(context, this.#cursor, "#ffffff", 4);
  }

  /** Returns the scale of the whole picture, and its corner on the canvas. */
  #whole() {
    const { clientWidth, clientHeight } = this.#canvas;
    const { width, height } = this.#bitmap;
    const scale = Math.min(clientWidth / width, clientHeight / height);
    return { scale, corner: [clientWidth - scale * width, clientHeight - scale * height]
      .map((rest) => rest / 2) };
  }

  /** Returns where a pixel is drawn. */
  #place(pixel) {
    const { scale, corner } = this.#whole();
    return this.#zoom.apply(pixel.map((value, k) => corner[k] + scale * (value + 0.5)));
  }

  /** Returns the pixel that is drawn at a place; null beside the picture. */
  #pixel(place) {
    const { scale, corner } = this.#whole();
    const pixel = this.#zoom.invert(place).map((value, k) => (value - corner[k]) / scale - 0.5);
    const size = [this.#bitmap.width, this.#bitmap.height];
    return pixel.every((value, k) => value >= -0.5 && value < size[k] - 0.5) ? pixel : null;
  }

  #listen() {
    let press = null;
    this.#canvas.addEventListener("pointerdown", (event) => {
      if (event.button !== 0 || !this.#bitmap) return;
      this.#canvas.setPointerCapture(event.pointerId);
      press = { x: event.offsetX, y: event.offsetY, moved: false };
    });
    this.#canvas.addEventListener("pointermove", (event) => {
      if (!press) return;
      press.moved ||= Math.hypot(event.offsetX - press.x, event.offsetY - press.y) > CLICK;
      if (press.moved) this.#zoom.pan(event.movementX, event.movementY);
    });
    this.#canvas.addEventListener("pointerup", (event) => {
      const pixel = press && !press.moved && this.#pixel([event.offsetX, event.offsetY]);
      press = null;
      if (pixel && this.#isAim) this.#pick(pixel);
    });
    this.#canvas.addEventListener("pointercancel", () => { press = null; });
  }

  #listenToKeys() {
    this.#canvas.addEventListener("keydown", (event) => {
      if (!this.#bitmap || !this.#isAim) return;
      const arrow = ARROWS[event.key];
      if (arrow) this.#moveCursor(arrow, event.shiftKey ? STEP.coarse : STEP.fine);
      else if (event.key === "Enter" && !event.repeat && this.#cursor) this.#pick(this.#cursor);
      else return;
      event.preventDefault();
    });
    this.#canvas.addEventListener("blur", () => this.#setCursor(null));
  }

  /** Moves the crosshair; it begins at the ball, or in the middle. */
  #moveCursor([right, down], step) {
    const { width, height } = this.#bitmap;
    const middle = this.#hasBall()
      ? [Math.round(this.#frame.u_px), Math.round(this.#frame.v_px)]
      : [Math.floor(width / 2), Math.floor(height / 2)];
    const [u, v] = this.#cursor ?? middle;
    const clamp = (value, size) => Math.min(size - 1, Math.max(0, value));
    this.#setCursor([clamp(u + step * right, width), clamp(v + step * down, height)]);
  }

  #setCursor(cursor) {
    this.#cursor = cursor;
    this.#isChanged = true;
  }

  /** Draws a line through pixels, with gaps where one is null. */
  #trace(context, pixels) {
    context.beginPath();
    let isDown = false;
    for (const pixel of pixels) {
      if (pixel) context[isDown ? "lineTo" : "moveTo"](...this.#place(pixel));
      isDown = pixel !== null;
    }
    context.setLineDash([]);
    context.lineWidth = 1;
    context.strokeStyle = "#ffc14d99";
    context.stroke();
  }

  /** Returns whether the ball was found in the picture. */
  #hasBall() {
    return typeof this.#frame?.u_px === "number";
  }

  #drawBall(context, { u_px: u, v_px: v, radius_px: radius }) {
    const [x, y] = this.#place([u, v]);
    outlined(context, BALL, () => {
      context.arc(x, y, radius * this.#whole().scale * this.#zoom.factor, 0, 2 * Math.PI);
    });
  }

  #drawTarget(context, pixel) {
    const [x, y] = this.#place(pixel);
    outlined(context, TARGET, () => {
      // Smaller than the ball is seen on a telephone.
      context.arc(x, y, 5, 0, 2 * Math.PI);
      for (const [right, down] of Object.values(ARROWS)) {
        context.moveTo(x + 5 * right, y + 5 * down);
        context.lineTo(x + 13 * right, y + 13 * down);
      }
    });
  }

  /** Draws a cross with a gap of this half width. */
  #drawCross(context, pixel, colour, gap) {
    const [x, y] = this.#place(pixel);
    outlined(context, colour, () => {
      for (const [right, down] of Object.values(ARROWS)) {
        context.moveTo(x + gap * right, y + gap * down);
        context.lineTo(x + (gap + 9) * right, y + (gap + 9) * down);
      }
    });
  }
}

/** Draws a line with a dark edge, which is seen on any picture. */
function outlined(context, colour, trace) {
  context.setLineDash([]);
  for (const [style, width] of [["#000000aa", 4], [colour, 2]]) {
    context.strokeStyle = style;
    context.lineWidth = width;
    context.beginPath();
    trace();
    context.stroke();
  }
}

// Choice of a pixel in the picture: crosshair, magnifier, keys.

/** Side of the square that the magnifier shows, pixels of the picture; odd, to have a middle. */
const LOUPE = 21;

/** Distance that a key moves the crosshair, and the same with Shift, pixels. */
const STEP = { fine: 1, coarse: 10 };

const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

/**
 * Picture in which a person chooses pixels. The middle of the first pixel is (0, 0).
 *
 * A mouse chooses with a click. A finger moves the crosshair only, because it hides the pixel.
 */
export class Picker {
  #canvas;
  #loupe;
  #events;
  #bitmap = null;
  #marks = [];
  /** Column and row of the crosshair. */
  #cursor = null;

  /** Calls `events.move([u, v])`, `events.pick()` and `events.undo()`. */
  constructor(canvas, loupe, events) {
    [this.#canvas, this.#loupe, this.#events] = [canvas, loupe, events];
    this.#listen();
  }

  /** Returns column and row of the crosshair; null before there is a picture. */
  cursor() {
    return this.#cursor;
  }

  /** Takes a picture and shows it with the marks. */
  setPicture(bitmap) {
    this.#bitmap?.close();
    this.#bitmap = bitmap;
    if (this.#canvas.width !== bitmap.width) this.#canvas.width = bitmap.width;
    if (this.#canvas.height !== bitmap.height) this.#canvas.height = bitmap.height;
    if (this.#cursor) this.draw();
    else this.#moveTo(Math.floor(bitmap.width / 2), Math.floor(bitmap.height / 2));
  }

  /** Sets the marks: `{ name, pixel: [u, v] }`. */
  setMarks(marks) {
    this.#marks = marks;
    this.draw();
  }

  /** Moves the crosshair by whole pixels. */
  nudge(right, down) {
    if (this.#cursor) this.#moveTo(this.#cursor[0] + right, this.#cursor[1] + down);
  }

  draw() {
    if (!this.#bitmap) return;
    const context = this.#canvas.getContext("2d");
    context.drawImage(this.#bitmap, 0, 0);
    const scale = Math.max(1, this.#canvas.width / Math.max(1, this.#canvas.clientWidth));
    for (const { name, pixel } of this.#marks) drawMark(context, name, pixel, scale);
    drawCross(context, this.#cursor, scale);
    this.#drawLoupe();
  }

  #drawLoupe() {
    const { width } = this.#loupe;
    const context = this.#loupe.getContext("2d");
    const [u, v] = this.#cursor.map(Math.round);
    const corner = [u - (LOUPE - 1) / 2, v - (LOUPE - 1) / 2];
    const side = width / LOUPE;
    context.imageSmoothingEnabled = false;
    context.fillStyle = "#24252b";
    context.fillRect(0, 0, width, width);
    context.drawImage(this.#bitmap, ...corner, LOUPE, LOUPE, 0, 0, width, width);
    const middle = ((LOUPE - 1) / 2) * side;
    outlined(context, 1, () => context.rect(middle, middle, side, side));
  }

  #moveTo(u, v) {
    const clamp = (value, size) => Math.min(size - 1, Math.max(0, value));
    this.#cursor = [clamp(u, this.#canvas.width), clamp(v, this.#canvas.height)];
    this.draw();
    this.#events.move(this.#cursor);
  }

  /** Moves the crosshair to the pointer. */
  #follow(event) {
    if (!this.#bitmap) return;
    const { clientWidth, clientHeight, width, height } = this.#canvas;
    const u = (event.offsetX * width) / clientWidth - 0.5;
    const v = (event.offsetY * height) / clientHeight - 0.5;
    this.#moveTo(Math.round(10 * u) / 10, Math.round(10 * v) / 10);
  }

  #listen() {
    this.#canvas.addEventListener("pointermove", (event) => this.#follow(event));
    this.#canvas.addEventListener("pointerdown", (event) => {
      this.#follow(event);
      if (event.pointerType === "mouse" && event.button === 0) this.#events.pick();
    });
    this.#canvas.addEventListener("keydown", (event) => {
      const arrow = ARROWS[event.key];
      if (arrow) {
        const step = event.shiftKey ? STEP.coarse : STEP.fine;
        this.nudge(step * arrow[0], step * arrow[1]);
      } else if (event.key === "Enter" && !event.repeat) this.#events.pick();
      else if (event.key === "Backspace" && !event.repeat) this.#events.undo();
      else return;
      event.preventDefault();
    });
  }
}

/** Draws a line in white with a dark edge, which is seen on any picture. */
function outlined(context, width, trace) {
  for (const [colour, extra] of [["#000000", 2], ["#ffffff", 0]]) {
    context.strokeStyle = colour;
    context.lineWidth = width + extra;
    context.beginPath();
    trace();
    context.stroke();
  }
}

function drawCross(context, [u, v], scale) {
  const [x, y] = [u + 0.5, v + 0.5];
  const [inner, outer] = [4 * scale, 14 * scale];
  outlined(context, scale, () => {
    for (const [right, down] of [[1, 0], [-1, 0], [0, 1], [0, -1]]) {
      context.moveTo(x + inner * right, y + inner * down);
      context.lineTo(x + outer * right, y + outer * down);
    }
  });
}

function drawMark(context, name, [u, v], scale) {
  const [x, y] = [u + 0.5, v + 0.5];
  outlined(context, 1.5 * scale, () => context.arc(x, y, 7 * scale, 0, 2 * Math.PI));
  context.font = `bold ${16 * scale}px system-ui, sans-serif`;
  context.lineWidth = 4 * scale;
  context.strokeStyle = "#000000";
  context.fillStyle = "#ffffff";
  const at = [x - 5 * scale, y - 11 * scale];
  context.strokeText(name, ...at);
  context.fillText(name, ...at);
}

// Drawing of the rig in space: lines and texts in a projection, and what is drawn with them.

import { COLOURS, roundStep } from "./canvas.js";

/** Length of a tick of an axis, and distance of its number, pixels. */
const TICK = 4;
const NUMBER = 16;

/** Drawing in space. */
export class Pen {
  constructor(context, view) {
    this.context = context;
    this.view = view;
  }

  line(points, colour, width = 1, dash = []) {
    this.context.strokeStyle = colour;
    this.context.lineWidth = width;
    this.context.setLineDash(dash);
    this.context.beginPath();
    let isDown = false;
    for (const point of points) {
      if (point === null) {
        isDown = false;
        continue;
      }
      const [x, y] = this.view.pixel(point);
      if (isDown) this.context.lineTo(x, y);
      else this.context.moveTo(x, y);
      isDown = true;
    }
    this.context.stroke();
  }

  /** Returns the direction on the screen from a point to another one. */
  direction(from, to) {
    const [[x, y], [u, v]] = [this.view.pixel(from), this.view.pixel(to)];
    const length = Math.hypot(u - x, v - y) || 1;
    return [(u - x) / length, (v - y) / length];
  }

  /** Draws a short line on the screen from a point. */
  tick(point, [right, down], colour) {
    const [x, y] = this.view.pixel(point);
    this.context.strokeStyle = colour;
    this.context.lineWidth = 1;
    this.context.setLineDash([]);
    this.context.beginPath();
    this.context.moveTo(x, y);
    this.context.lineTo(x + right, y + down);
    this.context.stroke();
  }

  dot(point, radius, colour) {
    this.#circle(point, radius);
    this.context.fillStyle = colour;
    this.context.fill();
  }

  ring(point, radius, colour) {
    this.#circle(point, radius);
    this.context.strokeStyle = colour;
    this.context.lineWidth = 3;
    this.context.setLineDash([]);
    this.context.stroke();
  }

  text(text, point, colour, [right, down] = [8, -8]) {
    const [x, y] = this.view.pixel(point);
    this.context.fillStyle = colour;
    this.context.textAlign = "center";
    this.context.textBaseline = "middle";
    this.context.fillText(text, x + right, y + down);
  }

  #circle(point, radius) {
    const [x, y] = this.view.pixel(point);
    this.context.beginPath();
    this.context.arc(x, y, radius, 0, 2 * Math.PI);
  }
}

export function boxCorners([low, high]) {
  return [0, 1, 2, 3, 4, 5, 6, 7].map((k) =>
    [0, 1, 2].map((axis) => (k & (1 << axis) ? high[axis] : low[axis])));
}

export function drawBox(draw, corners) {
  for (let k = 0; k < 8; k += 1) {
    for (const bit of [1, 2, 4]) {
      if (!(k & bit)) draw.line([corners[k], corners[k | bit]], COLOURS.faint, 1.5);
    }
  }
}

/**
 * Draws the axes with numbers in metres: x and y along the nearest edges of the floor, z along the
 * edge at the left.
 */
export function drawAxes(draw, [low, high]) {
  const { forward, right } = draw.view;
  const far = (axis, sign) => (sign > 0 ? high[axis] : low[axis]);
  const edges = [
    [low[0], far(1, forward[1]), low[2]],
    [far(0, forward[0]), low[1], low[2]],
    [far(0, -right[0]), far(1, -right[1]), low[2]],
  ];
  const middle = low.map((value, k) => (k === 2 ? value : (value + high[k]) / 2));
  edges.forEach((from, axis) => {
    const at = (value) => from.map((place, k) => (k === axis ? value : place));
    const centre = (low[axis] + high[axis]) / 2;
    const outward = axis === 2 ? [-1, 0] : draw.direction(middle, at(centre));
    draw.line([at(low[axis]), at(high[axis])], COLOURS.grey, 1.5);
    const step = roundStep(high[axis] - low[axis], 4);
    const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
    // The ends belong to two axes.
    const first = Math.ceil((low[axis] + 0.3 * step) / step) * step;
    for (let value = first; value < high[axis] - 0.3 * step; value += step) {
      draw.tick(at(value), outward.map((side) => TICK * side), COLOURS.grey);
      const beside = outward.map((side) => NUMBER * side);
      draw.text(value.toFixed(digits), at(value), COLOURS.grey, beside);
    }
    const [place, away] = axis === 2
      ? [high[axis], [0, -NUMBER]] : [centre, outward.map((side) => 2.9 * NUMBER * side)];
    draw.text(`${"xyz"[axis]} (m)`, at(place), COLOURS.ink, away);
  });
}

export function drawMotors(draw, motors, names, ball, floor) {
  draw.line([...motors, motors[0]], COLOURS.grey, 1.5);
  motors.forEach((motor, index) => {
    draw.line([motor, [motor[0], motor[1], floor]], COLOURS.faint, 1, [3, 4]);
    if (ball) draw.line([motor, ball], COLOURS.grey, 1);
    draw.dot(motor, 5, COLOURS.ink);
    draw.text(names[index], motor, COLOURS.ink, [0, -14]);
  });
}

export function drawPath(draw, path, floor) {
  const shadow = path.map((point) => point && [point[0], point[1], floor]);
  draw.line(shadow, COLOURS.shadow, 1.5);
  draw.line(path, COLOURS.measured, 2);
  const start = path.find((point) => point !== null);
  if (start) draw.dot(start, 4, COLOURS.start);
}

export function drawTarget(draw, target, floor) {
  draw.line([target, [target[0], target[1], floor]], COLOURS.target, 1, [3, 3]);
  draw.ring(target, 9, COLOURS.target);
}

/** Draws the chosen target as a cross with a line to the floor. */
export function drawChoice(draw, choice, floor) {
  if (choice.some((value) => !Number.isFinite(value))) return;
  const [x, y, z] = choice;
  const size = 0.03;
  draw.line([choice, [x, y, floor]], COLOURS.choice, 1, [2, 3]);
  draw.line([[x - size, y, z], [x + size, y, z]], COLOURS.choice, 2);
  draw.line([[x, y - size, z], [x, y + size, z]], COLOURS.choice, 2);
  draw.line([[x, y, z - size], [x, y, z + size]], COLOURS.choice, 2);
}

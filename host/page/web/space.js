// The rig in space: workspace, motors, path, target, and the choice of a target. Parallel
// projection, as in figure 5 of the paper.

import { fit, COLOURS } from "./canvas.js";

const RADIANS = Math.PI / 180;

/** Smallest and largest elevation of the viewer: below the smallest one a click has no depth. */
const ELEVATION = { least: 12, greatest: 89 };

/** Movement of the pointer above which a press is a turn and no choice, pixels. */
const CLICK = 6;

/** Distance from the cross at which a press takes hold of it, pixels. */
const GRIP = 16;

/** View of the rig that a person can turn and choose a target in. */
export class Space {
  #canvas;
  #azimuth = -25;
  #elevation = 24;
  #rig = null;
  #view = null;
  #actions;
  #choice = [NaN, NaN, NaN];

  /**
   * `actions` get points of the workspace at the chosen height: `choose(x, y)` after a click,
   * `move(x, y)` while a person drags the cross, and `release(x, y)` at the end of that.
   */
  constructor(canvas, actions) {
    this.#canvas = canvas;
    this.#actions = actions;
    this.#listen();
  }

  setRig(rig) {
    this.#rig = rig;
  }

  /** Draws the path of `history`, the run's goal and the choice [x, y, z]. */
  draw(history, goal, choice) {
    if (!this.#rig) return;
    const { context, width, height } = fit(this.#canvas);
    const { workspace, motors, motor_names: names } = this.#rig;
    const corners = boxCorners(workspace);
    const points = [...corners, ...(motors ?? [])];
    this.#view = project(this.#azimuth, this.#elevation, points, width, height);
    this.#choice = choice;
    const draw = new Pen(context, this.#view);
    drawBox(draw, corners);
    drawAxes(draw, workspace);
    const path = history.samples.map((sample) => sample.position);
    const ball = path.findLast((position) => position !== null) ?? null;
    if (motors) drawMotors(draw, motors, names, ball, workspace[0][2]);
    drawPath(draw, path, workspace[0][2]);
    if (goal) drawTarget(draw, goal.target, workspace[0][2]);
    drawChoice(draw, choice, workspace[0][2]);
    if (ball) draw.dot(ball, 6, COLOURS.measured);
  }

  #listen() {
    let press = null;
    this.#canvas.addEventListener("pointerdown", (event) => {
      this.#canvas.setPointerCapture(event.pointerId);
      const isOnCross = this.#isOnCross(event.offsetX, event.offsetY);
      press = { x: event.offsetX, y: event.offsetY, azimuth: this.#azimuth,
        elevation: this.#elevation, moved: false, isOnCross };
    });
    this.#canvas.addEventListener("pointermove", (event) => {
      if (!press) return;
      const [right, down] = [event.offsetX - press.x, event.offsetY - press.y];
      press.moved ||= Math.hypot(right, down) > CLICK;
      if (!press.moved) return;
      if (press.isOnCross) {
        this.#actions.move(...this.#pointBelow(event.offsetX, event.offsetY));
        return;
      }
      this.#azimuth = press.azimuth - 0.5 * right;
      const elevation = press.elevation + 0.5 * down;
      this.#elevation = Math.min(ELEVATION.greatest, Math.max(ELEVATION.least, elevation));
    });
    this.#canvas.addEventListener("pointerup", (event) => {
      const isDrag = press?.moved && press.isOnCross;
      const action = isDrag ? "release" : press && !press.moved && this.#view ? "choose" : null;
      if (action) this.#actions[action](...this.#pointBelow(event.offsetX, event.offsetY));
      press = null;
    });
    this.#canvas.addEventListener("pointercancel", () => {
      // The ball stops where the cross is.
      if (press?.moved && press.isOnCross) this.#actions.release(this.#choice[0], this.#choice[1]);
      press = null;
    });
  }

  /** Returns whether the pointer is on the cross of the choice. */
  #isOnCross(column, row) {
    if (!this.#view || this.#choice.some((value) => !Number.isFinite(value))) return false;
    const [x, y] = this.#view.pixel(this.#choice);
    return Math.hypot(column - x, row - y) <= GRIP;
  }

  /** Returns x and y of the point below the pointer at the chosen height, in the workspace. */
  #pointBelow(column, row) {
    const point = this.#view.atHeight(column, row, this.#choice[2]);
    const [low, high] = this.#rig.workspace;
    return [0, 1].map((axis) => Math.min(high[axis], Math.max(low[axis], point[axis])));
  }
}

/** Returns a projection that fits `points` into the canvas. */
function project(azimuth, elevation, points, width, height) {
  const [ca, sa] = [Math.cos(azimuth * RADIANS), Math.sin(azimuth * RADIANS)];
  const [ce, se] = [Math.cos(elevation * RADIANS), Math.sin(elevation * RADIANS)];
  const right = ([x, y]) => -sa * x + ca * y;
  const up = ([x, y, z]) => -se * (ca * x + sa * y) + ce * z;
  const extent = (axis) => {
    const all = points.map(axis);
    return [Math.min(...all), Math.max(...all)];
  };
  const [[left, farRight], [bottom, top]] = [extent(right), extent(up)];
  const margin = 26;
  const across = (width - 2 * margin) / (farRight - left);
  const scale = Math.min(across, (height - 2 * margin) / (top - bottom));
  const [dx, dy] = [(width - scale * (left + farRight)) / 2, (height + scale * (bottom + top)) / 2];
  return {
    pixel: (point) => [dx + scale * right(point), dy - scale * up(point)],
    /** Returns the point at height z that is drawn at this pixel. */
    atHeight: (column, row, z) => {
      const [r, u] = [(column - dx) / scale, (dy - row) / scale];
      const forward = (ce * z - u) / se;
      return [forward * ca - r * sa, forward * sa + r * ca, z];
    },
  };
}

/** Drawing in space. */
class Pen {
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

function boxCorners([low, high]) {
  return [0, 1, 2, 3, 4, 5, 6, 7].map((k) =>
    [0, 1, 2].map((axis) => (k & (1 << axis) ? high[axis] : low[axis])));
}

function drawBox(draw, corners) {
  for (let k = 0; k < 8; k += 1) {
    for (const bit of [1, 2, 4]) {
      if (!(k & bit)) draw.line([corners[k], corners[k | bit]], COLOURS.faint, 1.5);
    }
  }
}

/** Names the axes at the edges that meet in the lowest corner. */
function drawAxes(draw, [low, high]) {
  ["x", "y", "z"].forEach((name, axis) => {
    const end = [...low];
    end[axis] = high[axis];
    draw.line([low, end], COLOURS.grey, 1.5);
    draw.text(`${name} ${high[axis].toFixed(2)}`, end, COLOURS.grey, [0, axis === 2 ? -9 : 11]);
  });
}

function drawMotors(draw, motors, names, ball, floor) {
  draw.line([...motors, motors[0]], COLOURS.grey, 1.5);
  motors.forEach((motor, index) => {
    draw.line([motor, [motor[0], motor[1], floor]], COLOURS.faint, 1, [3, 4]);
    if (ball) draw.line([motor, ball], COLOURS.grey, 1);
    draw.dot(motor, 5, COLOURS.ink);
    draw.text(names[index], motor, COLOURS.ink, [0, -14]);
  });
}

function drawPath(draw, path, floor) {
  const shadow = path.map((point) => point && [point[0], point[1], floor]);
  draw.line(shadow, "#b4becd", 1.5);
  draw.line(path, COLOURS.measured, 2);
  const start = path.find((point) => point !== null);
  if (start) draw.dot(start, 4, COLOURS.start);
}

function drawTarget(draw, target, floor) {
  draw.line([target, [target[0], target[1], floor]], COLOURS.target, 1, [3, 3]);
  draw.ring(target, 9, COLOURS.target);
}

/** Draws the chosen target as a cross with a line to the floor. */
function drawChoice(draw, choice, floor) {
  if (choice.some((value) => !Number.isFinite(value))) return;
  const [x, y, z] = choice;
  const size = 0.03;
  draw.line([choice, [x, y, floor]], COLOURS.choice, 1, [2, 3]);
  draw.line([[x - size, y, z], [x + size, y, z]], COLOURS.choice, 2);
  draw.line([[x, y - size, z], [x, y + size, z]], COLOURS.choice, 2);
  draw.line([[x, y, z - size], [x, y, z + size]], COLOURS.choice, 2);
}

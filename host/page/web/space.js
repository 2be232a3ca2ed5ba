// The rig in space: workspace, motors, path, target, and the choice of a target. Parallel
// projection, as in figure 5 of the paper.

import { fit, COLOURS } from "./canvas.js";
import {
  Pen, boxCorners, drawAxes, drawBox, drawChoice, drawMotors, drawPath, drawTarget,
} from "./pen.js";
import { Zoom } from "./zoom.js";

const RADIANS = Math.PI / 180;

/** Smallest and largest elevation of the viewer: below the smallest one a click has no depth. */
const ELEVATION = { least: 12, greatest: 89 };

/** Movement of the pointer above which a press is a turn and no choice, pixels. */
const CLICK = 6;

/** Distance from the cross at which a press takes hold of it, pixels. */
const GRIP = 16;

/** Angle that a key turns the view by, degrees. */
const TURN = 5;

/** Turns of azimuth and elevation by the arrow keys. */
const ARROWS = {
  ArrowLeft: [TURN, 0], ArrowRight: [-TURN, 0], ArrowUp: [0, -TURN], ArrowDown: [0, TURN],
};

/** View of the rig that a person can turn and choose a target in. */
export class Space {
  #canvas;
  #azimuth = -25;
  #elevation = 24;
  #rig = null;
  #view = null;
  #actions;
  #zoom;
  #choice = [NaN, NaN, NaN];

  /**
   * The buttons in `buttons` zoom. `actions` get points of the workspace at the chosen height:
   * `choose(x, y)` after a click, `move(x, y)` while a person drags the cross, and
   * `release(x, y)` at the end of that.
   */
  constructor(canvas, buttons, actions) {
    this.#canvas = canvas;
    this.#actions = actions;
    this.#zoom = new Zoom(canvas, buttons);
    this.#listen();
    this.#listenToKeys();
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
    const view = project(this.#azimuth, this.#elevation, points, width, height);
    this.#view = zoomed(view, this.#zoom);
    this.#choice = choice;
    const draw = new Pen(context, this.#view);
    drawBox(draw, corners);
    drawAxes(draw, workspace);
    const path = history.samples.map((sample) => sample.position_m);
    const ball = path.findLast((position) => position !== null) ?? null;
    if (motors) drawMotors(draw, motors, names, ball, workspace[0][2]);
    drawPath(draw, path, workspace[0][2]);
    if (goal) drawTarget(draw, goal.target_m, workspace[0][2]);
    drawChoice(draw, choice, workspace[0][2]);
    if (ball) draw.dot(ball, 6, COLOURS.measured);
  }

  #listen() {
    let press = null;
    this.#canvas.addEventListener("pointerdown", (event) => {
      this.#canvas.setPointerCapture(event.pointerId);
      const isOnCross = this.#isOnCross(event.offsetX, event.offsetY);
      press = { x: event.offsetX, y: event.offsetY, azimuth: this.#azimuth,
        elevation: this.#elevation, moved: false, isOnCross, isPan: event.shiftKey };
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
      if (press.isPan) {
        this.#zoom.pan(event.movementX, event.movementY);
        return;
      }
      this.#turn(press.azimuth - 0.5 * right, press.elevation + 0.5 * down);
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

  #listenToKeys() {
    this.#canvas.addEventListener("keydown", (event) => {
      const turn = ARROWS[event.key];
      if (!turn) return;
      event.preventDefault();
      this.#turn(this.#azimuth + turn[0], this.#elevation + turn[1]);
    });
  }

  #turn(azimuth, elevation) {
    this.#azimuth = azimuth;
    this.#elevation = Math.min(ELEVATION.greatest, Math.max(ELEVATION.least, elevation));
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
  const margin = 32;
  const across = (width - 2 * margin) / (farRight - left);
  const scale = Math.min(across, (height - 2 * margin) / (top - bottom));
  const [dx, dy] = [(width - scale * (left + farRight)) / 2, (height + scale * (bottom + top)) / 2];
  return {
    /** Directions to the viewer and to the right, in x and y. */
    forward: [ca, sa],
    right: [-sa, ca],
    pixel: (point) => [dx + scale * right(point), dy - scale * up(point)],
    /** Returns the point at height z that is drawn at this pixel. */
    atHeight: (column, row, z) => {
      const [r, u] = [(column - dx) / scale, (dy - row) / scale];
      const forward = (ce * z - u) / se;
      return [forward * ca - r * sa, forward * sa + r * ca, z];
    },
  };
}

/** Returns a projection with a zoom. */
function zoomed(view, zoom) {
  return {
    ...view,
    pixel: (point) => zoom.apply(view.pixel(point)),
    atHeight: (column, row, z) => view.atHeight(...zoom.invert([column, row]), z),
  };
}

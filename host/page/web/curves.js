// x, y, z and |e| over time, as in figure 4 of the paper.

import { fit, COLOURS, roundStep } from "./canvas.js";

/** Length of the time axis, seconds: short, and all that is kept. */
const WINDOWS = { short: 20, whole: 120 };

/** Space for numbers at the left, above and below a panel, pixels. */
const MARGIN = { left: 46, right: 18, top: 8, bottom: 16 };

const NAMES = ["x (m)", "y (m)", "z (m)", "|e| (mm)"];

/** Returns the measured value and the wanted value of panel `index` in a sample. */
function values(sample, index, radius) {
  if (index < 3) return [sample.position_m?.[index] ?? null, sample.target_m[index]];
  return [sample.error_m === null ? null : 1e3 * sample.error_m, 1e3 * radius];
}

/** Draws the curves of `history` into the canvas; `radius` is the threshold of |e|, metres. */
export function drawCurves(canvas, history, radius, whole) {
  const { context, width, height } = fit(canvas);
  const seconds = whole ? WINDOWS.whole : WINDOWS.short;
  const samples = history.last(seconds);
  const end = Math.max(samples.at(-1)?.time_s ?? 0, seconds);
  const panelHeight = (height - 6) / NAMES.length;
  NAMES.forEach((name, index) => {
    const panel = {
      left: MARGIN.left,
      right: width - MARGIN.right,
      top: index * panelHeight + MARGIN.top,
      bottom: (index + 1) * panelHeight - MARGIN.bottom,
      from: end - seconds,
      to: end,
      ...range(samples, index, radius),
    };
    drawAxes(context, panel, index === NAMES.length - 1);
    const lines = samples.map((sample) => [sample.time_s, ...values(sample, index, radius)]);
    drawLine(context, panel, lines.map(([t, , wanted]) => [t, wanted]), COLOURS.target, [6, 4]);
    drawLine(context, panel, lines.map(([t, measured]) => [t, measured]), COLOURS.measured, []);
    drawName(context, panel, name);
  });
}

/** Returns the range of a panel: at least 40 mm, so that noise stays small. */
function range(samples, index, radius) {
  const all = samples.flatMap((s) => values(s, index, radius)).filter((value) => value !== null);
  const least = all.length ? Math.min(...all) : 0;
  const greatest = all.length ? Math.max(...all) : 1;
  if (index === 3) return { low: 0, high: 1.08 * Math.max(greatest, 2e3 * radius) };
  const half = Math.max(0.58 * (greatest - least), 0.02);
  const middle = (least + greatest) / 2;
  return { low: middle - half, high: middle + half };
}

const column = (panel, time) =>
  panel.left + ((time - panel.from) / (panel.to - panel.from)) * (panel.right - panel.left);
const row = (panel, value) =>
  panel.bottom - ((value - panel.low) / (panel.high - panel.low)) * (panel.bottom - panel.top);

function drawAxes(context, panel, isLast) {
  context.strokeStyle = COLOURS.faint;
  context.fillStyle = COLOURS.ink;
  context.lineWidth = 1;
  context.setLineDash([]);
  context.textBaseline = "middle";
  context.textAlign = "right";
  const step = roundStep(panel.high - panel.low, 4);
  const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  for (let value = Math.ceil(panel.low / step) * step; value <= panel.high; value += step) {
    const y = row(panel, value);
    segment(context, panel.left, y, panel.right, y);
    context.fillText((value + 0).toFixed(digits).replace(/^-(0\.?0*)$/, "$1"), panel.left - 5, y);
  }
  context.textBaseline = "top";
  context.textAlign = "center";
  const seconds = roundStep(panel.to - panel.from, 5);
  for (let time = Math.ceil(panel.from / seconds) * seconds; time <= panel.to; time += seconds) {
    const x = column(panel, time);
    segment(context, x, panel.top, x, panel.bottom);
    context.fillText(isLast && time + seconds > panel.to ? `${time} s` : time, x, panel.bottom + 2);
  }
}

/** Writes the name of a panel over its lines. */
function drawName(context, panel, name) {
  const { width } = context.measureText(name);
  context.fillStyle = COLOURS.panel;
  context.fillRect(panel.right - width - 8, panel.top + 1, width + 7, 15);
  context.fillStyle = COLOURS.ink;
  context.textBaseline = "top";
  context.textAlign = "right";
  context.fillText(name, panel.right - 4, panel.top + 2);
}

function segment(context, x1, y1, x2, y2) {
  context.beginPath();
  context.moveTo(x1, y1);
  context.lineTo(x2, y2);
  context.stroke();
}

/** Draws a line with gaps where the value is null. */
function drawLine(context, panel, points, colour, dash) {
  context.strokeStyle = colour;
  context.lineWidth = 2;
  context.setLineDash(dash);
  context.beginPath();
  let isDown = false;
  for (const [time, value] of points) {
    if (value === null) {
      isDown = false;
      continue;
    }
    const [x, y] = [column(panel, time), row(panel, value)];
    if (isDown) context.lineTo(x, y);
    else context.moveTo(x, y);
    isDown = true;
  }
  context.stroke();
}

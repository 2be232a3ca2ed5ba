// Helpers of all drawings.

/** Colours of the run's figures. */
export const COLOURS = {
  ink: "#32323a",
  faint: "#dadce0",
  grey: "#787c84",
  measured: "#1f61ab",
  target: "#c83c28",
  start: "#288c46",
  choice: "#b06a00",
};

/** Fits a canvas to its size on the screen and clears it. Returns context and size, CSS pixels. */
export function fit(canvas) {
  const scale = window.devicePixelRatio || 1;
  const { clientWidth: width, clientHeight: height } = canvas;
  const [columns, rows] = [Math.round(width * scale), Math.round(height * scale)];
  if (canvas.width !== columns || canvas.height !== rows) {
    canvas.width = columns;
    canvas.height = rows;
  }
  const context = canvas.getContext("2d");
  context.setTransform(scale, 0, 0, scale, 0, 0);
  context.clearRect(0, 0, width, height);
  context.font = "12px system-ui, sans-serif";
  return { context, width, height };
}

/** Returns 1, 2 or 5 times a power of ten that divides `span` into `parts` parts or fewer. */
export function roundStep(span, parts) {
  const raw = Math.max(span / parts, 1e-6);
  const power = 10 ** Math.floor(Math.log10(raw));
  return power * ([1, 2, 5].find((factor) => factor * power >= 0.999999 * raw) ?? 10);
}

// Helpers of all drawings.

/** Colours of the drawings: those of theme.css, by the system's theme. */
export const COLOURS = {
  ink: "", faint: "", grey: "", panel: "", measured: "", target: "", start: "", choice: "",
  shadow: "",
};

/** Reads the colours from the style sheet. */
function readColours() {
  const style = getComputedStyle(document.documentElement);
  for (const name of Object.keys(COLOURS)) {
    COLOURS[name] = style.getPropertyValue(`--${name}`).trim();
  }
}

readColours();
window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", readColours);

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

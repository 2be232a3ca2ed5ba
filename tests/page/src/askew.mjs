// The paper's rig with a camera that sees all motors and stands elsewhere than its file says.

/** Place of the simulated camera, metres. It looks along -x. */
const PLACE = [1.737, 0.3, 0.45];

const ROTATION = [-0.5, -0.5, 0.5, 0.5];

/** Focal length and principal point, pixels. */
const [F, CX, CY] = [525, 319.5, 239.5];

const pixel = ([x, y, z]) => {
  const depth = PLACE[0] - x;
  return [CX + (F * (y - PLACE[1])) / depth, CY + (F * (PLACE[2] - z)) / depth];
};

/** Pixels of the motors. */
export const MOTORS = {
  A: pixel([0.85, 0.61, 0.665]),
  B: pixel([0.85, 0, 0.665]),
  C: pixel([0, 0.24, 0.665]),
};

/** Option with the height of the motors. */
export const HEIGHT = ["--height", "0.665"];

/** Copies the rig. Its camera file is 60 mm and 3 degrees off. */
export function copyAskewRig(folder) {
  const place = `translation = [${PLACE}], quaternion = [${ROTATION}]`;
  folder.copyRig({
    rig: (text) => `${text}\ncamera = { ${place} }\n`,
    camera: (text) =>
      text
        .replace("[1.737, 0.286, 0.225]", "[1.797, 0.3, 0.45]")
        .replace("[-0.5, -0.5, 0.5, 0.5]", "[-0.513, -0.4866, 0.513, 0.4866]"),
  });
}

/** Clicks at a pixel of the picture. */
export async function clickMotor(tab, [u, v]) {
  const { width, height, columns, rows } = await tab.evaluate(`(() => {
    const canvas = document.getElementById("picture");
    const { width, height } = canvas.getBoundingClientRect();
    return { width, height, columns: canvas.width, rows: canvas.height };
  })()`);
  const right = ((u + 0.5) / columns - 0.5) * width;
  const down = ((v + 0.5) / rows - 0.5) * height;
  await tab.click("#picture", [right, down]);
}

/** Returns the errors of a pose: position in the middle of the rig (m), direction (degrees). */
export function poseError({ translation, quaternion }) {
  const middle = [0.45, 0.3, 0.3];
  const seen = rotate(conjugate(ROTATION), middle.map((value, k) => value - PLACE[k]));
  const found = rotate(quaternion, seen).map((value, k) => value + translation[k]);
  const dot = quaternion.reduce((sum, value, k) => sum + value * ROTATION[k], 0);
  return {
    position: Math.hypot(...found.map((value, k) => value - middle[k])),
    direction: (2 * Math.acos(Math.min(1, Math.abs(dot))) * 180) / Math.PI,
  };
}

const conjugate = ([x, y, z, w]) => [-x, -y, -z, w];

/** Turns a vector by a quaternion (x, y, z, w). */
function rotate([x, y, z, w], [a, b, c]) {
  const cross = ([p, q, r], [s, t, u]) => [q * u - r * t, r * s - p * u, p * t - q * s];
  const twice = cross([x, y, z], [a, b, c]).map((value) => 2 * value);
  const again = cross([x, y, z], twice);
  return [a, b, c].map((value, k) => value + w * twice[k] + again[k]);
}

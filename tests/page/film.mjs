// Draws the moving picture of the README: `plumb demo --planar --page`, and a click into its
// picture.
// usage: film.mjs FILE

import { writeFileSync } from "node:fs";

import { Browser } from "./src/browser.mjs";
import { Demo } from "./src/plumb.mjs";
import { animation } from "./src/webp.mjs";

const SIZE = { width: 1200, height: 800 };

/** Quality of the pictures, 0 to 100. */
const QUALITY = 40;

/** Time between two pictures, and time after a target is reached, ms. */
const INTERVAL = 200;
const AFTERWARDS = 1000;

/** Longest time to a target, ms. */
const DEADLINE = 30_000;

/** Pixels that are clicked in turn, in a picture of that width and height. */
const CLICKS = [[400, 230]];
const PICTURE = [640, 480];

const file = process.argv[2];
if (!file) {
  console.error("usage: film.mjs FILE");
  process.exit(2);
}

const browser = new Browser();
const demo = await Demo.start(["--planar"]);
try {
  const tab = await browser.open(demo.address, SIZE);
  const text = (id) => `document.getElementById("${id}").textContent`;
  await tab.until(`document.getElementById("lost").hidden`);
  const pictures = [];
  const begin = performance.now();
  await reach(null);
  for (const pixel of CLICKS) {
    const goal = await tab.evaluate(text("goal"));
    const width = await tab.evaluate(`document.getElementById("picture").clientWidth`);
    const place = pixel.map((at, axis) => (width / PICTURE[0]) * (at + 0.5 - PICTURE[axis] / 2));
    await tab.click("#picture", place);
    await tab.until(`${text("picture-note")} === "target chosen on the plane"`);
    await tab.click("#target button");
    await reach(goal);
  }
  const bytes = animation(SIZE, pictures);
  writeFileSync(file, bytes);
  console.error(`${file}: ${pictures.length} pictures, ${bytes.length} bytes`);

  /** Takes pictures until a goal other than `old` is reached, and a while longer. */
  async function reach(old) {
    const from = performance.now();
    let reachedAt = Infinity;
    for (let now = from; now < reachedAt + AFTERWARDS; now = performance.now()) {
      if (now > from + DEADLINE) throw new Error("a target is not reached");
      pictures.push({ time: now - begin, webp: await tab.picture("webp", QUALITY) });
      const goal = await tab.evaluate(text("goal"));
      if (reachedAt === Infinity && goal !== old && goal.includes("reached")) reachedAt = now;
      const left = INTERVAL - (performance.now() - now);
      await new Promise((resolve) => setTimeout(resolve, Math.max(0, left)));
    }
  }
} finally {
  await demo.end();
  await browser.close();
}

// Draws the animated picture of the README: a run of `plumb demo --page`, as an animated WebP.
// usage: film.mjs FILE

import { writeFileSync } from "node:fs";

import { Browser } from "./src/browser.mjs";
import { Demo } from "./src/plumb.mjs";
import { animation } from "./src/webp.mjs";

const SIZE = { width: 1200, height: 720 };

/** Quality of the pictures, 0 to 100. */
const QUALITY = 55;

/** Time between two pictures, and time after the target is reached, ms. */
const INTERVAL = 100;
const AFTERWARDS = 1000;

const file = process.argv[2];
if (!file) {
  console.error("usage: film.mjs FILE");
  process.exit(2);
}

const browser = new Browser();
const demo = await Demo.start();
try {
  const tab = await browser.open(demo.address, SIZE);
  const text = (id) => `document.getElementById("${id}").textContent`;
  await tab.until(`document.getElementById("lost").hidden`);
  const pictures = [];
  let reachedAt = Infinity;
  const begin = performance.now();
  for (let now = begin; now < reachedAt + AFTERWARDS; now = performance.now()) {
    pictures.push({ time: now - begin, webp: await tab.picture("webp", QUALITY) });
    if (reachedAt === Infinity && (await tab.evaluate(text("goal"))).includes("reached")) {
      reachedAt = now;
    }
    const left = INTERVAL - (performance.now() - now);
    await new Promise((resolve) => setTimeout(resolve, Math.max(0, left)));
  }
  const bytes = animation(SIZE, pictures);
  writeFileSync(file, bytes);
  console.error(`${file}: ${pictures.length} pictures, ${bytes.length} bytes`);
} finally {
  await demo.end();
  await browser.close();
}

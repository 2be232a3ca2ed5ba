// Draws the screenshots of the book: `plumb demo --page` on a desktop and on a phone.
// usage: screenshots.mjs FOLDER

import { mkdirSync, writeFileSync } from "node:fs";
import path from "node:path";

import { Browser } from "./src/browser.mjs";
import { Demo } from "./src/plumb.mjs";

/** Time on the way to the first target at which the first screenshot is taken, ms. */
const UNDER_WAY = 900;

const folder = process.argv[2];
if (!folder) {
  console.error("usage: screenshots.mjs FOLDER");
  process.exit(2);
}
mkdirSync(folder, { recursive: true });

const browser = new Browser();
const demo = await Demo.start();
try {
  const desktop = await browser.open(demo.address, { width: 1280, height: 800 });
  const state = `document.getElementById("state").textContent`;
  await desktop.until(`${state} === "seeking"`);
  await new Promise((resolve) => setTimeout(resolve, UNDER_WAY));
  writeFileSync(path.join(folder, "page-desktop.png"), await desktop.picture("png"));
  const phone = await browser.open(demo.address, { width: 390, height: 844, isPhone: true });
  await phone.until(`document.getElementById("goal").textContent.includes("reached")`);
  await phone.until(`document.getElementById("picture").width === 640`);
  await new Promise((resolve) => setTimeout(resolve, UNDER_WAY));
  writeFileSync(path.join(folder, "page-phone.png"), await phone.picture("png"));
} finally {
  await demo.end();
  await browser.close();
}

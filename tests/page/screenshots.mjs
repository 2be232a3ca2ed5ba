// Draws the screenshots of the book: `plumb demo --page` on a desktop and on a phone, and
// `plumb calibrate --motors --page`.
// usage: screenshots.mjs FOLDER

import { mkdirSync, writeFileSync } from "node:fs";
import path from "node:path";

import { HEIGHT, MOTORS, clickMotor, copyAskewRig } from "./src/askew.mjs";
import { Browser } from "./src/browser.mjs";
import { Demo, Folder, startCalibration } from "./src/plumb.mjs";

/** Time on the way to the first target at which the first screenshot is taken, ms. */
const UNDER_WAY = 900;

const output = process.argv[2];
if (!output) {
  console.error("usage: screenshots.mjs FOLDER");
  process.exit(2);
}
mkdirSync(output, { recursive: true });

/** Quality of a WebP, 0 to 100. */
const QUALITY = 70;

/** Saves what a tab shows, as PNG or WebP. */
async function save(tab, name) {
  const isWebp = name.endsWith(".webp");
  const picture = await (isWebp ? tab.picture("webp", QUALITY) : tab.picture("png"));
  writeFileSync(path.join(output, name), picture);
}

/** Draws the page of a run. */
async function drawRun(browser) {
  const demo = await Demo.start();
  try {
    const desktop = await browser.open(demo.address, { width: 1280, height: 800 });
    const state = `document.getElementById("state").textContent`;
    await desktop.until(`${state} === "seeking"`);
    await new Promise((resolve) => setTimeout(resolve, UNDER_WAY));
    await save(desktop, "page-desktop.png");
    const phone = await browser.open(demo.address, { width: 390, height: 844, isPhone: true });
    await phone.until(`document.getElementById("goal").textContent.includes("reached")`);
    await phone.until(`document.getElementById("plane-name").textContent !== "plane"`);
    await new Promise((resolve) => setTimeout(resolve, UNDER_WAY));
    await save(phone, "page-phone.png");
    await phone.click("#stop");
    for (const [tab, name] of [[desktop, "desktop"], [phone, "phone"]]) {
      await tab.until(`!document.getElementById("stopped").hidden`);
      await tab.until(`${state} === "ready"`);
      await save(tab, `page-stopped-${name}.webp`);
    }
  } finally {
    await demo.end();
  }
}

/** Draws the page of a calibration with its pose. */
async function drawCalibration(browser) {
  const folder = new Folder();
  copyAskewRig(folder);
  const { program, address } = await startCalibration(folder, HEIGHT);
  try {
    const tab = await browser.open(address, { width: 1280, height: 720 });
    await tab.until(`!document.getElementById("set").disabled`);
    for (const [name, pixel] of Object.entries(MOTORS)) {
      await clickMotor(tab, pixel);
      await tab.until(`document.getElementById("marks").textContent.match(/${name}\\d/)`);
    }
    await tab.until(`!document.getElementById("accept").disabled`);
    await new Promise((resolve) => setTimeout(resolve, UNDER_WAY));
    await save(tab, "page-calibrate.webp");
  } finally {
    await program.end();
    folder.remove();
  }
}

const browser = new Browser();
try {
  await drawRun(browser);
  await drawCalibration(browser);
} finally {
  await browser.close();
}

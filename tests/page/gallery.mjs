// Takes pictures of the page of a run for a person to look at: each state, on three screens, light
// and dark.
// usage: gallery.mjs FOLDER [STATE...]     states: motion rest stopped targets fault ended

import { mkdirSync, writeFileSync } from "node:fs";
import path from "node:path";

import { Browser } from "./src/browser.mjs";
import { Demo, Folder, startRun } from "./src/plumb.mjs";

const SCREENS = {
  "1400x900": { width: 1400, height: 900, isPhone: false },
  "390x844": { width: 390, height: 844, isPhone: true },
  "844x390": { width: 844, height: 390, isPhone: true },
};
const THEMES = ["light", "dark"];

/** Time in which the page draws, ms. */
const DRAWN = 400;

const [output, ...chosen] = process.argv.slice(2);
if (!output) {
  console.error("usage: gallery.mjs FOLDER [STATE...]");
  process.exit(2);
}
mkdirSync(output, { recursive: true });
const isWanted = (state) => chosen.length === 0 || chosen.includes(state);
const state = `document.getElementById("state").textContent`;
const browser = new Browser();

/**
 * Saves what a tab shows on each screen and in each theme; the whole page too. `prepare()` is
 * awaited before each picture.
 */
async function draw(tab, name, prepare = async () => {}) {
  if (!isWanted(name)) return;
  for (const [screen, size] of Object.entries(SCREENS)) {
    await tab.resize(size);
    for (const theme of THEMES) {
      await tab.setTheme(theme);
      await prepare();
      await tab.evaluate("window.scrollTo(0, 0)");
      await new Promise((resolve) => setTimeout(resolve, DRAWN));
      const file = path.join(output, `${name}-${screen}-${theme}.png`);
      writeFileSync(file, await tab.picture("png"));
      if (screen === "1400x900") continue;
      await tab.resize({ ...size, height: await tab.evaluate("document.body.scrollHeight") });
      await new Promise((resolve) => setTimeout(resolve, DRAWN));
      writeFileSync(file.replace(".png", "-whole.png"), await tab.picture("png"));
      await tab.resize(size);
    }
  }
}

/** Types a target and sends it. */
const target = ([x, y, z]) => `{
  for (const [id, value] of [["x", ${x}], ["y", ${y}], ["z", ${z}]]) {
    document.getElementById(id).value = value;
    document.getElementById(id).dispatchEvent(new Event("input"));
  }
  document.querySelector("#target button").click();
}`;

async function drawRun() {
  const demo = await Demo.start();
  try {
    const tab = await browser.open(demo.address, SCREENS["1400x900"]);
    await tab.until(`${state} === "seeking"`);
    const ends = [[0.3, 0.2, 0.4], [0.6, 0.4, 0.15]];
    await draw(tab, "motion", () => {
      ends.reverse();
      return tab.evaluate(target(ends[0]));
    });
    await tab.until(`document.getElementById("goal").textContent.includes("reached")`);
    await draw(tab, "rest");
    await tab.evaluate(`document.getElementById("stop").dispatchEvent(new Event("pointerdown"))`);
    await tab.until(`${state} === "ready"`);
    await draw(tab, "stopped");
    await tab.evaluate(`document.getElementById("resume").click()`);
    await new Promise((resolve) => setTimeout(resolve, 1500));
    for (let k = 0; k < 10 && isWanted("targets"); k += 1) {
      // Every second one is outside the workspace, and gets a hint.
      await tab.evaluate(target(k % 2 ? [0.9, 0.9, 0.9] : [0.35 + 0.02 * k, 0.3, 0.25]));
      await new Promise((resolve) => setTimeout(resolve, 500));
    }
    await draw(tab, "targets");
    await tab.evaluate("window.confirm = () => true");
    await tab.evaluate(`document.getElementById("end").click()`);
    await tab.until(`!document.getElementById("lost").hidden`);
    await draw(tab, "ended");
  } finally {
    await demo.end();
  }
}

async function drawFault() {
  const folder = new Folder();
  folder.copyRig({ rig: (rig) => `${rig}\nreversed = [true, true, true]\n` });
  const { board, program, address } = await startRun(folder, ["--law", "interval"]);
  try {
    const tab = await browser.open(address, SCREENS["1400x900"]);
    await tab.until(`!document.getElementById("fault").hidden`);
    await draw(tab, "fault");
  } finally {
    await program.end();
    await board.end();
    folder.remove();
  }
}

try {
  await drawRun();
  if (isWanted("fault")) await drawFault();
} finally {
  await browser.close();
}

// The page in the light and the dark theme: every text is readable, also those of the drawings.

import assert from "node:assert/strict";
import { after, before, test } from "node:test";

import { contrast, shortcomings } from "./src/accessible.mjs";
import { Browser } from "./src/browser.mjs";
import { copyAskewRig, HEIGHT } from "./src/askew.mjs";
import { Demo, Folder, startCalibration } from "./src/plumb.mjs";

const DESKTOP = { width: 1400, height: 900, isPhone: false };
const PHONE = { width: 390, height: 844, isPhone: true };
const THEMES = ["light", "dark"];

/** Least contrasts of a text, and of a line that is needed (WCAG 2.2, 1.4.3 and 1.4.11). */
const LEAST = { text: 4.5, line: 3 };

/** States of the page, as a person may meet them: shown by hand, because a fault takes long. */
const SHOWN = {
  "as it is": "",
  "with a fault": `document.getElementById("fault").hidden = false;
    document.getElementById("fault-text").textContent = "something";
    document.getElementById("state").className = "badge fault";`,
  "with a hint": `document.getElementById("z").value = 9;
    document.getElementById("z").dispatchEvent(new Event("input"));`,
  stopped: `document.getElementById("stopped").hidden = false;
    document.getElementById("stop").classList.add("is-stopped");`,
  lost: `document.getElementById("lost").hidden = false;`,
};

let browser;
let demo;
before(async () => {
  browser = new Browser();
  demo = await Demo.start();
});
after(async () => {
  await demo.end();
  await browser.close();
});

test("each text of the page has its contrast in both themes", async () => {
  const tab = await browser.open(demo.address, DESKTOP);
  await tab.until(`document.getElementById("state").textContent === "seeking"`);
  const papers = [];
  for (const theme of THEMES) {
    await tab.setTheme(theme);
    for (const size of [DESKTOP, PHONE]) {
      await tab.resize(size);
      for (const [name, show] of Object.entries(SHOWN)) {
        await tab.evaluate(`{ ${show} }`);
        const found = await shortcomings(tab);
        assert.deepEqual(found, { unnamed: [], faint: [] }, `${theme}, ${name}`);
      }
    }
    papers.push(await tab.evaluate("getComputedStyle(document.documentElement).backgroundColor"));
  }
  assert.notEqual(papers[0], papers[1], "the dark theme is another one");
  assert.deepEqual(tab.errors, []);
  await tab.close();
});

test("the drawings change with the theme, and are readable in both", async () => {
  const tab = await browser.open(demo.address, DESKTOP);
  const colours = [];
  for (const theme of THEMES) {
    await tab.setTheme(theme);
    // The page hears of it with its next drawing.
    await tab.evaluate(`new Promise((resolve) =>
      requestAnimationFrame(() => requestAnimationFrame(() => resolve(true))))`);
    const found = await tab.evaluate(`import("/canvas.js").then((canvas) => canvas.COLOURS)`);
    for (const name of ["ink", "grey"]) {
      const value = contrast(found[name], found.panel);
      assert.ok(value >= LEAST.text, `${theme}: ${name} has a contrast of ${value}`);
    }
    for (const name of ["measured", "target", "start", "choice"]) {
      const value = contrast(found[name], found.panel);
      assert.ok(value >= LEAST.line, `${theme}: ${name} has a contrast of ${value}`);
    }
    colours.push(found);
  }
  assert.notDeepEqual(colours[0], colours[1]);
});

test("each text of a calibration has its contrast in both themes", async () => {
  const folder = new Folder();
  copyAskewRig(folder);
  const { program, address } = await startCalibration(folder, HEIGHT);
  try {
    const tab = await browser.open(address, DESKTOP);
    await tab.until(`!document.getElementById("set").disabled`);
    for (const theme of THEMES) {
      await tab.setTheme(theme);
      assert.deepEqual(await shortcomings(tab), { unnamed: [], faint: [] }, theme);
    }
  } finally {
    await program.end();
    folder.remove();
  }
});

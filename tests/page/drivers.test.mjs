// The page with TMC2209 drivers on a UART: their warnings, and a fault of one.

import assert from "node:assert/strict";
import { after, before, test } from "node:test";

import { shortcomings } from "./src/accessible.mjs";
import { Browser, until } from "./src/browser.mjs";
import { Folder, startRun } from "./src/plumb.mjs";

const DESKTOP = { width: 1280, height: 800 };

const text = (id) => `document.getElementById("${id}").textContent`;

/** Runs `use` with a tab on a run, where a motor's driver has a trouble after some seconds. */
async function withTrouble({ name, motor, after }, use) {
  const folder = new Folder();
  const driver = "driver = { tmc2209-uart = { run_current = 0.8 } }";
  folder.copyRig({ rig: (rig) => rig.replace('driver = "a4988"', driver) });
  const option = "--driver-trouble";
  const trouble = [`${option}=${name}`, `${option}-motor=${motor}`, `${option}-after=${after}`];
  const { board, program, address } = await startRun(folder, [], ["--rig", "rig.toml", ...trouble]);
  try {
    const tab = await browser.open(address, DESKTOP);
    await use(tab);
    assert.deepEqual(tab.errors, []);
  } finally {
    await program.end();
    await board.end();
    folder.remove();
  }
}

/** Clears the fault until it stays away: while its reason lasts, it comes again. */
async function clearForGood(tab) {
  await until(async () => {
    if (await tab.evaluate(`document.getElementById("clear").disabled`)) return false;
    await tab.click("#clear");
    await new Promise((resolve) => setTimeout(resolve, 1000));
    return tab.evaluate(`${text("state")} === "ready"`);
  }, "a fault that stays away");
}

/** Sends a target. */
async function goTo(tab, place) {
  await tab.evaluate(`${JSON.stringify(place)}.forEach((value, axis) => {
    const field = document.getElementById(["x", "y", "z"][axis]);
    field.value = value;
    field.dispatchEvent(new Event("input"));
  })`);
  await tab.click("#target button");
}

let browser;
before(() => { browser = new Browser(); });
after(() => browser.close());

test("the warning of a driver comes and goes, and the run goes on", async () => {
  await withTrouble({ name: "hot", motor: "b", after: 12 }, async (tab) => {
    await tab.until(`${text("drivers")} === "B hot"`);
    assert.equal(await tab.evaluate(`document.getElementById("driver-row").hidden`), false);
    assert.notEqual(await tab.evaluate(text("state")), "fault");
    await tab.until(`${text("drivers")} === "none"`);
    assert.notEqual(await tab.evaluate(text("state")), "fault");
  });
});

test("a driver that fails is named with its motor and the next act", async () => {
  await withTrouble({ name: "short", motor: "c", after: 5 }, async (tab) => {
    await tab.until(`!document.getElementById("fault").hidden`);
    assert.match(await tab.evaluate(text("fault-text")), /motor C has a short circuit/);
    assert.match(await tab.evaluate(text("fault-next")), /supply off.*clear the fault.*plumb home/);
    assert.deepEqual(await shortcomings(tab), { unnamed: [], faint: [] });
    await clearForGood(tab);
    await goTo(tab, [0.5, 0.35, 0.3]);
    await tab.until(`${text("state")} === "seeking"`);
  });
});

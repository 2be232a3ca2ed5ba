// The page of `plumb demo` in a real browser.

import assert from "node:assert/strict";
import { existsSync } from "node:fs";
import path from "node:path";
import { after, before, test } from "node:test";

import { shortcomings } from "./src/accessible.mjs";
import { Browser, until } from "./src/browser.mjs";
import { Demo, Folder, startRun } from "./src/plumb.mjs";

const DESKTOP = { width: 1280, height: 800 };
const PHONE = { width: 390, height: 844, isPhone: true };

const text = (id) => `document.getElementById("${id}").textContent`;
/** Sum over the pixels of the picture: it changes with each new picture. */
const SUM = `(() => {
  const canvas = document.getElementById("picture");
  const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
  return data.reduce((sum, value) => sum + value, 0);
})()`;

/** Resumes after the Stop that the page shows, and waits a second: a Resume moves nothing. */
async function resume(tab) {
  await tab.until(`!document.getElementById("stopped").hidden`);
  await tab.click("#resume");
  await tab.until(`document.getElementById("stopped").hidden`);
  await new Promise((resolve) => setTimeout(resolve, 1100));
}

let browser;
before(() => { browser = new Browser(); });
after(() => browser.close());

test("a run is shown, stopped with the space key, and driven to another target", async () => {
  const demo = await Demo.start();
  try {
    const tab = await browser.open(demo.address, DESKTOP);
    await tab.until(`document.getElementById("lost")?.hidden`);
    await tab.until(`${text("state")} === "seeking"`);
    assert.match(await tab.evaluate(text("law")), /taut/);
    assert.doesNotMatch(await tab.evaluate(text("goal")), /reached/);
    assert.equal(await tab.evaluate(`document.getElementById("driver-row").hidden`), true);
    const first = await tab.evaluate(SUM);
    await tab.until(`${SUM} !== ${first}`);

    assert.deepEqual(await shortcomings(tab), { unnamed: [], faint: [] });
    await tab.until(`!document.getElementById("tensions").hidden`);
    const tensions = await tab.evaluate(text("tensions"));
    assert.match(tensions, /A\s+\d\.\d\d.*B\s+\d\.\d\d.*C\s+\d\.\d\d/s);

    await tab.press(" ", "Space");
    await tab.until(`${text("state")} === "ready"`);
    assert.equal(await tab.evaluate(text("no-tensions")), "no estimate without a target");
    await tab.until(`${text("events")}.includes("stop: accepted")`);
    const rates = await tab.evaluate(text("rates"));
    assert.deepEqual(rates.trim().split(/\s+/).map(Number), [0, 0, 0]);
    await resume(tab);

    await tab.evaluate(`for (const [id, value] of [["x", 0.5], ["y", 0.35], ["z", 0.3]]) {
      document.getElementById(id).value = value;
      document.getElementById(id).dispatchEvent(new Event("input"));
    }`);
    await tab.click("#target button");
    await tab.until(`${text("goal")}.includes("(0.500, 0.350, 0.300) m reached")`);
    assert.equal(await tab.evaluate(text("state")), "holding");

    assert.deepEqual(tab.errors, []);
  } finally {
    await demo.end();
  }
  const { legs, true_error_mm: trueError } = JSON.parse(demo.output);
  assert.deepEqual(legs.map((leg) => leg.reached), [false, true]);
  assert.ok(trueError < 15, `${trueError} mm from the last target`);
});

test("the motors jog at rest only, and the run ends from the page", async () => {
  const demo = await Demo.start();
  try {
    const tab = await browser.open(demo.address, PHONE);
    await tab.until(`${text("state")} === "seeking"`);
    const jog = `document.querySelector('[data-motor="A"][data-sign="1"]')`;
    assert.equal(await tab.evaluate(`${jog}.disabled`), true);
    const width = await tab.evaluate("document.documentElement.scrollWidth");
    assert.ok(width <= PHONE.width, `the page is ${width} pixels wide`);
    await tab.click("#stop");
    await resume(tab);
    await tab.until(`!${jog}.disabled`);
    const before = await tab.evaluate(text("motors"));
    await tab.click('[data-motor="A"][data-sign="1"]');
    await tab.until(`${text("events")}.includes("jog A by +20 steps: accepted")`);
    await tab.until(`${text("motors")} !== ${JSON.stringify(before)}`);
    await tab.evaluate("window.confirm = () => true");
    await tab.click("#end");
    await tab.until(`${text("lost-title")} === "The run has ended"`);
    // Its target was not reached.
    assert.equal(await demo.ended(), 1);
    // The page keeps the files of the run after the program has gone.
    const names = await tab.evaluate(`[...document.querySelectorAll("#files a")]
      .map((link) => link.download)`);
    for (const name of ["run.csv", "summary.json", "figure4.svg", "figure5.svg"]) {
      assert.ok(names.includes(name), `${name} is not in ${names}`);
    }
    const kept = new Folder();
    const downloadPath = kept.path;
    await browser.send("Browser.setDownloadBehavior", { behavior: "allow", downloadPath });
    for (const name of ["run.csv", "figure4.svg"]) {
      await tab.click(`#files a[download="${name}"]`);
      await until(() => existsSync(path.join(kept.path, name)), name);
      assert.equal(kept.read(name), demo.read(`run/${name}`));
    }
    kept.remove();
    assert.equal(JSON.parse(demo.output).at_rest, true);
  } finally {
    await demo.end();
  }
});

test("a lost program is shown large, and controls are off until it is back", async () => {
  const demo = await Demo.start();
  const tab = await browser.open(demo.address, DESKTOP);
  try {
    await tab.until(`${text("state")} === "seeking"`);
  } finally {
    await demo.end("SIGKILL");
  }
  await tab.until(`!document.getElementById("lost").hidden`);
  assert.equal(await tab.evaluate(text("lost-title")), "Connection lost");
  assert.equal(await tab.evaluate(text("state")), "unknown");
  assert.equal(await tab.evaluate(`document.getElementById("stop").disabled`), true);
  assert.equal(await tab.evaluate(`document.getElementById("main").inert`), true);
  assert.equal(await tab.evaluate(`document.getElementById("retry").disabled`), false);
});

test("a fault is named with the next act, and cleared on the page", async () => {
  const folder = new Folder();
  // Motors that turn the wrong way drive the ball away from its target.
  folder.copyRig({ rig: (rig) => `${rig}\nreversed = [true, true, true]\n` });
  const { board, program, address } = await startRun(folder, ["--law", "interval"]);
  try {
    const tab = await browser.open(address, PHONE);
    await tab.until(`!document.getElementById("fault").hidden`);
    assert.equal(await tab.evaluate(text("state")), "fault");
    assert.match(await tab.evaluate(text("fault-text")), /error/);
    assert.match(await tab.evaluate(text("fault-next")), /swapped or reversed.*clear the fault/);
    await tab.until(`${text("events")}.includes("the board has stopped by itself")`);
    assert.deepEqual(await shortcomings(tab), { unnamed: [], faint: [] });

    // The board comes to rest first.
    await tab.until(`!document.getElementById("clear").disabled`);
    await tab.click("#clear");
    await tab.until(`${text("events")}.includes("clear the fault: accepted")`);
    await tab.until(`${text("state")} === "ready"`);
    assert.equal(await tab.evaluate(`document.getElementById("fault").hidden`), true);
    assert.deepEqual(tab.errors, []);
  } finally {
    await program.end();
    await board.end();
    folder.remove();
  }
});

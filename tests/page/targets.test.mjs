// Targets on the page of `plumb demo` in a real browser: from whom they come, what is a target, and
// how it is dragged.

import assert from "node:assert/strict";
import { after, before, test } from "node:test";

import { shortcomings } from "./src/accessible.mjs";
import { Browser } from "./src/browser.mjs";
import { Demo } from "./src/plumb.mjs";
import { Script } from "./src/script.mjs";

const DESKTOP = { width: 1280, height: 800 };
const PHONE = { width: 390, height: 844, isPhone: true };

const text = (id) => `document.getElementById("${id}").textContent`;

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

/** Opens the page, and waits until it shows the run. */
async function openPage(size) {
  const tab = await browser.open(demo.address, size);
  await tab.until(`document.getElementById("lost")?.hidden`);
  await tab.until(`${text("state")} !== "unknown"`);
  return tab;
}

test("a target outside the workspace cannot be sent, a click chooses one inside", async () => {
  const tab = await openPage(DESKTOP);
  await tab.evaluate(`{
    const z = document.getElementById("z");
    z.value = 9;
    z.dispatchEvent(new Event("input"));
  }`);
  assert.equal(await tab.evaluate(`document.querySelector("#target button").disabled`), true);
  assert.match(await tab.evaluate(text("target-note")), /z must be/);
  await tab.evaluate(`{
    const z = document.getElementById("height");
    z.value = 0.3;
    z.dispatchEvent(new Event("input"));
  }`);
  const x = await tab.evaluate(`document.getElementById("x").value`);
  await tab.click("#space", [40, 20]);
  await tab.until(`document.getElementById("x").value !== "${x}"`);
  assert.equal(await tab.evaluate(`document.querySelector("#target button").disabled`), false);
  await tab.close();
});

test("the ball follows the cross while it is dragged, and stops where it is let go", async () => {
  const tab = await openPage(DESKTOP);
  const z = `document.getElementById("height")`;
  await tab.evaluate(`{ ${z}.value = 0.3; ${z}.dispatchEvent(new Event("input")); }`);
  const x = `document.getElementById("x").value`;
  const before = await tab.evaluate(x);
  // A click brings the cross below the pointer.
  await tab.click("#space", [20, 20]);
  await tab.until(`${x} !== "${before}"`);
  await new Promise((resolve) => setTimeout(resolve, 200));
  const chosen = await tab.evaluate(x);
  await tab.drag("#space", [20, 20], [-10, 10], () =>
    tab.until(`${text("state")} === "following"`));
  assert.notEqual(await tab.evaluate(x), chosen);
  const place = await tab.evaluate(`["x", "y", "z"]
    .map((id) => Number(document.getElementById(id).value).toFixed(3)).join(", ")`);
  await tab.until(`${text("goal")}.includes("(${place}) m reached")`);
  assert.equal(await tab.evaluate(text("state")), "holding");
  assert.deepEqual(tab.errors, []);
  await tab.close();
});

test("a Stop on one page holds against a script and another page until a Resume", async () => {
  const script = new Script(demo.address);
  try {
    const [desktop, phone] = [await openPage(DESKTOP), await openPage(PHONE)];
    await script.opened;
    script.repeatTargets(100);
    await desktop.until(`${text("events")}.includes("go to (0.500, 0.350, 0.300) m: accepted")`);

    // A double click on STOP does not resume.
    await phone.click("#stop");
    await phone.click("#stop");
    for (const tab of [desktop, phone]) {
      await tab.until(`!document.getElementById("stopped").hidden`);
      await tab.until(`${text("state")} === "ready"`);
      assert.match(await tab.evaluate(text("stop-label")), /Stopped/);
      assert.match(await tab.evaluate(text("stopped-text")), /By page \d at 127\.0\.0\.1 at /);
      assert.equal(await tab.evaluate(`document.querySelector("#target button").disabled`), true);
      assert.deepEqual(await shortcomings(tab), { unnamed: [], faint: [] });
    }
    const motors = await desktop.evaluate(text("motors"));
    await desktop.until(`/Refused since then: \\d{2,}/.test(${text("stopped-text")})`);
    assert.ok(script.problems.some((problem) => problem.includes("Resume first")), "no refusal");
    // The space key stops, and does not resume; a page that is opened now shows the same.
    await desktop.press(" ", "Space");
    const late = await browser.open(demo.address, DESKTOP);
    await late.until(`!document.getElementById("stopped").hidden`);
    assert.equal(await late.evaluate(text("motors")), motors);

    await late.click("#resume");
    for (const tab of [desktop, phone, late]) {
      await tab.until(`document.getElementById("stopped").hidden`);
    }
    // The script goes on, and moves nothing.
    await script.until((problem) => problem.includes("begin anew"));
    assert.equal(await late.evaluate(text("state")), "ready");
    assert.equal(await late.evaluate(text("motors")), motors);
    script.cease();
    await new Promise((resolve) => setTimeout(resolve, 1500));
    script.repeatTargets(100);
    await late.until(`${text("state")} === "seeking"`);
    assert.deepEqual([...desktop.errors, ...phone.errors, ...late.errors], []);
  } finally {
    script.close();
  }
});

// Two cables in a mirrored, tilted picture: a click, and the ball goes to that pixel.

import assert from "node:assert/strict";
import { after, before, test } from "node:test";

import { Browser } from "./src/browser.mjs";
import { Demo } from "./src/plumb.mjs";

const SIZE = [640, 480];
const text = (id) => `document.getElementById("${id}").textContent`;

let browser;
let demo;
let tab;
before(async () => {
  browser = new Browser();
  demo = await Demo.start(["--planar"]);
  tab = await browser.open(demo.address, { width: 1400, height: 900 });
  await tab.until(`${text("goal")}.includes("reached")`);
});
after(async () => {
  await demo.end();
  await browser.close();
});

/** Clicks at a pixel of the whole picture. */
async function clickPixel([u, v]) {
  const width = await tab.evaluate(`document.getElementById("picture").clientWidth`);
  const scale = width / SIZE[0];
  const place = [scale * (u + 0.5 - SIZE[0] / 2), scale * (v + 0.5 - SIZE[1] / 2)];
  await tab.click("#picture", place);
}

/** Returns the pixel at which the ball was last seen. */
function ballPixel() {
  const [head, ...rows] = demo.read("run/run.csv").trim().split("\n").map((row) => row.split(","));
  return ["u_px", "v_px"].map((name) => Number(rows.at(-1)[head.indexOf(name)]));
}

test("the ball goes to the pixel that is clicked", async () => {
  const wanted = [330, 280];
  const before = await tab.evaluate(text("goal"));
  await clickPixel(wanted);
  await tab.until(`${text("picture-note")} === "target chosen on the plane"`);
  await tab.click("#target button");
  await tab.until(`${text("goal")} !== ${JSON.stringify(before)}`);
  await tab.until(`${text("goal")}.includes("reached")`);
  const seen = ballPixel();
  const off = Math.hypot(seen[0] - wanted[0], seen[1] - wanted[1]);
  // A click is exact to a pixel of the screen, and "reached" to two of the picture.
  assert.ok(off < 4, `seen at ${seen}, ${off} pixels off`);
});

test("a click beside the motors' verticals is refused, and nothing moves", async () => {
  const goal = await tab.evaluate(text("goal"));
  await clickPixel([196, 300]);
  await new Promise((resolve) => setTimeout(resolve, 300));
  const note = await tab.evaluate(text("picture-note"));
  if (note === "target chosen on the plane") {
    await tab.click("#target button");
    await tab.until(`${text("events")}.includes("too near to the border")`);
  } else {
    assert.match(note, /outside the workspace/);
  }
  assert.equal(await tab.evaluate(text("goal")), goal);
});

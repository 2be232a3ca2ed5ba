// The camera's picture of the page: the target in it, a click that chooses one, and the zoom.

import assert from "node:assert/strict";
import { after, before, test } from "node:test";

import { Browser, until } from "./src/browser.mjs";
import { Demo } from "./src/plumb.mjs";

const DESKTOP = { width: 1400, height: 900 };

/** Camera of the demo, which looks along -x: place (m), focal length and principal point. */
const PLACE = [1.737, 0.286, 0.225];
const [F, CX, CY] = [525, 319.5, 239.5];
const SIZE = [640, 480];

/** Returns column and row of a point. */
const pixel = ([x, y, z]) => {
  const depth = PLACE[0] - x;
  return [CX + (F * (y - PLACE[1])) / depth, CY + (F * (PLACE[2] - z)) / depth];
};

const text = (id) => `document.getElementById("${id}").textContent`;
const CHOICE = `["x", "y", "z"].map((id) => document.getElementById(id).valueAsNumber)`;

/** Returns how far a pixel is drawn from the middle of the canvas, pixels of the screen. */
async function beside(tab, [u, v]) {
  const width = await tab.evaluate(`document.getElementById("picture").clientWidth`);
  const scale = width / SIZE[0];
  return [scale * (u + 0.5 - SIZE[0] / 2), scale * (v + 0.5 - SIZE[1] / 2)];
}

/** Clicks at a pixel of the whole picture. */
async function clickPixel(tab, place) {
  await tab.click("#picture", await beside(tab, place));
}

/** Turns the wheel over a pixel of the whole picture; up is in. */
async function turnWheel(tab, place, deltaY) {
  const [right, down] = await beside(tab, place);
  const { x, y } = await tab.evaluate(`(() => {
    const box = document.getElementById("picture").getBoundingClientRect();
    return { x: box.x + box.width / 2, y: box.y + box.height / 2 };
  })()`);
  const event = { type: "mouseWheel", x: x + right, y: y + down, deltaX: 0, deltaY };
  await tab.send("Input.dispatchMouseEvent", event);
}

/** Turns the wheel until an expression in the page is true: a page that scrolls loses a turn. */
async function turnWheelUntil(tab, place, deltaY, expression) {
  await until(async () => {
    await turnWheel(tab, place, deltaY);
    return tab.evaluate(expression);
  }, expression);
}

/** Number of pixels of the target's colour near a place of the canvas, or anywhere. */
const targetPixels = ([u, v], reach) => `(() => {
  const canvas = document.getElementById("picture");
  const scale = canvas.width / ${SIZE[0]};
  const [x, y, r] = [${u} * scale, ${v} * scale, ${reach} * scale].map(Math.round);
  const { data } = canvas.getContext("2d").getImageData(x - r, y - r, 2 * r, 2 * r);
  let count = 0;
  for (let at = 0; at < data.length; at += 4) {
    if (data[at] === 255 && data[at + 1] === 90 && data[at + 2] === 60) count += 1;
  }
  return count;
})()`;

const near = (found, wanted, tolerance) =>
  found.every((value, k) => Math.abs(value - wanted[k]) <= tolerance);

let browser;
let demo;
let tab;
before(async () => {
  browser = new Browser();
  demo = await Demo.start();
  tab = await browser.open(demo.address, DESKTOP);
  await tab.until(`document.getElementById("state").textContent !== "unknown"`);
  await tab.until(`document.getElementById("plane-name").textContent.startsWith("plane x")`);
});
after(async () => {
  await demo.end();
  await browser.close();
});

test("the target is drawn where the camera sees it", async () => {
  const place = pixel([0.4, 0.4, 0.15]);
  await tab.until(`${targetPixels(place, 20)} > 20`);
  assert.equal(await tab.evaluate(targetPixels([300, 100], 60)), 0);
});

test("a click into the picture fills in a point of the plane, and moves nothing", async () => {
  await tab.until(`${text("goal")}.includes("reached")`);
  const goal = await tab.evaluate(text("goal"));
  await tab.evaluate(`document.getElementById("depth").click()`);
  const wanted = [0.45, 0.2, 0.4];
  await clickPixel(tab, pixel(wanted));
  await tab.until(`${text("picture-note")} === "target chosen on the plane"`);
  const chosen = await tab.evaluate(CHOICE);
  assert.ok(near(chosen, wanted, 0.003), chosen.join(" "));
  assert.equal(await tab.evaluate(`document.getElementById("height").valueAsNumber`), chosen[2]);
  await new Promise((resolve) => setTimeout(resolve, 700));
  assert.equal(await tab.evaluate(text("goal")), goal);
  assert.equal(await tab.evaluate(text("state")), "holding");
  assert.doesNotMatch(await tab.evaluate(text("events")), /go to/);

  await tab.click("#target button");
  const place = chosen.map((value) => value.toFixed(3)).join(", ");
  await tab.until(`${text("goal")}.includes("(${place}) m reached")`);
});

test("a click on the ball chooses its place, one beside the workspace nothing", async () => {
  await tab.evaluate(`document.getElementById("depth").checked = true`);
  const ball = await tab.evaluate(`${text("ball")}.trim().split(/\\s+/).map(Number)`);
  await clickPixel(tab, pixel(ball));
  await tab.until(`${text("picture-note")}.includes("where the ball is now")`);
  assert.ok(near(await tab.evaluate(CHOICE), ball, 0.005));
  const before = await tab.evaluate(CHOICE);
  await clickPixel(tab, [8, 470]);
  await tab.until(`${text("picture-note")}.includes("outside the workspace")`);
  assert.deepEqual(await tab.evaluate(CHOICE), before);
  // The plane goes through the numbers in the fields.
  await tab.evaluate(`document.getElementById("x").value = ""`);
  await clickPixel(tab, pixel(ball));
  await tab.until(`${text("picture-note")}.includes("choose numbers for x, y and z first")`);
  await tab.evaluate(`document.getElementById("x").value = "0.45"`);
});

test("the arrow keys and Enter choose as a click does", async () => {
  await tab.evaluate(`document.getElementById("depth").checked = false`);
  await tab.evaluate(`document.getElementById("picture").focus()`);
  const before = await tab.evaluate(CHOICE);
  for (let k = 0; k < 6; k += 1) await tab.press("ArrowUp", "ArrowUp");
  for (let k = 0; k < 24; k += 1) await tab.press("ArrowLeft", "ArrowLeft");
  await tab.press("Enter", "Enter");
  await tab.until(`${CHOICE}[1] < ${before[1]}`);
  const [, y, z] = await tab.evaluate(CHOICE);
  assert.ok(y < before[1] && z > before[2], `${y} ${z}`);
});

test("the picture zooms at the pointer, by keys and by buttons", async () => {
  const wanted = [0.45, 0.25, 0.35];
  await tab.evaluate(`{
    document.getElementById("x").value = "0.45";
    document.getElementById("x").dispatchEvent(new Event("input"));
    document.getElementById("picture").scrollIntoView();
  }`);
  const isZoomed = `document.getElementById("picture").classList.contains("zoomed")`;
  await turnWheelUntil(tab, pixel(wanted), -100, isZoomed);
  for (let k = 0; k < 3; k += 1) await turnWheel(tab, pixel(wanted), -100);
  // What is below the pointer stays there.
  await clickPixel(tab, pixel(wanted));
  await tab.until(`Math.abs(${CHOICE}[1] - 0.25) < 0.002 && Math.abs(${CHOICE}[2] - 0.35) < 0.002`);
  await turnWheelUntil(tab, pixel(wanted), 100, `!${isZoomed}`);
  await tab.evaluate(`document.getElementById("picture").focus()`);
  await tab.press("+", "Equal");
  await tab.until(isZoomed);
  await tab.press("0", "Digit0");
  await tab.until(`!${isZoomed}`);
  await tab.click('#frame [data-zoom="in"]');
  await tab.until(isZoomed);
  await tab.click('#frame [data-zoom="whole"]');
  await tab.until(`!${isZoomed}`);
});

test("the rig zooms and turns, and a click in it chooses what it shows", async () => {
  const isZoomed = `document.getElementById("space").classList.contains("zoomed")`;
  const choose = async () => {
    const before = await tab.evaluate(CHOICE);
    await tab.click("#space", [30, 25]);
    await tab.until(`JSON.stringify(${CHOICE}) !== '${JSON.stringify(before)}'`);
    const after = await tab.evaluate(CHOICE);
    await tab.click("#space", [-10, -5]);
    await tab.until(`JSON.stringify(${CHOICE}) !== '${JSON.stringify(after)}'`);
    return after;
  };
  const whole = await choose();
  await tab.click('#rig [data-zoom="in"]');
  await tab.click('#rig [data-zoom="in"]');
  await tab.until(isZoomed);
  const zoomed = await choose();
  assert.ok(Math.hypot(zoomed[0] - whole[0], zoomed[1] - whole[1]) > 0.005, `${whole} ${zoomed}`);
  await tab.evaluate(`document.getElementById("space").focus()`);
  await tab.press("0", "Digit0");
  await tab.until(`!${isZoomed}`);
  for (let k = 0; k < 4; k += 1) await tab.press("ArrowLeft", "ArrowLeft");
  const turned = await choose();
  assert.ok(Math.hypot(turned[0] - whole[0], turned[1] - whole[1]) > 0.005, `${whole} ${turned}`);
});

test("after a Stop a click still moves nothing: the target needs a Resume first", async () => {
  await tab.press(" ", "Space");
  await tab.until(`!document.getElementById("stopped").hidden`);
  await tab.until(`${text("state")} === "ready"`);
  const motors = await tab.evaluate(text("motors"));
  await clickPixel(tab, pixel([0.45, 0.3, 0.3]));
  await tab.until(`Math.abs(${CHOICE}[1] - 0.3) < 0.003`);
  assert.equal(await tab.evaluate(`document.querySelector("#target button").disabled`), true);
  assert.match(await tab.evaluate(text("target-note")), /Resume first/);
  assert.equal(await tab.evaluate(text("motors")), motors);
  assert.deepEqual(tab.errors, []);
});

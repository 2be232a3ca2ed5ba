// The page of `plumb calibrate` in a real browser, on the simulated rig.

import assert from "node:assert/strict";
import { after, before, test } from "node:test";

import { shortcomings } from "./src/accessible.mjs";
import { Browser } from "./src/browser.mjs";
import { Folder, startCalibration } from "./src/plumb.mjs";
import { HEIGHT, copyAskewRig, clickMotor, MOTORS, poseError } from "./src/askew.mjs";

const DESKTOP = { width: 1280, height: 800 };
const PHONE = { width: 390, height: 844, isPhone: true };

/** 95 % of the errors of this way in `plumb-lab calibration`. */
const BENCH = { position: 0.018, direction: 1.0 };

const text = (id) => `document.getElementById("${id}").textContent`;
const isDisabled = (id) => `document.getElementById("${id}").disabled`;
/** Number of pixels in the yellow of the overlay's outline. */
const YELLOW = `(() => {
  const canvas = document.getElementById("picture");
  const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
  let count = 0;
  for (let at = 0; at < data.length; at += 4) {
    if (data[at] > 190 && data[at + 1] > 170 && data[at + 2] < 110) count += 1;
  }
  return count;
})()`;

let browser;
let folder;
before(() => {
  browser = new Browser();
  folder = new Folder();
  copyAskewRig(folder);
});
after(async () => {
  await browser.close();
  folder.remove();
});

test("three clicks give the pose within the error of the bench, and accept writes it", async () => {
  const former = folder.read("camera.toml");
  const { program, address } = await startCalibration(folder, [...HEIGHT, "--json"]);
  try {
    const tab = await browser.open(address, DESKTOP);
    await tab.until(`${text("step")} === "choose motor A"`);
    await tab.until(`document.getElementById("picture-note").textContent === ""`);
    assert.deepEqual(await shortcomings(tab), { unnamed: [], faint: [] });
    const before = await tab.evaluate(YELLOW);

    // A and B swapped: the pose is refused, in words.
    await clickMotor(tab, MOTORS.B);
    await tab.until(`${text("step")} === "choose motor B"`);
    await clickMotor(tab, MOTORS.A);
    await tab.until(`${text("step")} === "choose motor C"`);
    await clickMotor(tab, MOTORS.C);
    await tab.until(`${text("problem")}.includes("which motor is A, B and C")`);
    assert.equal(await tab.evaluate(isDisabled("accept")), true);
    for (const name of ["C", "B", "A"]) {
      await tab.click("#undo");
      await tab.until(`${text("step")} === "choose motor ${name}"`);
    }
    assert.equal(await tab.evaluate(text("problem")), "");

    for (const name of ["A", "B", "C"]) {
      await clickMotor(tab, MOTORS[name]);
      await tab.until(`${text("marks")}.match(/${name}\\d/)`);
    }
    await tab.until(`!${isDisabled("accept")}`);
    const marks = await tab.evaluate(text("marks"));
    // Motor A is 0.887 m from the camera, its surface 10 mm less.
    assert.match(marks, /A\d+\.\d\d+\.\d0\.8[78]/);
    assert.match(await tab.evaluate(text("result")), /pose: (good|usable).*residual \d/s);
    await tab.until(`${YELLOW} > ${before} + 200`);
    assert.equal(folder.read("camera.toml"), former, "nothing is written before the acceptance");

    await tab.click("#accept");
    await tab.until(`${text("lost-title")} === "The calibration has ended"`);
    assert.match(await tab.evaluate(text("lost-text")), /The pose is written into .*camera\.toml/);
    assert.equal(await program.ended(), 0);
    assert.deepEqual(tab.errors.filter((error) => !error.includes("WebSocket")), []);
  } finally {
    await program.end();
  }
  const error = poseError(JSON.parse(program.output));
  assert.ok(error.position < BENCH.position, `${error.position} m`);
  assert.ok(error.direction < BENCH.direction, `${error.direction} degrees`);
  assert.match(folder.read("camera.toml"), /# plumb calibrate --motors/);
  assert.equal(folder.read("camera.toml.bak"), former);
});

test("keys choose a motor, a wrong pixel is refused, and the end without a change", async () => {
  const former = folder.read("camera.toml");
  const { program, address } = await startCalibration(folder, HEIGHT);
  try {
    const tab = await browser.open(address, PHONE);
    await tab.until(`!${isDisabled("set")}`);
    const width = await tab.evaluate("document.documentElement.scrollWidth");
    assert.ok(width <= PHONE.width, `the page is ${width} pixels wide`);
    await tab.evaluate(`document.getElementById("picture").focus()`);
    const column = Number(await tab.evaluate(text("column")));
    await tab.press("ArrowRight", "ArrowRight");
    await tab.until(`${text("column")} === "${(column + 1).toFixed(1)}"`);
    await tab.click('[data-nudge="-1,0"]');
    await tab.until(`${text("column")} === "${column.toFixed(1)}"`);
    await tab.evaluate(`document.getElementById("picture").focus()`);
    await tab.press("Enter", "Enter");
    await tab.until(`${text("step")} === "choose motor B"`);
    await tab.press("Backspace", "Backspace");
    await tab.until(`${text("step")} === "choose motor A"`);
    await tab.click("#quit");
    assert.equal(await program.ended(), 1);
    await tab.until(`${text("lost-text")} === "Nothing is written."`);
  } finally {
    await program.end();
  }
  assert.equal(folder.read("camera.toml"), former);
});

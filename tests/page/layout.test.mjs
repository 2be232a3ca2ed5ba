// The layout of the page of a run: what stays where it is, on a desktop and on a phone.

import assert from "node:assert/strict";
import { after, before, test } from "node:test";

import { Browser } from "./src/browser.mjs";
import { Demo } from "./src/plumb.mjs";

const DESKTOP = { width: 1400, height: 900 };
const PHONE = { width: 390, height: 844, isPhone: true };
const LANDSCAPE = { width: 844, height: 390, isPhone: true };

const text = (id) => `document.getElementById("${id}").textContent`;

/** Types a coordinate of the target. */
const type = (id, value) => `{
  const input = document.getElementById("${id}");
  input.value = "${value}";
  input.dispatchEvent(new Event("input"));
}`;

/** Waits for two drawings of the page. */
const drawn = `new Promise((resolve) =>
  requestAnimationFrame(() => requestAnimationFrame(() => resolve(true))))`;

/** Lower end of the panels, and upper end of the bar with STOP. */
const END = `[
  Math.max(...[...document.querySelectorAll("main > *")]
    .map((each) => each.getBoundingClientRect().bottom)),
  document.getElementById("bar").getBoundingClientRect().top,
]`;

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

/** Opens the page, waits until it shows the run, calls `look(tab)` and closes the page. */
async function withPage(size, look) {
  const tab = await browser.open(demo.address, size);
  await untilShown(tab);
  await look(tab);
  assert.deepEqual(tab.errors, []);
  await tab.close();
}

/** Waits until a page shows the run. */
async function untilShown(tab) {
  await tab.until(`document.getElementById("lost")?.hidden`);
  await tab.until(`document.getElementById("state").textContent !== "unknown"`);
}

test("ten hints leave every panel as high as it was", async () => {
  const heights = `[...document.querySelectorAll(".view")]
    .map((view) => Math.round(view.getBoundingClientRect().height))`;
  const typeAll = (tab, value) =>
    tab.evaluate(`${["x", "y", "z"].map((axis) => type(axis, value)).join("")}; ${drawn}`);
  for (const size of [DESKTOP, PHONE, LANDSCAPE]) {
    await withPage(size, async (tab) => {
      await typeAll(tab, 0.3);
      const before = await tab.evaluate(heights);
      for (let hint = 0; hint < 10; hint += 1) {
        await typeAll(tab, 9);
        assert.match(await tab.evaluate(text("target-note")), /x must be.*y must be.*z must be/);
        assert.deepEqual(await tab.evaluate(heights), before, `${size.width}: hint ${hint}`);
        await typeAll(tab, 0.3);
      }
      assert.deepEqual(await tab.evaluate(heights), before);
    });
  }
});

test("what has the focus is never under STOP", async () => {
  const covered = `(() => {
    const bar = document.getElementById("bar").getBoundingClientRect().top;
    const all = [...document.querySelectorAll("main button, main input, main select")];
    return all.filter((each) => {
      each.focus();
      return document.activeElement === each && each.getBoundingClientRect().bottom > bar;
    }).map((each) => each.outerHTML);
  })()`;
  for (const size of [DESKTOP, PHONE, LANDSCAPE]) {
    await withPage(size, async (tab) => {
      await tab.evaluate("window.scrollTo(0, 0)");
      assert.deepEqual(await tab.evaluate(covered), [], `${size.width} pixels wide`);
      await tab.evaluate("window.scrollTo(0, document.documentElement.scrollHeight)");
      const [last, bar] = await tab.evaluate(END);
      assert.ok(last <= bar, `the page ends at ${last}, below ${bar}`);
    });
  }
});

test("a phone has the controls above the curves, and nothing beside the screen", async () => {
  await withPage(PHONE, async (tab) => {
    const top = (name) =>
      tab.evaluate(`document.querySelector(".${name}").getBoundingClientRect().top`);
    assert.ok((await top("controls")) < (await top("curves")));
    assert.equal(await tab.evaluate("document.documentElement.scrollWidth"), PHONE.width);
  });
});

test("a desktop shows all panels at once", async () => {
  for (const size of [DESKTOP, { width: 1280, height: 800 }]) {
    await withPage(size, async (tab) => {
      const [last, bar] = await tab.evaluate(END);
      assert.ok(last <= bar, `${size.height}: the panels end at ${last}, below ${bar}`);
    });
  }
});

test("the pill of the state has one form in all states", async () => {
  await withPage(DESKTOP, async (tab) => {
    const forms = await tab.evaluate(`["ready", "seeking", "holding", "fault", "stopping"]
      .map((state) => {
        const pill = document.getElementById("state");
        pill.className = "badge " + state;
        const { height, borderLeftWidth, paddingTop, paddingLeft } = getComputedStyle(pill);
        return [height, borderLeftWidth, paddingTop, paddingLeft].join(" ");
      })`);
    assert.deepEqual(forms, forms.map(() => forms[0]));
  });
});

test("typed coordinates are kept over a reload", async () => {
  await withPage(DESKTOP, async (tab) => {
    for (const [id, value] of [["x", "0.512"], ["y", "0.345"], ["z", "0.287"]]) {
      await tab.evaluate(type(id, value));
    }
    await tab.reload();
    await untilShown(tab);
    const values = await tab.evaluate(`["x", "y", "z", "height"]
      .map((id) => document.getElementById(id).value)`);
    assert.deepEqual(values, ["0.512", "0.345", "0.287", "0.287"]);
    // Something that is no target is not taken.
    for (const stored of ['["1e9999", {}, null]', "{", "[1]"]) {
      await tab.evaluate(`sessionStorage.setItem("plumb.target", ${JSON.stringify(stored)})`);
      await tab.reload();
      await untilShown(tab);
      assert.equal(await tab.evaluate(`document.querySelector("#target button").disabled`), false);
    }
  });
});

test("events have the time when they happened, on every page", async () => {
  const lines = `[...document.querySelectorAll("#events li")]
    .map((line) => line.textContent).filter((line) => /target set|stop: accepted/.test(line))`;
  const isStopped = `${text("events")}.includes("stop: accepted")`;
  await withPage(DESKTOP, async (first) => {
    await first.click("#stop");
    await first.until(isStopped);
    await first.until(`!document.getElementById("stopped").hidden`);
    await first.click("#resume");
    await first.until(`document.getElementById("stopped").hidden`);
    const expected = await first.evaluate(lines);
    assert.ok(expected.length >= 2, expected.join("; "));
    // Longer than the resolution of the times.
    await new Promise((resolve) => setTimeout(resolve, 2100));
    await withPage(PHONE, async (late) => {
      await late.until(isStopped);
      assert.deepEqual(await late.evaluate(lines), expected);
    });
    await first.reload();
    await untilShown(first);
    await first.until(isStopped);
    assert.deepEqual(await first.evaluate(lines), expected);
  });
});

// A headless Chromium, driven over its DevTools protocol on a pipe.

import { spawn } from "node:child_process";
import { existsSync, mkdtempSync, rmSync } from "node:fs";
import os from "node:os";
import path from "node:path";

/** Names of the browser's program, in the order of preference. */
const NAMES = ["chromium", "chromium-browser", "google-chrome"];

/** Longest wait for something that must come, ms. */
const PATIENCE = 60_000;

/** Returns the path of a browser: `PLUMB_CHROMIUM`, or the first of {@link NAMES} on the path. */
function browserPath() {
  if (process.env.PLUMB_CHROMIUM) return process.env.PLUMB_CHROMIUM;
  const folders = (process.env.PATH ?? "").split(path.delimiter);
  const all = NAMES.flatMap((name) => folders.map((folder) => path.join(folder, name)));
  const found = all.find((file) => existsSync(file));
  if (!found) throw new Error("no Chromium: install it (Debian: chromium) or set PLUMB_CHROMIUM");
  return found;
}

/** Waits for a promise; fails after {@link PATIENCE}. */
export async function bounded(promise, what) {
  let timer;
  const late = new Promise((_, reject) => {
    timer = setTimeout(() => reject(new Error(`timed out: ${what}`)), PATIENCE);
  });
  return Promise.race([promise, late]).finally(() => clearTimeout(timer));
}

/** Returns the first true result of a function, which is called again and again. */
export async function until(find, what) {
  const end = performance.now() + PATIENCE;
  while (performance.now() < end) {
    const found = await find();
    if (found) return found;
    await new Promise((resolve) => setTimeout(resolve, 20));
  }
  throw new Error(`timed out: ${what}`);
}

/** A browser without a window. Messages are JSON texts that end with a zero byte. */
export class Browser {
  #child;
  #folder;
  #next = 1;
  #waiting = new Map();
  #tabs = new Map();
  #unread = "";

  constructor() {
    this.#folder = mkdtempSync(path.join(os.tmpdir(), "plumb-browser-"));
    const options = [
      "--headless=new",
      "--remote-debugging-pipe",
      "--no-first-run",
      "--disable-gpu",
      "--force-color-profile=srgb",
      `--user-data-dir=${this.#folder}`,
    ];
    // Its sandbox needs a user other than root.
    if (process.getuid() === 0) options.push("--no-sandbox");
    const stdio = ["ignore", "ignore", "ignore", "pipe", "pipe"];
    this.#child = spawn(browserPath(), [...options, "about:blank"], { stdio });
    this.#child.stdio[4].setEncoding("utf8");
    this.#child.stdio[4].on("data", (text) => this.#read(text));
    this.#child.on("exit", () => this.#fail(new Error("the browser has ended")));
  }

  /** Opens a tab of this size, CSS pixels. */
  async open(address, { width, height, isPhone = false }) {
    const { targetId } = await this.send("Target.createTarget", { url: "about:blank" });
    const { sessionId } = await this.send("Target.attachToTarget", { targetId, flatten: true });
    const tab = new Tab(this, sessionId, targetId);
    this.#tabs.set(sessionId, tab);
    await tab.send("Runtime.enable");
    await tab.send("Log.enable");
    await tab.resize({ width, height, isPhone });
    await tab.send("Page.enable");
    await tab.send("Page.navigate", { url: address });
    await tab.until(`location.href !== "about:blank" && document.readyState === "complete"`);
    return tab;
  }

  /** Ends the browser. */
  async close() {
    const ended = new Promise((resolve) => this.#child.once("exit", resolve));
    this.send("Browser.close").catch(() => {});
    await bounded(ended, "the end of the browser");
    rmSync(this.#folder, { recursive: true, force: true, maxRetries: 10 });
  }

  /** Sends a command of the DevTools protocol. Returns its result. */
  send(method, params = {}, sessionId = undefined) {
    const id = this.#next++;
    const result = new Promise((resolve, reject) => this.#waiting.set(id, { resolve, reject }));
    this.#child.stdio[3].write(`${JSON.stringify({ id, method, params, sessionId })}\0`);
    return bounded(result, method);
  }

  #read(text) {
    const messages = (this.#unread + text).split("\0");
    this.#unread = messages.pop();
    for (const message of messages.map((json) => JSON.parse(json))) {
      const waiting = this.#waiting.get(message.id);
      if (waiting) {
        this.#waiting.delete(message.id);
        if (message.error) waiting.reject(new Error(message.error.message));
        else waiting.resolve(message.result);
      } else {
        this.#tabs.get(message.sessionId)?.note(message);
      }
    }
  }

  #fail(error) {
    for (const { reject } of this.#waiting.values()) reject(error);
    this.#waiting.clear();
  }
}

/** A tab of the browser. */
class Tab {
  /** Errors of the page's scripts, and what it may not load. */
  errors = [];

  constructor(browser, sessionId, targetId) {
    this.browser = browser;
    this.sessionId = sessionId;
    this.targetId = targetId;
  }

  /** Closes the tab. */
  async close() {
    await this.browser.send("Target.closeTarget", { targetId: this.targetId });
  }

  send(method, params) {
    return this.browser.send(method, params, this.sessionId);
  }

  note({ method, params }) {
    if (method === "Runtime.exceptionThrown") this.errors.push(params.exceptionDetails.text);
    if (method === "Log.entryAdded" && params.entry.level === "error") {
      this.errors.push(params.entry.text);
    }
  }

  async resize({ width, height, isPhone }) {
    const size = { width, height, deviceScaleFactor: 1, mobile: isPhone };
    await this.send("Emulation.setDeviceMetricsOverride", size);
    await this.send("Emulation.setTouchEmulationEnabled", { enabled: isPhone });
  }

  /** Has the system ask for a theme, "light" or "dark". */
  async setTheme(value) {
    const features = [{ name: "prefers-color-scheme", value }];
    await this.send("Emulation.setEmulatedMedia", { features });
  }

  /** Loads the page anew, and waits until it is there. */
  async reload() {
    await this.evaluate("window.isOld = true");
    await this.send("Page.reload");
    await this.until(`!window.isOld && document.readyState === "complete"`);
  }

  /** Returns the value of an expression in the page. */
  async evaluate(expression) {
    const options = { expression, returnByValue: true, awaitPromise: true };
    const { result, exceptionDetails } = await this.send("Runtime.evaluate", options);
    if (exceptionDetails) throw new Error(`${expression}: ${exceptionDetails.text}`);
    return result.value;
  }

  /** Waits until an expression in the page is true. */
  async until(expression) {
    await until(() => this.evaluate(expression), expression);
  }

  /** Presses and releases a key. */
  async press(key, code) {
    // A key with a name types nothing.
    const typed = key.length === 1 && { text: key, windowsVirtualKeyCode: key.charCodeAt(0) };
    const event = { key, code, ...typed };
    await this.send("Input.dispatchKeyEvent", { type: "keyDown", ...event });
    await this.send("Input.dispatchKeyEvent", { type: "keyUp", ...event });
  }

  /** Clicks into the middle of the element of a selector, `[right, down]` pixels beside it. */
  async click(selector, [right, down] = [0, 0]) {
    const quoted = JSON.stringify(selector);
    await this.evaluate(`document.querySelector(${quoted}).scrollIntoView({ block: "center" })`);
    const { x, y } = await this.evaluate(`(() => {
      const box = document.querySelector(${quoted}).getBoundingClientRect();
      return { x: box.x + box.width / 2, y: box.y + box.height / 2 };
    })()`);
    const event = { x: x + right, y: y + down, button: "left", clickCount: 1 };
    await this.send("Input.dispatchMouseEvent", { type: "mousePressed", ...event });
    await this.send("Input.dispatchMouseEvent", { type: "mouseReleased", ...event });
  }

  /**
   * Drags in the element of a selector, between places `[right, down]` pixels beside its middle, in
   * steps of 50 ms; awaits `atEnd()` before the release.
   */
  async drag(selector, from, to, atEnd) {
    const { x, y } = await this.evaluate(`(() => {
      const box = document.querySelector(${JSON.stringify(selector)}).getBoundingClientRect();
      return { x: box.x + box.width / 2, y: box.y + box.height / 2 };
    })()`);
    const steps = 20;
    const place = (k) => ({
      x: x + from[0] + ((to[0] - from[0]) * k) / steps,
      y: y + from[1] + ((to[1] - from[1]) * k) / steps,
    });
    const mouse = (type, k) => this.send("Input.dispatchMouseEvent", {
      type, ...place(k), button: "left", buttons: 1, clickCount: 1,
    });
    await mouse("mousePressed", 0);
    for (let k = 1; k <= steps; k += 1) {
      await mouse("mouseMoved", k);
      await new Promise((resolve) => setTimeout(resolve, 50));
    }
    await atEnd();
    await mouse("mouseReleased", steps);
  }

  /** Returns a picture of what is visible, as "png" or as "webp" of this quality. */
  async picture(format, quality = undefined) {
    const { data } = await this.send("Page.captureScreenshot", { format, quality });
    return Buffer.from(data, "base64");
  }
}

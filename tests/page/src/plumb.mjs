// The program with its page.

import { spawn } from "node:child_process";
import { mkdtempSync, rmSync } from "node:fs";
import os from "node:os";
import path from "node:path";
import { fileURLToPath } from "node:url";

import { bounded } from "./browser.mjs";

const ROOT = fileURLToPath(new URL("../../..", import.meta.url));

/** A running `plumb demo` with a page at a free port. */
export class Demo {
  /** Starts the program. Returns it once its page has an address. */
  static async start() {
    const demo = new Demo();
    demo.address = await bounded(demo.#address, "the address of the page");
    return demo;
  }

  #child;
  #text = "";
  #folder = mkdtempSync(path.join(os.tmpdir(), "plumb-page-"));
  #address;
  #exit;

  constructor() {
    const target = process.env.CARGO_TARGET_DIR ?? path.join(ROOT, "target");
    const program = path.join(target, "release", "plumb");
    const out = path.join(this.#folder, "run");
    const stdio = ["ignore", "pipe", "pipe"];
    this.#child = spawn(program, ["demo", "--page=127.0.0.1:0", "--out", out], { stdio });
    this.#exit = new Promise((resolve) => this.#child.once("exit", resolve));
    this.output = "";
    this.#child.stdout.on("data", (data) => { this.output += data; });
    this.#address = new Promise((resolve, reject) => {
      this.#child.on("error", reject);
      this.#exit.then(() => reject(new Error(`plumb has ended: ${this.#text}`)));
      this.#child.stderr.on("data", (data) => {
        this.#text += data;
        const found = this.#text.match(/page: (http:\S+)/);
        if (found) resolve(found[1]);
      });
    });
  }

  /** Returns the exit code once the program has ended by itself. */
  ended() {
    return bounded(this.#exit, "the end of plumb");
  }

  /** Ends the program with a signal and removes its folder. */
  async end(signal = "SIGTERM") {
    this.#child.kill(signal);
    await this.ended();
    rmSync(this.#folder, { recursive: true, force: true });
  }
}

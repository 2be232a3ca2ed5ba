// The program with its page.

import { spawn } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import os from "node:os";
import path from "node:path";
import { fileURLToPath } from "node:url";

import { bounded, until } from "./browser.mjs";

const ROOT = fileURLToPath(new URL("../../..", import.meta.url));

/** Path of the program. */
export const PROGRAM = path.join(
  process.env.CARGO_TARGET_DIR ?? path.join(ROOT, "target"), "release", "plumb",
);

/** Text before an address that the program prints, and the address. */
const PAGE = /page: (http:\S+)/;

/** A running `plumb`. */
export class Program {
  #child;
  #exit;
  #output = "";
  #messages = "";
  #ready;

  /** Starts the program in a folder. It is ready once its output has a match of `sign`. */
  constructor(args, folder, sign) {
    const stdio = ["ignore", "pipe", "pipe"];
    this.#child = spawn(PROGRAM, args, { stdio, cwd: folder });
    this.#exit = new Promise((resolve) => this.#child.once("exit", resolve));
    this.#ready = new Promise((resolve, reject) => {
      const look = () => {
        const found = `${this.#output}\n${this.#messages}`.match(sign);
        if (found) resolve(found[1]);
      };
      this.#child.on("error", reject);
      this.#child.stdout.on("data", (data) => { this.#output += data; look(); });
      this.#child.stderr.on("data", (data) => { this.#messages += data; look(); });
      this.#exit.then(() => reject(new Error(`plumb has ended: ${this.#messages}`)));
    });
  }

  /** Returns what the match of the sign holds: an address, a port. */
  ready() {
    return bounded(this.#ready, "the first output of plumb");
  }

  /** Returns standard output so far. */
  get output() {
    return this.#output;
  }

  /** Returns standard error so far. */
  get messages() {
    return this.#messages;
  }

  /** Waits until standard error has a match of `sign`. Returns what it holds. */
  async told(sign) {
    return (await until(() => this.#messages.match(sign), sign))[1];
  }

  /** Returns the exit code once the program has ended by itself. */
  ended() {
    return bounded(this.#exit, "the end of plumb");
  }

  /** Ends the program with a signal. */
  async end(signal = "SIGTERM") {
    this.#child.kill(signal);
    await this.ended();
  }
}

/** A folder for a test. */
export class Folder {
  path = mkdtempSync(path.join(os.tmpdir(), "plumb-page-"));

  /** Copies the paper's rig and its camera file; each `edit` returns the changed text. */
  copyRig({ rig = (text) => text, camera = (text) => text }) {
    const rigs = path.join(ROOT, "host", "rigs");
    const copy = (from, to, edit) => {
      const text = readFileSync(path.join(rigs, from), "utf8");
      writeFileSync(path.join(this.path, to), edit(text));
    };
    copy("paper.toml", "rig.toml", rig);
    copy("camera.toml", "camera.toml", camera);
  }

  /** Returns the text of a file. */
  read(name) {
    return readFileSync(path.join(this.path, name), "utf8");
  }

  remove() {
    rmSync(this.path, { recursive: true, force: true });
  }
}

/** A running `plumb demo` with a page at a free port. */
export class Demo {
  /** Starts the program. Returns it once its page has an address. */
  static async start(options = []) {
    const demo = new Demo(options);
    demo.address = await demo.#program.ready();
    return demo;
  }

  #folder = new Folder();
  #program;

  constructor(options) {
    const args = ["demo", "--page", "--page-address=127.0.0.1:0", "--out", "run", ...options];
    this.#program = new Program(args, this.#folder.path, PAGE);
  }

  get output() {
    return this.#program.output;
  }

  /** Returns the text of a file in the program's folder. */
  read(name) {
    return this.#folder.read(name);
  }

  /** Returns the exit code once the program has ended by itself. */
  ended() {
    return this.#program.ended();
  }

  /** Ends the program with a signal and removes its folder. */
  async end(signal = "SIGTERM") {
    await this.#program.end(signal);
    this.#folder.remove();
  }
}

/** Starts `plumb calibrate` with its page, in a folder with a rig. Returns program and address. */
export async function startCalibration(folder, options = []) {
  const args = ["calibrate", "--motors", "--page", "--page-address=127.0.0.1:0", ...options];
  const program = new Program(args, folder.path, PAGE);
  return { program, address: await program.ready() };
}

/**
 * Starts an emulated board and a run with a page, in a folder with a rig; a rig without motors in
 * space needs another one for the board. `command` may be "follow".
 */
export async function startRun(
  folder,
  options = [],
  boardRig = ["--rig", "rig.toml"],
  command = "run",
) {
  const board = new Program(["emulate", ...boardRig, "--json"], folder.path, /^(\S+)\s/);
  const port = await board.ready();
  const args = [command, "--port", port, "--page", "--page-address=127.0.0.1:0", "--out", "run"];
  const program = new Program([...args, ...options], folder.path, PAGE);
  try {
    return { board, program, address: await program.ready() };
  } catch (error) {
    // A board that goes on would keep the tests from their end.
    await board.end();
    throw error;
  }
}

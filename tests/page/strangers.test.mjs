// A page of another site in a browser on the same computer, against every port that Plumb opens.

import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import net from "node:net";
import { after, before, test } from "node:test";

import { HEIGHT, copyAskewRig } from "./src/askew.mjs";
import { Browser } from "./src/browser.mjs";
import { Camera } from "./src/camera.mjs";
import { PROGRAM, Folder, startCalibration, startRun } from "./src/plumb.mjs";
import { assertNothing, attackPort, openStranger, serveStranger } from "./src/stranger.mjs";

const DESKTOP = { width: 1280, height: 800 };

/** Targets that a stranger would like: they are inside the workspace of the paper's rig. */
const LINES = '{"target": [0.5, 0.25, 0.42]}\n'.repeat(5);

/** Commands that a stranger would like to give. */
const COMMAND = '{"type":"target","x":0.5,"y":0.25,"z":0.42}';

const text = (id) => `document.getElementById("${id}").textContent`;

/** Whether the program has the server for viewers. */
const hasViewers = () =>
  spawnSync(PROGRAM, ["demo", "--foxglove", "--help"], { stdio: "ignore" }).status === 0;

const portOf = (address) => Number(new URL(address).port);

/** Returns a free port. */
async function freePort() {
  const server = net.createServer().listen(0, "127.0.0.1");
  await new Promise((resolve) => server.once("listening", resolve));
  const { port } = server.address();
  await new Promise((resolve) => server.close(resolve));
  return port;
}

let browser;
let stranger;
let tab;
before(async () => {
  browser = new Browser();
  stranger = await serveStranger();
  tab = await openStranger(browser, stranger.address);
});
after(async () => {
  await browser.close();
  stranger.server.closeAllConnections();
  stranger.server.close();
});

test("a stranger's page moves no ball, and reads no page", async () => {
  const folder = new Folder();
  folder.copyRig({});
  const port = await freePort();
  const viewers = hasViewers() ? ["--foxglove", "--foxglove-address=127.0.0.1:0"] : [];
  const options = ["--json", `tcp:127.0.0.1:${port}`, ...viewers];
  const rig = ["--rig", "rig.toml"];
  const { board, program, address } = await startRun(folder, options, rig, "follow");
  try {
    const own = await browser.open(address, DESKTOP);
    await own.until(`${text("state")} === "ready" && /\\d/.test(${text("ball")})`);
    const before = await own.evaluate(text("motors"));

    const targets = await attackPort(tab, port, LINES);
    assertNothing(targets);
    assert.equal(targets.blind, "failed");
    assertNothing(await attackPort(tab, portOf(address), COMMAND));
    if (viewers.length > 0) {
      const live = await program.told(/live server for viewers: (ws:\S+)/);
      const seen = await attackPort(tab, portOf(live), LINES, ["foxglove.sdk.v1"]);
      // The book says so: whoever reaches the port may look, and can do no more.
      assert.match(seen.socket, /^opened \{/);
      assert.deepEqual(JSON.parse(seen.socket.slice("opened ".length)).capabilities, []);
      assertNothing({ ...seen, socket: "refused" });
    }
    assert.equal(await own.evaluate(text("motors")), before);
    assert.equal(await own.evaluate(text("state")), "ready");
    assert.match(program.messages, /first line is no target \(is it a browser or another prog/);
    assert.match(program.messages, /it begins with "POST \/ HTTP\/1.1"/);

    // A sender that begins with a target moves it through the same port.
    const friend = net.connect(port, "127.0.0.1");
    const sending = setInterval(() => friend.write(LINES.split("\n")[0] + "\n"), 50);
    await own.until(`${text("state")} === "following"`);
    await own.until(`${text("motors")} !== ${JSON.stringify(before)}`);
    clearInterval(sending);
    friend.destroy();
    assert.deepEqual(own.errors, []);
  } finally {
    await program.end("SIGINT");
    await board.end();
    folder.remove();
  }
  const { targets } = JSON.parse(program.output.trim().split("\n").at(-1));
  assert.ok(targets.unreadable >= 5, JSON.stringify(targets));
});

test("a stranger's page is no camera, before and beside the real one", async () => {
  const folder = new Folder();
  const port = await freePort();
  folder.copyRig({
    rig: (rig) => rig
      .slice(0, rig.indexOf("\n[simulation]"))
      .replace('file = "camera.toml"', `$&\nsource = "stream"\nstream = "tcp:127.0.0.1:${port}"`)
      .replace("host = 0.3", "host = 5.0")
      .replace("position = 0.5", "position = 5.0")
      .replace("max_age = 0.25", "max_age = 4.9"),
  });
  const camera = new Camera(port);
  // The run waits for its first picture.
  const { board, program, address } = await startRun(folder, [], []);
  try {
    await camera.untilListening();
    assertNothing(await attackPort(tab, port, LINES));
    await camera.show();
    const own = await browser.open(address, DESKTOP);
    await own.until(`/\\d/.test(${text("ball")})`);
    assertNothing(await attackPort(tab, port, LINES));
    const number = await own.evaluate(text("number"));
    await own.until(`${text("number")} !== ${JSON.stringify(number)}`);
  } finally {
    camera.end();
    await program.end("SIGINT");
    await board.end();
    folder.remove();
  }
});

test("a stranger's page cannot use the page of a calibration", async () => {
  const folder = new Folder();
  copyAskewRig(folder);
  const { program, address } = await startCalibration(folder, HEIGHT);
  try {
    const own = await browser.open(address, DESKTOP);
    assertNothing(await attackPort(tab, portOf(address), '{"type":"quit"}'));
    await own.until(`document.getElementById("lost")?.hidden`);
  } finally {
    await program.end();
    folder.remove();
  }
});

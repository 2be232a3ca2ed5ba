// A page of another site, and all that it can send to a port of this computer.

import assert from "node:assert/strict";
import { createServer } from "node:http";

const SIZE = { width: 400, height: 300 };

/** Serves an empty page of another origin. Returns the server and its address. */
export async function serveStranger() {
  const server = createServer((_, response) => {
    response.setHeader("Content-Type", "text/html");
    response.end("<!doctype html><title>A stranger</title>");
  });
  await new Promise((resolve) => server.listen(0, "127.0.0.1", resolve));
  return { server, address: `http://localhost:${server.address().port}/` };
}

/** Opens the page of another origin. */
export function openStranger(browser, address) {
  return browser.open(address, SIZE);
}

/**
 * Sends `lines` to a port in every way that a page has. Runs in the page. Returns what became of
 * each way: the page sees no more of it.
 */
async function attack(port, lines, protocols) {
  const origin = `127.0.0.1:${port}`;
  // A port that answers nothing keeps its connection.
  const late = () => new Promise((resolve) => setTimeout(resolve, 3000, "no answer"));
  const first = (promise) => Promise.race([promise, late()]);
  const post = (mode) => fetch(`http://${origin}/`, {
    method: "POST",
    mode,
    headers: { "Content-Type": "text/plain" },
    body: lines,
    signal: AbortSignal.timeout(3000),
  }).then(({ type, status }) => `${type} ${status}`, () => "failed");

  const form = () => {
    const name = `sink${Math.random()}`;
    document.body.insertAdjacentHTML("beforeend", `<iframe name="${name}"></iframe>
      <form method="post" enctype="text/plain" target="${name}" action="http://${origin}/">
      <textarea name="x"></textarea></form>`);
    document.body.lastElementChild.elements.x.value = `\n${lines}`;
    const frame = document.getElementsByName(name)[0];
    const loaded = new Promise((resolve) => { frame.onload = () => resolve("sent"); });
    document.body.lastElementChild.submit();
    return loaded;
  };

  const socket = () => new Promise((resolve) => {
    const page = new WebSocket(`ws://${origin}/socket`, protocols);
    let isOpen = false;
    page.onopen = () => { isOpen = true; page.send(lines); };
    page.onmessage = ({ data }) => resolve(`opened ${data}`);
    page.onclose = () => resolve(isOpen ? "opened" : "refused");
  });

  const image = () => new Promise((resolve) => {
    const element = new Image();
    element.onload = () => resolve("loaded");
    element.onerror = () => resolve("failed");
    element.src = `http://${origin}/${encodeURIComponent(lines)}?${lines}`;
  });

  const read = (scheme) => fetch(`${scheme}://${origin}/`, { signal: AbortSignal.timeout(3000) })
    .then((reply) => reply.text()).then((text) => `read ${text}`, () => "failed");

  // The first message of TURN names the user after the first reply only.
  const turn = async () => {
    const urls = `turn:${origin}?transport=tcp`;
    const iceServers = [{ urls, username: lines, credential: lines }];
    const peer = new RTCPeerConnection({ iceServers, iceTransportPolicy: "relay" });
    const failed = new Promise((resolve) => {
      peer.onicecandidateerror = () => resolve("failed");
      peer.onicecandidate = ({ candidate }) => candidate && resolve("relayed");
    });
    peer.createDataChannel("x");
    await peer.setLocalDescription();
    return first(failed).finally(() => peer.close());
  };

  navigator.sendBeacon(`http://${origin}/`, lines);
  return {
    blind: await post("no-cors"),
    post: await post("cors"),
    form: await first(form()),
    socket: await first(socket()),
    image: await first(image()),
    read: await read("http"),
    tls: await read("https"),
    turn: await turn(),
  };
}

/** Sends `lines` from a tab to a port in every way that a page has. Returns what became of it. */
export function attackPort(tab, port, lines, protocols = []) {
  const values = [port, lines, protocols].map((value) => JSON.stringify(value));
  return tab.evaluate(`(${attack})(${values.join(", ")})`);
}

/** Checks that a page got nothing of a port, and could send nothing but requests. */
export function assertNothing({ post, socket, image, read, tls, turn }) {
  const failed = { post: "failed", image: "failed", read: "failed", tls: "failed" };
  assert.deepEqual({ post, image, read, tls }, failed);
  assert.equal(socket, "refused");
  assert.notEqual(turn, "relayed");
}

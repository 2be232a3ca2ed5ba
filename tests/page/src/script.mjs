// A program that sends commands to the page's WebSocket, without a browser.

import net from "node:net";
import { randomBytes } from "node:crypto";

import { bounded } from "./browser.mjs";

/** Opcode of a text message (RFC 6455, 5.2). */
const TEXT = 1;

/** A WebSocket that sends targets again and again, and keeps the problems that it is told. */
export class Script {
  problems = [];
  #socket;
  #unread = Buffer.alloc(0);
  #isOpen = false;
  #timer = null;
  #waiting = [];

  /** Connects to the page at `address`. `opened` resolves once the handshake is done. */
  constructor(address) {
    const { hostname, port, host } = new URL(address);
    const key = randomBytes(16).toString("base64");
    const request = [
      "GET /socket HTTP/1.1",
      `Host: ${host}`,
      "Upgrade: websocket",
      "Connection: Upgrade",
      "Sec-WebSocket-Version: 13",
      `Sec-WebSocket-Key: ${key}`,
    ];
    this.#socket = net.connect(Number(port), hostname, () => {
      this.#socket.write(`${request.join("\r\n")}\r\n\r\n`);
    });
    this.opened = bounded(new Promise((resolve, reject) => {
      this.#socket.on("error", reject);
      this.#socket.on("data", (data) => this.#read(data, resolve));
    }), "the WebSocket of the script");
  }

  /** Sends a target every `interval` milliseconds. */
  repeatTargets(interval) {
    const target = { type: "target", x: 0.5, y: 0.35, z: 0.3 };
    this.#timer = setInterval(() => this.send(target), interval);
  }

  /** Ends the targets. */
  cease() {
    clearInterval(this.#timer);
  }

  /** Waits for a problem for which `isWanted`, from now on. */
  until(isWanted) {
    const come = new Promise((resolve) => this.#waiting.push({ isWanted, resolve }));
    return bounded(come, "a problem for the script");
  }

  close() {
    this.cease();
    this.#socket.destroy();
  }

  /** Sends a message, masked as a client has to (RFC 6455, 5.3). */
  send(message) {
    const text = Buffer.from(JSON.stringify(message));
    const mask = randomBytes(4);
    const masked = text.map((byte, index) => byte ^ mask[index % 4]);
    const head = Buffer.from([0x80 | TEXT, 0x80 | text.length]);
    this.#socket.write(Buffer.concat([head, mask, masked]));
  }

  #read(data, opened) {
    this.#unread = Buffer.concat([this.#unread, data]);
    if (!this.#isOpen) {
      const end = this.#unread.indexOf("\r\n\r\n");
      if (end < 0) return;
      this.#isOpen = true;
      this.#unread = this.#unread.subarray(end + 4);
      opened();
    }
    for (let frame = this.#next(); frame; frame = this.#next()) {
      if (frame.opcode === TEXT) this.#take(JSON.parse(frame.payload.toString()));
    }
  }

  /** Removes and returns the next frame; null where it is not complete. */
  #next() {
    if (this.#unread.length < 2) return null;
    let [length, begin] = [this.#unread[1] & 0x7f, 2];
    if (length >= 126) {
      begin = length === 126 ? 4 : 10;
      if (this.#unread.length < begin) return null;
      length = length === 126
        ? this.#unread.readUInt16BE(2) : Number(this.#unread.readBigUInt64BE(2));
    }
    if (this.#unread.length < begin + length) return null;
    const frame = {
      opcode: this.#unread[0] & 0x0f,
      payload: this.#unread.subarray(begin, begin + length),
    };
    this.#unread = this.#unread.subarray(begin + length);
    return frame;
  }

  #take(message) {
    if (message.type === "update") this.send({ type: "seen", update: message.number });
    if (message.type !== "problem") return;
    this.problems.push(message.text);
    this.#waiting = this.#waiting.filter(({ isWanted, resolve }) => {
      const isCome = isWanted(message.text);
      if (isCome) resolve();
      return !isCome;
    });
  }
}

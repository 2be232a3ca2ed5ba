// A camera that sends pictures to a run: the ball hangs still where the paper's target is, as in
// docs/use/stream.md.

import net from "node:net";

import { until } from "./browser.mjs";

const [WIDTH, HEIGHT] = [640, 480];

/** Middle of the ball's disc, and the square of its radius, pixels. */
const DISC = { u: 364, v: 269, square: 246 };

/** Time between two pictures, ms. */
const PERIOD = 1000 / 30;

/** Returns the pixels of colour and depth. */
function picture() {
  const colour = Buffer.alloc(3 * WIDTH * HEIGHT);
  const depth = Buffer.alloc(2 * WIDTH * HEIGHT);
  for (let at = 0; at < WIDTH * HEIGHT; at += 1) {
    const [x, y] = [(at % WIDTH) - DISC.u, Math.floor(at / WIDTH) - DISC.v];
    const near = Math.sqrt(Math.max(0, 1 - (x * x + y * y) / DISC.square));
    colour.set(near > 0 ? [200, 30, 30] : [110, 112, 115], 3 * at);
    depth.writeUInt16LE(near > 0 ? Math.round(1337 - 40 * near) : 2500, 2 * at);
  }
  return { colour, depth };
}

/** A camera that connects to a TCP port. */
export class Camera {
  #port;
  #socket;
  #timer;
  #picture = picture();

  constructor(port) {
    this.#port = port;
  }

  /** Connects, as soon as something listens, and sends pictures from then on. */
  async show() {
    this.#socket = await listening(this.#port);
    this.#socket.on("error", () => this.end());
    this.#timer = setInterval(() => this.#send(), PERIOD);
  }

  /** Waits until something listens. */
  async untilListening() {
    (await listening(this.#port)).destroy();
  }

  #send() {
    const { colour, depth } = this.#picture;
    const header = {
      t: performance.now() / 1000, width: WIDTH, height: HEIGHT,
      colour: "rgb8", colour_bytes: colour.length,
      depth: "z16", depth_bytes: depth.length, depth_scale: 1000,
    };
    this.#socket.write(`${JSON.stringify(header)}\n`);
    this.#socket.write(colour);
    this.#socket.write(depth);
  }

  /** Disconnects. */
  end() {
    clearInterval(this.#timer);
    this.#socket?.destroy();
  }
}

/** Returns a connection to a port, as soon as something listens there. */
function listening(port) {
  return until(() => connected(port), `a program that listens at ${port}`);
}

/** Returns a connection to a port; `undefined` where nothing listens. */
function connected(port) {
  return new Promise((resolve) => {
    const socket = net.connect(port, "127.0.0.1");
    socket.once("connect", () => resolve(socket));
    socket.once("error", () => resolve(undefined));
  });
}

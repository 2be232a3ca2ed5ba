// Connection to the program: a WebSocket with JSON messages, and pictures as binary messages.

/** Version of the messages. It differs from the program's if the program was updated since. */
const VERSION = 5;

/** Time without an update after which the connection is lost, ms. One comes each second. */
const SILENCE = 3000;

/** Time between two attempts to connect, ms. */
const RETRY = 2000;

/**
 * Keeps a connection to a program whose page shows `subject`, and calls `events`:
 * `hello(message)`, `update(message)`, `picture(frame, bitmap)`, `problem(text)`, `lost(reason)`,
 * and `picked(message)` and `projected(message)` where the subject has them. `lost` is
 * called once for each lost connection.
 */
export class Connection {
  #subject;
  #events;
  #socket = null;
  #heard = 0;
  #frame = null;
  #isLost = true;

  constructor(subject, events) {
    [this.#subject, this.#events] = [subject, events];
    setInterval(() => this.#check(), 500);
    this.connect();
  }

  /** Connects anew. */
  connect() {
    this.#socket?.close();
    const address = new URL("socket", location.href);
    address.protocol = "ws:";
    const socket = new WebSocket(address);
    socket.binaryType = "blob";
    socket.onmessage = (message) => this.#take(socket, message.data);
    socket.onclose = (event) => this.#lose(socket, event.reason);
    this.#socket = socket;
    this.#heard = performance.now();
  }

  /** Sends a command. Returns whether it went out. */
  send(command) {
    if (this.#isLost || this.#socket.readyState !== WebSocket.OPEN) return false;
    this.#socket.send(JSON.stringify(command));
    return true;
  }

  #take(socket, data) {
    if (socket !== this.#socket) return;
    this.#heard = performance.now();
    if (typeof data !== "string") {
      this.#show(data);
      return;
    }
    const message = JSON.parse(data);
    if (message.type === "hello") {
      // Another program may be behind the address by now.
      if (message.version !== VERSION || message.subject !== this.#subject) {
        location.reload();
        return;
      }
      this.#isLost = false;
      this.#events.hello(message);
    } else if (message.type === "update") {
      this.#frame = message.picture;
      this.#events.update(message);
      // The program sends the next update after this.
      this.send({ type: "seen", update: message.number });
    } else if (message.type === "problem") {
      this.#events.problem(message.text);
    } else if (message.type === "picked" || message.type === "projected") {
      this.#events[message.type]?.(message);
    }
  }

  async #show(blob) {
    const frame = this.#frame;
    try {
      this.#events.picture(frame, await createImageBitmap(blob));
    } catch {
      this.#events.problem("a picture could not be decoded");
    }
  }

  /** Gives a silent connection up, and connects again after a lost one. */
  #check() {
    const silent = performance.now() - this.#heard;
    if (silent > SILENCE && !this.#isLost) {
      this.#lose(this.#socket, "the program is silent");
    } else if (silent > RETRY && this.#isLost) {
      this.connect();
    }
  }

  #lose(socket, reason) {
    if (socket !== this.#socket) return;
    this.#isLost = true;
    this.#events.lost(reason);
  }
}

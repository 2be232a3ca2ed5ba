// The files of a run that has ended: fetched while the program is there, and kept for the person.

const byId = (id) => document.getElementById(id);

/** Files of the run, as links to copies in the browser. */
export class Files {
  #send;
  #isTaken = false;
  #addresses = [];

  /** `send(command)` tells the program that it need not wait. */
  constructor(send) {
    this.#send = send;
  }

  /** Forgets the files: another run has begun. */
  clear() {
    this.#isTaken = false;
    for (const address of this.#addresses) URL.revokeObjectURL(address);
    this.#addresses = [];
    byId("files").hidden = true;
    byId("files").querySelector("ul").replaceChildren();
  }

  /** Fetches the files that the program lists: `{ name, bytes }`. Once is enough. */
  async take(files) {
    if (this.#isTaken || files.length === 0) return;
    this.#isTaken = true;
    const items = await Promise.all(files.map((file) => this.#fetch(file)));
    byId("files").querySelector("ul").replaceChildren(...items);
    byId("files").hidden = false;
    this.#send({ type: "taken" });
  }

  /** Returns a line with a link to a file, or with what went wrong. */
  async #fetch({ name, bytes }) {
    const item = document.createElement("li");
    try {
      const reply = await fetch(`files/${name}`);
      if (!reply.ok) throw new Error(reply.statusText);
      const address = URL.createObjectURL(await reply.blob());
      this.#addresses.push(address);
      const link = document.createElement("a");
      [link.href, link.download, link.textContent] = [address, name, name];
      item.append(link, ` ${(bytes / 1000).toFixed(bytes < 10_000 ? 1 : 0)} kB`);
    } catch {
      item.textContent = `${name}: only in the run folder`;
    }
    return item;
  }
}

// Commands of a person: buttons, keys, the choice of a target.

const byId = (id) => document.getElementById(id);
const inputs = ["x", "y", "z"].map(byId);

/** Time between two places of a target that a person drags, ms. */
const MOVE_INTERVAL = 33;

/** Key of the typed target in the memory of the tab: it outlives a reload. */
const STORED = "plumb.target";

/** The controls. `send(command)` sends one and returns whether it went out. */
export class Controls {
  #send;
  #rig = null;
  #isEnabled = false;
  /** Stop in force; null where the ball may be moved. */
  #stop = null;
  /** Gesture that moves the target: its timer, and the number of places that were sent. */
  #gesture = null;

  constructor(send) {
    this.#send = send;
    this.#listen();
  }

  /** Takes the rig: the limits of the target. The choice begins in the workspace's middle. */
  setRig(rig) {
    this.#rig = rig;
    const [low, high] = rig.workspace;
    const stored = storedTarget();
    inputs.forEach((input, axis) => {
      [input.min, input.max] = [low[axis], high[axis]];
      const begin = stored?.[axis] ?? (low[axis] + high[axis]) / 2;
      if (input.value === "") input.value = begin.toFixed(3);
    });
    for (const option of byId("steps").options) {
      option.disabled = Number(option.value) > rig.jog_distance;
    }
    for (const button of document.querySelectorAll("[data-motor]")) {
      button.hidden = "ABC".indexOf(button.dataset.motor) >= rig.motor_count;
    }
    const height = byId("height");
    [height.min, height.max, height.value] = [low[2], high[2], inputs[2].value];
    byId("lowest").textContent = low[2].toFixed(2);
    byId("highest").textContent = `${high[2].toFixed(2)} m`;
    this.#checkChoice();
  }

  /** Returns the chosen target [x, y, z], metres; NaN where a field holds no number. */
  choice() {
    return inputs.map((input) => input.valueAsNumber);
  }

  /** Sets x and y of the choice, and z if it is given. */
  choose(x, y, z = undefined) {
    [inputs[0].value, inputs[1].value] = [x.toFixed(3), y.toFixed(3)];
    if (z !== undefined) inputs[2].value = byId("height").value = z.toFixed(3);
    this.#checkChoice();
  }

  /**
   * Moves the choice, and the ball follows it. Its place is sent again and again, also while it
   * rests, until the gesture or another command ends that.
   */
  move(x, y) {
    this.choose(x, y);
    if (this.#gesture || this.#stop) return;
    this.#gesture = { sent: 0, timer: setInterval(() => this.#sendMove(), MOVE_INTERVAL) };
    this.#sendMove();
  }

  /** Ends a gesture: the ball stops at the choice. */
  release(x, y) {
    this.choose(x, y);
    const isFollowed = this.#gesture?.timer !== null;
    this.#endMoves();
    this.#gesture = null;
    if (!isFollowed || this.#stop || !this.#checkChoice()) return;
    this.#command({ type: "target", x, y, z: this.choice()[2] });
  }

  #sendMove() {
    if (!this.#checkChoice()) return;
    const [x, y, z] = this.choice();
    this.#command({ type: "move", x, y, z, first: this.#gesture.sent === 0 });
    this.#gesture.sent += 1;
  }

  /** Sends no more places of the gesture under way. */
  #endMoves() {
    if (!this.#gesture) return;
    clearInterval(this.#gesture.timer);
    this.#gesture.timer = null;
  }

  /**
   * Enables the controls that make sense with the board's telemetry, which is null if it is
   * unknown, and with the Stop in force, which is null if there is none; all are off if not
   * `enabled`.
   */
  update(enabled, telemetry, stop) {
    this.#isEnabled = enabled;
    this.#stop = stop;
    // The gesture under way does not go on after a Resume.
    if (stop) this.#endMoves();
    const canJog = enabled && !stop && telemetry?.state === "ready";
    for (const button of document.querySelectorAll("[data-motor]")) button.disabled = !canJog;
    byId("jog-note").textContent =
      !enabled || canJog
        ? "+ pays cable out: the ball sinks."
        : stop
          ? "To jog, Resume first."
          : "To jog, the motors must be at rest: Stop, then Resume.";
    for (const id of ["stop", "end"]) byId(id).disabled = !enabled;
    byId("hold").disabled = !enabled || stop !== null;
    byId("resume").disabled = !enabled || !stop;
    byId("stop-label").textContent = stop ? "Stopped" : "STOP";
    byId("stop").classList.toggle("is-stopped", stop !== null);
    // The board refuses to clear a fault before its motors stand.
    const isTurning = telemetry?.rates_steps_s.some((rate) => rate !== 0) ?? false;
    byId("clear").disabled = !enabled || isTurning;
    this.#checkChoice();
  }

  #listen() {
    const stop = () => this.#command({ type: "stop" });
    // A press counts, not the release. A click without a pointer is the Enter key.
    byId("stop").addEventListener("pointerdown", stop);
    byId("stop").addEventListener("click", (event) => { if (event.detail === 0) stop(); });
    for (const button of document.querySelectorAll("[data-command]")) {
      button.addEventListener("click", () => this.#command({ type: button.dataset.command }));
    }
    for (const button of document.querySelectorAll("[data-motor]")) {
      button.addEventListener("click", () => this.#jog(button.dataset));
    }
    byId("resume").addEventListener("click", () => {
      if (this.#stop) this.#command({ type: "resume", stop: this.#stop.number });
    });
    byId("end").addEventListener("click", () => {
      if (window.confirm("End the run? The motors ramp down and keep their current.")) {
        this.#command({ type: "end" });
      }
    });
    byId("target").addEventListener("submit", (event) => {
      event.preventDefault();
      const [x, y, z] = this.choice();
      if (this.#checkChoice() && !this.#stop) this.#command({ type: "target", x, y, z });
    });
    inputs.forEach((input) => input.addEventListener("input", () => {
      byId("height").value = inputs[2].value;
      this.#checkChoice();
    }));
    byId("height").addEventListener("input", (event) => {
      inputs[2].value = event.target.valueAsNumber.toFixed(3);
      this.#checkChoice();
    });
    this.#listenToKeys(stop);
  }

  /** The space key stops wherever the focus is; it presses no other button. */
  #listenToKeys(stop) {
    const take = (event, action) => {
      event.preventDefault();
      event.stopPropagation();
      if (event.type === "keydown" && !event.repeat) action();
    };
    const handle = (event) => {
      const isTyping = event.target instanceof HTMLInputElement && event.target.type === "number";
      if (event.code === "Space") take(event, stop);
      else if (event.code === "KeyH" && !isTyping && !event.ctrlKey && !event.metaKey) {
        take(event, () => { if (!this.#stop) this.#command({ type: "hold" }); });
      }
    };
    window.addEventListener("keydown", handle, { capture: true });
    window.addEventListener("keyup", handle, { capture: true });
  }

  #jog({ motor, sign }) {
    const steps = Number(sign) * Number(byId("steps").value);
    this.#command({ type: "jog", motor, steps, rate: this.#rig.jog_rate });
  }

  #command(command) {
    if (command.type !== "move") this.#endMoves();
    if (this.#isEnabled) this.#send(command);
  }

  /** Says what is wrong with the choice, and keeps it. Returns whether it can be a target. */
  #checkChoice() {
    if (!this.#rig) return false;
    storeTarget(this.choice());
    const [low, high] = this.#rig.workspace;
    const outside = ["x", "y", "z"].filter((_, axis) => {
      const value = inputs[axis].valueAsNumber;
      return !(value >= low[axis] && value <= high[axis]);
    });
    const note = byId("target-note");
    note.classList.toggle("bad", outside.length > 0);
    note.textContent = outside
      .map((name) => {
        const axis = "xyz".indexOf(name);
        return `${name} must be ${low[axis].toFixed(3)} to ${high[axis].toFixed(3)} m`;
      })
      .join("; ");
    if (this.#stop && outside.length === 0) note.textContent = "To move the ball, Resume first.";
    document.querySelector("#target button").disabled =
      !this.#isEnabled || this.#stop !== null || outside.length > 0;
    return outside.length === 0;
  }
}

/** Returns the target that was typed before a reload; null where there is none. */
function storedTarget() {
  try {
    const target = JSON.parse(sessionStorage.getItem(STORED));
    const isTarget = Array.isArray(target) && target.length === 3 && target.every(Number.isFinite);
    return isTarget ? target : null;
  } catch {
    return null;
  }
}

/** Keeps a target over a reload. A browser that keeps nothing of a page refuses it. */
function storeTarget(target) {
  try {
    sessionStorage.setItem(STORED, JSON.stringify(target));
  } catch {
    // The target begins in the workspace's middle then.
  }
}

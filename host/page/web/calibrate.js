// The page of a calibration: a person chooses the motors in the picture and accepts the pose.

import { Connection } from "./connection.js";
import { Picker } from "./picker.js";

const byId = (id) => document.getElementById(id);

/** Names of the points, and the last update: chosen points, pose, problem, end. */
const state = { names: [], marks: [], result: null, problem: null, ended: null };

// The address must not show the token to whoever looks at the screen; a cookie has it.
if (location.search) window.history.replaceState(null, "", location.pathname);

const picker = new Picker(byId("picture"), byId("loupe"), {
  move([u, v]) {
    byId("column").textContent = u.toFixed(1);
    byId("row").textContent = v.toFixed(1);
  },
  pick,
  undo: () => connection.send({ type: "undo" }),
});

const connection = new Connection("calibration", {
  hello(message) {
    state.names = message.names;
    byId("file").textContent = message.file;
    byId("lost").hidden = true;
    byId("main").inert = false;
    show();
  },

  update(message) {
    const before = JSON.stringify(state);
    for (const key of ["marks", "result", "problem", "ended"]) state[key] = message[key];
    // A text that is written again would be read out again.
    if (JSON.stringify(state) === before) return;
    byId("problem").textContent = message.problem ?? "";
    show();
  },

  picture(_frame, bitmap) {
    const isFirst = picker.cursor() === null;
    picker.setPicture(bitmap);
    if (!isFirst) return;
    byId("picture-note").textContent = "";
    show();
  },

  problem(text) {
    byId("problem").textContent = text;
  },

  lost(reason) {
    byId("lost").hidden = false;
    byId("lost").classList.toggle("ended", state.ended !== null);
    byId("main").inert = true;
    byId("lost-title").textContent = state.ended ? "The calibration has ended" : "Connection lost";
    byId("lost-text").textContent = state.ended ?? (reason ? `${reason}.` : "");
  },
});

byId("retry").addEventListener("click", () => connection.connect());
byId("set").addEventListener("click", pick);
for (const type of ["undo", "accept", "quit"]) {
  byId(type).addEventListener("click", () => connection.send({ type }));
}
for (const button of document.querySelectorAll("[data-nudge]")) {
  const [right, down] = button.dataset.nudge.split(",").map(Number);
  button.addEventListener("click", () => picker.nudge(right, down));
}

/** Chooses the pixel of the crosshair for the next motor. */
function pick() {
  const cursor = picker.cursor();
  if (!cursor || state.marks.length >= state.names.length) return;
  connection.send({ type: "click", u: cursor[0], v: cursor[1] });
}

function show() {
  const next = state.names[state.marks.length];
  const hasPicture = picker.cursor() !== null;
  picker.setMarks(state.marks);
  byId("step").textContent = next ? `choose motor ${next}` : "check the result";
  byId("step").className = next ? "badge seeking" : "badge holding";
  byId("set").textContent = next ? `Choose the crosshair as motor ${next}` : "All are chosen";
  byId("set").disabled = !next || !hasPicture;
  byId("undo").disabled = state.marks.length === 0;
  byId("accept").disabled = !state.result?.acceptable;
  byId("marks").replaceChildren(...state.names.map((name, index) => row(name, state.marks[index])));
  byId("result").replaceChildren(...lines().map((text) => element("li", text)));
}

/** Returns the lines about the result. */
function lines() {
  const none = `nothing yet: choose the motors in the order ${state.names.join(", ")}`;
  return state.result?.lines ?? [none];
}

/** Returns the table's row of a motor; `mark` is undefined until it is chosen. */
function row(name, mark) {
  const values = mark
    ? [mark.pixel[0].toFixed(1), mark.pixel[1].toFixed(1), mark.depth?.toFixed(3) ?? ""]
    : ["", "", ""];
  const line = document.createElement("tr");
  line.append(element("th", name), ...values.map((text) => element("td", text)));
  return line;
}

function element(kind, text) {
  const made = document.createElement(kind);
  made.textContent = text;
  return made;
}

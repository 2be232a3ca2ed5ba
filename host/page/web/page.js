// The page: takes the program's messages and draws them.

import { Aim } from "./aim.js";
import { Connection } from "./connection.js";
import { Controls } from "./controls.js";
import { drawCurves } from "./curves.js";
import { Files } from "./files.js";
import { History } from "./history.js";
import { Picture } from "./picture.js";
import { Space } from "./space.js";

/** Age of the newest picture above which the page says so, ms. */
const STALE = 1000;

/** Events that are shown. */
const EVENTS = 50;

const byId = (id) => document.getElementById(id);
const history = new History();
const controls = new Controls((command) => connection.send(command));
const files = new Files((command) => connection.send(command));
const aim = new Aim(
  (command) => connection.send(command),
  (x, y, z) => controls.choose(x, y, z),
);
const picture = new Picture(byId("picture"), byId("frame"),
  (pixel) => aim.pick(pixel, controls.choice()));
const space = new Space(byId("space"), byId("rig"), {
  choose: (x, y) => controls.choose(x, y),
  move: (x, y) => controls.move(x, y),
  release: (x, y) => controls.release(x, y),
});

/** State of the run as the program last told it; null is unknown. */
const run = {
  rig: null, commands: false, frame: null, board: null, goal: null, stop: null, ended: null,
};
/** Whether the connection is there, when the last frame came, and the newest event. */
const link = { isLost: true, framed: 0, event: -1 };

// The address must not show the token to whoever looks at the screen; a cookie has it.
if (location.search) window.history.replaceState(null, "", location.pathname);

const connection = new Connection("run", {
  hello(message) {
    if (run.ended) files.clear();
    [run.rig, run.commands] = [message.rig, message.commands];
    link.isLost = false;
    link.framed = performance.now();
    byId("law").textContent = message.rig.title;
    document.title = `Plumb: ${message.rig.law}`;
    space.setRig(message.rig);
    controls.setRig(message.rig);
    // A page that only shows has no target to choose.
    const plane = message.commands ? message.rig.sight : null;
    aim.setPlane(plane);
    picture.setAim(plane !== null);
    byId("lost").hidden = true;
    byId("main").inert = false;
  },

  update(message) {
    if (message.frame && run.frame && message.frame.number < run.frame.number) beginAnew();
    if (message.frame?.number !== run.frame?.number) link.framed = performance.now();
    history.add(message.samples);
    for (const key of ["frame", "board", "goal", "stop", "ended"]) run[key] = message[key];
    message.events.forEach(addEvent);
    files.take(message.files);
    showState();
    showValues();
  },

  picture: (frame, bitmap) => picture.show(frame, bitmap),

  picked: (message) => aim.takePicked(message),

  projected: (message) => aim.takeProjected(message),

  problem(text) {
    addEvent({ at: Date.now(), kind: "bad", text });
  },

  lost(reason) {
    link.isLost = true;
    run.board = null;
    byId("lost").hidden = false;
    byId("lost").classList.toggle("ended", run.ended !== null);
    byId("main").inert = true;
    byId("lost-title").textContent = run.ended ? "The run has ended" : "Connection lost";
    byId("lost-text").textContent = run.ended
      ? endText(run.ended)
      : `${reason ? `${reason}. ` : ""}The program may still drive the ball: use the emergency ` +
        "button, or Ctrl-C in the program's terminal.";
    showState();
    showValues();
  },
});

byId("retry").addEventListener("click", () => connection.connect());

/** Forgets what was shown of an earlier run: the program was started again. */
function beginAnew() {
  history.clear();
  link.event = -1;
  byId("events").replaceChildren();
}

/** Returns how a run ended, in words. */
function endText({ ending, at_rest: atRest }) {
  const rest = atRest ? "The motors stand." : "The board did not confirm that its motors stand.";
  return `${ending}. ${rest} Start the program again for another run.`;
}

function showState() {
  const { board, goal, ended } = run;
  const state = ended ? "ended" : link.isLost ? "unknown" : (board?.state ?? "unknown");
  byId("state").textContent = state;
  byId("state").className = `badge ${state}`;
  byId("fault").hidden = link.isLost || !board?.fault;
  byId("fault-text").textContent = board?.fault?.text ?? "";
  byId("fault-next").textContent = board?.fault?.next ?? "";
  // A fault is named below.
  const ending = board?.fault ? "not reached" : goal?.ending;
  const place = goal?.target.map((value) => value.toFixed(3)).join(", ");
  byId("goal").classList.toggle("reached", goal?.reached ?? false);
  byId("goal").textContent = !goal
    ? "no target"
    : `target (${place}) m${goal.reached ? " reached" : ending ? `: ${ending}` : ""}`;
  const isLive = !link.isLost && !ended;
  showStop(isLive ? run.stop : null);
  controls.update(isLive && run.commands, board, run.stop);
}

/** Says who has stopped the rig, and when; `stop` is null where no Stop is in force. */
function showStop(stop) {
  byId("stopped").hidden = !stop;
  if (!stop) return;
  const time = new Date(stop.since).toLocaleTimeString();
  const refused = stop.refused > 0 ? ` Refused since then: ${stop.refused}.` : "";
  byId("stopped-text").textContent = `By ${stop.by} at ${time} (command ${stop.number}).${refused}`;
}

function showValues() {
  const { board, frame } = run;
  const known = (value, text) => (value === null || value === undefined ? "unknown" : text(value));
  const numbers = (digits) => (list) =>
    list.map((value) => value.toFixed(digits).padStart(digits + 4)).join(" ");
  const millimetres = (metres) => (1e3 * metres).toFixed(1);
  const last = history.samples.at(-1);
  byId("ball").textContent = frame?.position ? numbers(3)(frame.position) : "not seen";
  byId("error").textContent = known(last?.error, millimetres);
  byId("filtered").textContent = known(board?.filtered_error, millimetres);
  byId("pace").textContent = board?.pace === null || board?.pace === undefined
    ? "no path" : (100 * board.pace).toFixed(0);
  byId("rates").textContent = known(board?.rates, numbers(1));
  byId("motors").textContent = known(board?.motors, numbers(1));
  showTensions(board);
  showDrivers(board?.drivers);
  byId("number").textContent = known(frame, () => `${frame.number} at ${frame.time.toFixed(1)} s`);
  byId("rate").textContent = known(history.rate(), (rate) => `${rate.toFixed(0)}/s`);
}

/** Shows the law's estimate of the tensions, over the ball's weight, with marks near slack. */
function showTensions(board) {
  const tensions = board?.tensions;
  byId("tensions").hidden = !tensions;
  byId("no-tensions").hidden = !!tensions;
  if (!tensions) {
    const isDriven = ["seeking", "holding"].includes(board?.state);
    byId("no-tensions").textContent = !board
      ? "unknown"
      : run.rig.law !== "taut"
        ? "no estimate with this law"
        : isDriven ? "no estimate yet" : "no estimate without a target";
    return;
  }
  [...byId("tensions").children].forEach((bar, cable) => {
    const isNearSlack = tensions.near_slack[cable];
    bar.className = isNearSlack ? "near-slack" : "";
    bar.querySelector("meter").value = tensions.weights[cable];
    bar.querySelector("b").textContent =
      tensions.weights[cable].toFixed(2) + (isNearSlack ? " near slack" : "");
  });
}

/** Shows the warnings of drivers on a UART; others have none. */
function showDrivers(warnings) {
  byId("driver-row").hidden = !warnings;
  byId("drivers").textContent = warnings === "none" ? "no warning" : warnings ?? "";
}

function addEvent({ number, at, kind, text }) {
  if (number !== undefined) {
    if (number <= link.event) return;
    link.event = number;
  }
  const item = document.createElement("li");
  item.className = kind;
  item.textContent = `${new Date(at).toLocaleTimeString()}  ${text}`;
  const list = byId("events");
  list.prepend(item);
  while (list.children.length > EVENTS) list.lastChild.remove();
}

/** Says that the picture is old or shows no ball, or what became of a click into it. */
function showPictureNote() {
  const note = byId("picture-note");
  const age = performance.now() - link.framed;
  let text;
  if (!run.frame) text = "no picture yet";
  else if (run.ended) text = "last picture";
  else if (age > STALE) text = `no new picture for ${(age / 1e3).toFixed(0)} s`;
  else text = aim.told() || (run.frame.circle ? "" : "the ball is not seen");
  // A text that is set again would be read aloud again.
  if (note.textContent !== text) note.textContent = text;
}

function draw() {
  showPictureNote();
  const choice = controls.choice();
  const isTarget = run.goal !== null || run.board?.state === "following";
  picture.draw(isTarget, link.isLost ? { pixel: null, lines: null } : aim.look(choice));
  space.draw(history, run.goal, choice);
  drawCurves(byId("curves"), history, run.rig?.radius ?? 0, byId("whole").checked);
  requestAnimationFrame(draw);
}

controls.update(false, null, null);
draw();

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
  rig: null, commands: false, observation: null, telemetry: null, goal: null, stop: null,
  ended: null,
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
    const [before, frame] = [run.observation?.frame, message.observation?.frame];
    if (frame < before) beginAnew();
    if (frame !== before) link.framed = performance.now();
    history.add(message.samples);
    for (const key of ["observation", "telemetry", "goal", "stop", "ended"]) {
      run[key] = message[key];
    }
    message.events.forEach(addEvent);
    files.take(message.files);
    showState();
    showValues();
  },

  picture: (frame, bitmap) => picture.show(frame, bitmap),

  picked: (message) => aim.takePicked(message),

  projected: (message) => aim.takeProjected(message),

  problem(text) {
    addEvent({ at_ms: Date.now(), tone: "bad", text });
  },

  lost(reason) {
    link.isLost = true;
    run.telemetry = null;
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
  const { telemetry, goal, ended } = run;
  const state = ended ? "ended" : link.isLost ? "unknown" : (telemetry?.state ?? "unknown");
  byId("state").textContent = state;
  byId("state").className = `badge ${state}`;
  byId("fault").hidden = link.isLost || !telemetry?.fault;
  byId("fault-text").textContent = telemetry?.fault ?? "";
  byId("fault-next").textContent = telemetry?.advice ?? "";
  // A fault is named below.
  const ending = telemetry?.fault ? "not reached" : goal?.ending;
  const place = goal?.target_m.map((value) => value.toFixed(3)).join(", ");
  byId("goal").classList.toggle("reached", goal?.reached ?? false);
  byId("goal").textContent = !goal
    ? "no target"
    : `target (${place}) m${goal.reached ? " reached" : ending ? `: ${ending}` : ""}`;
  const isLive = !link.isLost && !ended;
  showStop(isLive ? run.stop : null);
  controls.update(isLive && run.commands, telemetry, run.stop);
}

/** Says who has stopped the rig, and when; `stop` is null where no Stop is in force. */
function showStop(stop) {
  byId("stopped").hidden = !stop;
  if (!stop) return;
  const time = new Date(stop.since_ms).toLocaleTimeString();
  const refused = stop.refused > 0 ? ` Refused since then: ${stop.refused}.` : "";
  byId("stopped-text").textContent = `By ${stop.by} at ${time} (command ${stop.number}).${refused}`;
}

function showValues() {
  const { telemetry, observation } = run;
  const known = (value, text) => (value === null || value === undefined ? "unknown" : text(value));
  const numbers = (digits) => (list) =>
    list.map((value) => value.toFixed(digits).padStart(digits + 4)).join(" ");
  const millimetres = (metres) => (1e3 * metres).toFixed(1);
  const last = history.samples.at(-1);
  const position = observation?.position_m;
  byId("ball").textContent = position ? numbers(3)(position) : "not seen";
  byId("error").textContent = known(last?.error_m, millimetres);
  byId("filtered").textContent = known(telemetry?.filtered_error_m, millimetres);
  byId("pace").textContent = typeof observation?.path_pace === "number"
    ? (100 * observation.path_pace).toFixed(0) : "no path";
  byId("rates").textContent = known(telemetry?.rates_steps_s, numbers(1));
  byId("motors").textContent = known(telemetry?.motors_steps, numbers(1));
  showTensions(telemetry);
  showDrivers(telemetry?.driver_warnings);
  byId("number").textContent = known(observation, ({ frame, time_s: time }) =>
    `${frame} at ${time.toFixed(1)} s`);
  byId("rate").textContent = known(history.rate(), (rate) => `${rate.toFixed(0)}/s`);
}

/** Shows the law's estimate of the tensions, over the ball's weight, with marks near slack. */
function showTensions(telemetry) {
  const tensions = telemetry?.tensions_weights;
  byId("tensions").hidden = !tensions;
  byId("no-tensions").hidden = !!tensions;
  if (!tensions) {
    const isDriven = ["seeking", "holding"].includes(telemetry?.state);
    byId("no-tensions").textContent = !telemetry
      ? "unknown"
      : run.rig.law !== "taut"
        ? "no estimate with this law"
        : isDriven ? "no estimate yet" : "no estimate without a target";
    return;
  }
  [...byId("tensions").children].forEach((bar, cable) => {
    const isNearSlack = telemetry.near_slack[cable];
    bar.className = isNearSlack ? "near-slack" : "";
    bar.querySelector("meter").value = tensions[cable];
    bar.querySelector("b").textContent =
      tensions[cable].toFixed(2) + (isNearSlack ? " near slack" : "");
  });
}

/** Shows the warnings of drivers on a UART; others have none. */
function showDrivers(warnings) {
  byId("driver-row").hidden = !warnings;
  byId("drivers").textContent = warnings ?? "";
}

function addEvent({ id, at_ms: at, tone, text }) {
  if (id !== undefined) {
    if (id <= link.event) return;
    link.event = id;
  }
  const item = document.createElement("li");
  item.className = tone;
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
  if (!run.observation) text = "no picture yet";
  else if (run.ended) text = "last picture";
  else if (age > STALE) text = `no new picture for ${(age / 1e3).toFixed(0)} s`;
  else text = aim.told() || (run.observation.u_px === null ? "the ball is not seen" : "");
  // A text that is set again would be read aloud again.
  if (note.textContent !== text) note.textContent = text;
}

function draw() {
  showPictureNote();
  const choice = controls.choice();
  const isTarget = run.goal !== null || run.telemetry?.state === "following";
  picture.draw(isTarget, link.isLost ? { pixel: null, lines: null } : aim.look(choice));
  space.draw(history, run.goal, choice);
  drawCurves(byId("curves"), history, run.rig?.radius ?? 0, byId("whole").checked);
  requestAnimationFrame(draw);
}

controls.update(false, null, null);
draw();

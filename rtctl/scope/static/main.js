// The page: sends the wanted view (`want`) to the server, and draws the frames that come back.

import { Commands, say } from "./commands.js";
import { Cursors } from "./cursors.js";
import { bindKeys } from "./keys.js";
import { Link } from "./link.js";
import { showMachine, showValues } from "./machine.js";
import { colour, css, Plots } from "./plots.js";
import { download, picture, table } from "./save.js";
import { bindTheme } from "./theme.js";
import { Traces } from "./traces.js";
import { TriggerPanel } from "./trigger.js";
import { withUnit } from "./units.js";

const $ = (id) => document.getElementById(id);
const WINDOWS = [0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 60];
const KEPT_LAST = ["tick", "t", "period", "lateness", "state", "trip", "link_age", "order"]; // seldom of interest: at the end of the list
const MEASURED = ["capstan", "position", "x", "feedback"];

const want = { kind: "time", signals: [], x: "", window: 5, columns: 1000, hold: false, span: null, trigger: { mode: "off", signal: "", level: 0, edge: "rising", pre: 0.2, armed: 0 } };
const signals = new Map(); // name -> { unit, help, slot }
const traces = new Traces();
let hello = null, status = null, connected = false, stale = false;

const plots = new Plots($("plots"), { zoom, unzoom, draw });
const cursors = new Cursors($("readout"), () => { mark(); stale = true; });
const trigger = new TriggerPanel(want.trigger, { changed: ask, middle: middleOf });
const commands = new Commands(() => link);
const link = new Link({
  opened() { connected = true; },
  closed() { connected = false; refresh(); },
  hello: greet,
  status(message) { status = message; refresh(); },
  frame(about, arrays) {
    if (want.hold && about.kind === "roll") return; // sent before the server knew of the hold
    traces.take(about, arrays);
    stale = true;
  },
  drawn() { if (stale) show(); },
  refused(words) { say(words, true); },
});

// Take the signals, settings and rate of a daemon.
function greet(message) {
  const other = !hello || hello.name !== message.name;
  const again = hello && hello.run !== message.run && hello.run > 0;
  hello = message;
  document.title = `${message.name} - rtctl scope`;
  $("name").textContent = message.name;
  if (message.signals.length) {
    const names = message.signals.map((s) => s.name);
    if (other) remembered(names);
    want.signals = want.signals.filter((name) => names.includes(name));
    if (!want.signals.length) want.signals = usual(names);
    if (!names.includes(want.x)) want.x = names.find((name) => MEASURED.includes(name)) ?? names[0];
    if (!names.includes(want.trigger.signal)) want.trigger.signal = want.signals[0];
    learn(message.signals);
    windows();
    trigger.choices(names, signals);
    commands.hello(message);
    if (again) { want.hold = false; want.span = null; cursors.clear(); say("the daemon has started again"); }
    if (message.run > 0) ask();
  }
  refresh();
}

function remembered(names) {
  try {
    const kept = JSON.parse(localStorage.getItem(`scope ${hello.name}`)) ?? {};
    for (const key of ["kind", "signals", "x", "window"]) if (key in kept) want[key] = kept[key];
    Object.assign(want.trigger, kept.trigger ?? {}, { armed: 0 });
    if (!names.includes(want.trigger.signal)) want.trigger.mode = "off";
  } catch { /* ignore an unreadable entry */ }
}

function usual(names) {
  const shown = ["ref", ...MEASURED, "capstan_error", "position_error", "u", "u1", "u2"];
  const found = shown.filter((name) => names.includes(name));
  return found.length ? found : names.slice(0, 3);
}

function learn(all) {
  const last = (s) => Number(KEPT_LAST.includes(s.name));
  const list = [...all].sort((a, b) => last(a) - last(b));
  signals.clear();
  list.forEach((s) => signals.set(s.name, { unit: s.unit, help: s.help, slot: 0 }));
  slots();
  const box = (s) => {
    const label = document.createElement("label");
    label.title = s.help;
    const tick = Object.assign(document.createElement("input"), { type: "checkbox", checked: want.signals.includes(s.name) });
    tick.onchange = () => {
      want.signals = list.map((t) => t.name).filter((name) => (name === s.name ? tick.checked : want.signals.includes(name)));
      slots();
      ask();
    };
    const value = document.createElement("output");
    value.dataset.name = s.name;
    label.append(tick, document.createElement("i"), s.name, value, Object.assign(document.createElement("span"), { className: "unit", textContent: s.unit }));
    const item = document.createElement("li");
    item.append(label);
    return item;
  };
  $("signals").replaceChildren(...list.map(box));
  $("x").replaceChildren(...list.map((s) => new Option(`${s.name} [${s.unit || "-"}]`, s.name, false, s.name === want.x)));
  swatches();
}

// Assign a colour to each shown signal.
function slots() {
  want.signals.forEach((name, i) => { signals.get(name).slot = i; });
  swatches();
}

function swatches() {
  for (const value of document.querySelectorAll("#signals output")) {
    const shown = want.signals.includes(value.dataset.name);
    value.parentElement.querySelector("i").style.background = shown ? colour(signals.get(value.dataset.name).slot) : "none";
  }
}

function windows() {
  const longest = 0.9 * hello.history || 20, shortest = 20 / hello.rate;
  const list = WINDOWS.filter((w) => w >= shortest && w <= longest);
  if (!list.includes(want.window)) want.window = list.includes(5) ? 5 : list[list.length - 1];
  $("window").replaceChildren(...list.map((w) => new Option(withUnit(w, "s"), w, false, w === want.window)));
}

// Send the wanted view to the server.
function ask() {
  want.columns = Math.max(200, Math.min(4000, Math.round(($("plots").clientWidth || 1000) - 80)));
  mark();
  if (!hello) return;
  link.send({ op: "view", view: want });
  const { kind, signals: names, x, window: seconds, trigger: t } = want;
  localStorage.setItem(`scope ${hello.name}`, JSON.stringify({ kind, signals: names, x, window: seconds, trigger: t }));
}

// Set the buttons to the wanted view.
function mark() {
  for (const button of document.querySelectorAll("[data-kind]")) button.setAttribute("aria-pressed", button.dataset.kind === want.kind);
  $("hold").setAttribute("aria-pressed", want.hold);
  $("hold").textContent = want.hold ? "Held" : "Hold";
  $("unzoom").disabled = !want.span;
  $("over").hidden = want.kind !== "xy";
  $("cursorA").setAttribute("aria-pressed", cursors.at.A !== null);
  $("cursorB").setAttribute("aria-pressed", cursors.at.B !== null);
  trigger.mark();
}

function show() {
  stale = false;
  plots.show(traces, signals);
  cursors.tell(traces, signals);
  $("note").textContent = note();
  trigger.tell(traces.about, want.hold);
}

function note() {
  const { about, kind } = traces;
  if (kind === "xy") return about.step > 1 ? `every ${about.step}th row` : "every row";
  if (kind === "spectrum") return `${about.rows} rows`;
  return traces.bucket > 1 ? `lowest and highest of each ${traces.bucket} rows` : "every row";
}

function refresh() {
  showMachine(hello, status, connected);
  if (status?.alive) {
    commands.status(status.status);
    showValues(status.status, signals);
  }
}

function draw(plot, lane) {
  const first = lane === plots.lanes[0];
  if (traces.kind !== "xy") cursors.draw(plot, first);
  if (traces.kind === "time" && want.trigger.mode !== "off" && lane.names.includes(want.trigger.signal)) levelLine(plot);
}

// Draw the trigger: a dotted line at its level, and a mark at the crossing.
function levelLine(plot) {
  const { ctx, bbox } = plot;
  const y = plot.valToPos(want.trigger.level, "y", true);
  ctx.save();
  ctx.strokeStyle = ctx.fillStyle = css("--warn");
  ctx.lineWidth = devicePixelRatio;
  ctx.setLineDash([2 * devicePixelRatio, 4 * devicePixelRatio]);
  if (y >= bbox.top && y <= bbox.top + bbox.height) {
    ctx.beginPath();
    ctx.moveTo(bbox.left, y);
    ctx.lineTo(bbox.left + bbox.width, y);
    ctx.stroke();
  }
  const x = plot.valToPos(0, "x", true), size = 5 * devicePixelRatio;
  if (traces.about.sweep && x >= bbox.left && x <= bbox.left + bbox.width) {
    ctx.beginPath();
    ctx.moveTo(x - size, bbox.top);
    ctx.lineTo(x + size, bbox.top);
    ctx.lineTo(x, bbox.top + 1.6 * size);
    ctx.fill();
  }
  ctx.restore();
}

function middleOf(name) {
  const i = traces.names.indexOf(name);
  if (i < 0 || traces.kind !== "time") return null;
  const low = Math.min(...traces.low[i].filter((v) => v !== null)), high = Math.max(...traces.high[i].filter((v) => v !== null));
  return isFinite(low + high) ? (low + high) / 2 : null;
}

function hold(held) {
  if (want.hold === held) return;
  want.hold = held;
  want.span = null;
  if (!held) cursors.clear();
  ask();
}

function zoom(from, to) {
  if (want.kind !== "time" || !(to > from)) return;
  want.hold = true;
  want.span = [from, to];
  ask();
}

function unzoom() {
  if (!want.span) return;
  want.span = null;
  ask();
}

function scaled(factor) {
  const [from, to] = want.span ?? traces.range;
  const at = cursors.at[cursors.last] ?? (from + to) / 2;
  zoom(at - (at - from) * factor, at + (to - at) * factor);
}

function moved(share) {
  if (!want.span) return;
  const step = share * (want.span[1] - want.span[0]);
  zoom(want.span[0] + step, want.span[1] + step);
}

// Set a cursor at the mouse, or at one or two thirds of the axis; remove it if it is set. A rolling picture is held.
function cursor(which) {
  if (want.kind === "xy") return say("cursors are for time and spectrum", true);
  if (cursors.at[which] !== null) return cursors.set(which, null), show();
  if (want.kind === "time" && traces.rolling) hold(true);
  const [from, to] = traces.range;
  const third = want.kind === "spectrum" ? Math.sqrt(from * to) : from + ((which === "A" ? 1 : 2) * (to - from)) / 3;
  const i = traces.nearest(plots.pointer() ?? third);
  if (i >= 0) cursors.set(which, traces.x[i]);
  show();
}

// Save the shown picture or numbers to a file, named by machine, kind and time.
function save(ending) {
  if (!traces.x.length) return say("nothing is shown yet", true);
  const stamp = new Date().toISOString().slice(0, 19).replaceAll(":", "");
  const name = `${hello.name}-${traces.kind}-${stamp}.${ending}`;
  if (ending === "csv") download(new Blob([table(traces, signals)], { type: "text/csv" }), name);
  else picture(plots.lanes, `${hello.name}, ${new Date().toLocaleString()}, ${note()}`).toBlob((blob) => download(blob, name));
  say(`saved as ${name}`);
}

function kind(name) {
  if (want.kind === name) return;
  want.kind = name;
  want.span = null;
  cursors.clear();
  ask();
}

function longer(step) {
  const list = [...$("window").options].map((option) => Number(option.value));
  const next = list[list.indexOf(want.window) + step];
  if (next === undefined) return;
  $("window").value = want.window = next;
  want.hold = false;
  want.span = null;
  ask();
}

window.scope = { want, traces, plots }; // for the console
for (const button of document.querySelectorAll("[data-kind]")) button.onclick = () => kind(button.dataset.kind);
$("hold").onclick = () => hold(!want.hold);
$("unzoom").onclick = unzoom;
$("window").onchange = () => { want.window = Number($("window").value); want.hold = false; want.span = null; ask(); };
$("x").onchange = () => { want.x = $("x").value; ask(); };
$("cursorA").onclick = () => cursor("A");
$("cursorB").onclick = () => cursor("B");
$("cursor0").onclick = () => { cursors.clear(); show(); };
$("csv").onclick = () => save("csv");
$("png").onclick = () => save("png");
$("keys").onclick = () => $("help").showModal();
bindTheme($("theme"), () => { plots.rebuild(); swatches(); show(); });
bindKeys({
  " ": () => hold(!want.hold), "[": () => longer(-1), "]": () => longer(1), 1: () => kind("time"), 2: () => kind("xy"), 3: () => kind("spectrum"),
  a: () => cursor("A"), b: () => cursor("B"), c: () => { cursors.clear(); show(); }, t: () => trigger.arm(),
  "+": () => scaled(0.5), "-": () => scaled(2), ",": () => moved(-0.25), ".": () => moved(0.25), Escape: unzoom, "?": () => $("help").showModal(),
  D: () => { if (hello?.control) commands.ask("disarm", {}, "Disarm"); },
  ArrowLeft: (event) => cursors.move(event.shiftKey ? -10 : -1, traces) && show(),
  ArrowRight: (event) => cursors.move(event.shiftKey ? 10 : 1, traces) && show(),
});
if (location.search) history.replaceState(null, "", location.pathname); // the token is kept in a cookie
let resizing = 0;
new ResizeObserver(() => { clearTimeout(resizing); resizing = setTimeout(ask, 200); }).observe($("plots"));
mark();
refresh();

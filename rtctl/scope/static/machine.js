// State of the machine: lamps, banner, counts, the lateness histogram, and the values of its signals.

import { withUnit } from "./units.js";

const $ = (id) => document.getElementById(id);
const FRESH = 3000; // ms for which a lamp shows an event
const FIRST_EDGE = 0.25; // us, upper edge of the first bar; each next edge is twice as high

export function showMachine(hello, message, connected) {
  const status = message?.status ?? {};
  const alive = connected && message?.alive;
  lamps(hello, status, message, connected, alive);
  banner(status, connected, alive, message?.there);
  if (alive) {
    counts(status, message);
    histogram(message.lateness);
  }
}

const before = new Map(); // name -> last count, and time of its last increase

// Whether a count has risen within the last FRESH ms.
function rises(name, count) {
  const known = before.get(name);
  if (!known || count < known.count) before.set(name, { count, at: -Infinity });
  else if (count > known.count) before.set(name, { count, at: performance.now() });
  return performance.now() - before.get(name).at < FRESH;
}

function lamps(hello, status, message, connected, alive) {
  const rows = status.rows ?? {};
  const missing = (rows.lost ?? 0) + (rows.lost_in_ring ?? 0);
  const silent = (status.signals?.link_age ?? 0) / (status.rate_hz || 1); // s
  const timeout = hello?.settings.find((row) => row.path === "safety.link_timeout")?.value ?? Infinity;
  const state = alive ? status.state : "gone";
  const list = [
    [{ running: "good", armed: "warn", tripped: "bad", gone: "bad" }[state] ?? "off", "state", state],
    [!alive ? "off" : status.trip?.code === "link_lost" ? "bad" : silent > 0.25 * timeout ? "warn" : "good", "link", alive ? status.link : "-"],
    [!alive ? "off" : rises("missed", status.missed) ? "warn" : "good", "ticks", alive ? `${status.missed} missed` : "-"],
    [!alive ? "off" : rows.error || missing ? "bad" : "recorded" in rows ? "good" : "off", "recording",
      !alive ? "-" : rows.error ? "failed" : missing ? `${missing} rows lost` : "recorded" in rows ? "on" : "off"],
    ...(status.model ? [modelLamp(status.model, alive)] : []),
    [!connected ? "bad" : rises("dropped", message?.dropped ?? 0) ? "warn" : "good", "page", connected ? `${message?.dropped ?? 0} frames dropped` : "no server"],
  ];
  const text = JSON.stringify(list);
  if ($("lamps").dataset.shown === text) return;
  $("lamps").dataset.shown = text;
  $("lamps").replaceChildren(...list.map(([level, name, words]) => {
    const item = Object.assign(document.createElement("li"), { className: level });
    item.append(document.createElement("i"), `${name} `, Object.assign(document.createElement("b"), { textContent: words }));
    item.id = `lamp-${name}`;
    return item;
  }));
}

// Lamp of the model in `rtctl watch`.
function modelLamp(model, alive) {
  if (!alive) return ["off", "model", "-"];
  if (model.alarm) return ["bad", "model", "departs"];
  if (model.silent) return ["warn", "model", "silent"];
  const words = { waiting: "waits for motion", learning: `learns, ${Math.round(100 * model.learned)} %`, watching: "holds", astray: "diverges" };
  return [{ watching: "good", learning: "off", waiting: "off", astray: "warn" }[model.state] ?? "off", "model", words[model.state] ?? model.state];
}

function banner(status, connected, alive, there) {
  const place = $("banner");
  const faults = (status.faults ?? []).map((fault) => fault.fault ?? String(fault));
  let text = "", warn = true;
  const trip = status.trip ? `Tripped at tick ${status.trip.tick}, ${status.trip.code}: ${status.trip.why}.` : "";
  const alarm = status.model?.alarm;
  if (!connected) text = "The scope's server does not answer; trying again.";
  else if (!alive && there) text = "The daemon does not answer. It is starting, which may take a minute, or it hangs. Waiting for it.";
  else if (!alive) text = "The daemon does not answer: it does not run. Waiting for it; the page shows its last values." + (trip ? ` ${trip}` : "");
  else if (trip && status.state === "tripped") { text = trip; warn = false; }
  else if (alarm) text = `The machine departs from its model since ${alarm.t.toFixed(0)} s: ${alarm.words}.${alarm.diagnosis ? ` Diagnosis: ${alarm.diagnosis}` : ""}${alarm.page ? ` Page: ${alarm.page}` : ""}`;
  else if (faults.length) text = `Faults are injected on purpose: ${faults.join(", ")}.`;
  place.hidden = !text;
  place.className = warn ? "warn" : "";
  if (place.textContent !== text) place.textContent = text;
}

function counts(status, message) {
  const late = status.lateness_us ?? {};
  const rows = [
    ["ticks", `${status.ticks} at ${status.rate_hz} Hz, ${status.mode}`],
    ["missed", `${status.missed}, ${status.late} late, ${status.overruns} overruns`],
    ["lateness", `p50 ${late.p50?.toFixed(1)}, p99.9 ${late.p999?.toFixed(1)}, max ${late.max?.toFixed(0)} us`],
    ["tick takes", `p50 ${status.tick_us?.p50?.toFixed(1)}, max ${status.tick_us?.max?.toFixed(0)} us`],
    ["to this page", `${message.lost} rows lost, ${message.dropped} frames dropped`],
    ["viewers", String(message.viewers)],
    ...(status.lacks ?? []).map((lack) => ["lacks", lack]),
  ];
  $("counts").replaceChildren(...rows.flatMap(([name, text]) => [
    Object.assign(document.createElement("dt"), { textContent: name }), Object.assign(document.createElement("dd"), { textContent: text }),
  ]));
}

function histogram(bins) {
  const place = $("histogram");
  const most = Math.max(...bins, 1);
  while (place.children.length < bins.length) {
    const bar = document.createElement("div");
    const edge = FIRST_EDGE * 2 ** (place.children.length - 1);
    if (place.children.length % 4 === 3) bar.append(Object.assign(document.createElement("span"), { textContent: String(edge) }));
    place.append(bar);
  }
  const total = bins.reduce((a, b) => a + b, 0);
  bins.forEach((count, i) => {
    const bar = place.children[i];
    bar.style.height = count ? `${4 + (96 * Math.log10(1 + count)) / Math.log10(1 + most)}%` : "0";
    const low = i ? FIRST_EDGE * 2 ** (i - 1) : 0;
    bar.title = `${count} ticks from ${low} us${i < bins.length - 1 ? ` to ${FIRST_EDGE * 2 ** i} us` : " on"}`;
  });
  place.setAttribute("aria-label", `lateness of ${total} ticks, most often below ${FIRST_EDGE * 2 ** bins.indexOf(most)} us`);
}

export function showValues(status, units) {
  for (const item of document.querySelectorAll("#signals output")) {
    const [value, unit] = withUnit(status.signals?.[item.dataset.name], units.get(item.dataset.name)?.unit ?? "").split(" ");
    item.textContent = value;
    item.nextElementSibling.textContent = unit ?? "";
  }
}

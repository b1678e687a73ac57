// Commands of the page to the machine: switches, setpoint, settings. Without --control the server refuses them.

import { typed, withUnit } from "./units.js";

const $ = (id) => document.getElementById(id);
// Show a message in the line at the bottom, until the next message.
export function say(text, bad = false) {
  const time = new Date().toLocaleTimeString([], { hour12: false });
  Object.assign($("said"), { textContent: `${time}  ${text}`, className: bad ? "bad" : "" });
}

export class Commands {
  constructor(link) {
    this.link = link;
    this.unit = "";
    this.target = 0;
    for (const button of document.querySelectorAll("#switches button")) button.onclick = () => this.ask(button.dataset.op, {}, button.textContent);
    $("setpoint").querySelector("form").onsubmit = (event) => { event.preventDefault(); this.go(); };
    $("setpoint-up").onclick = () => this.step(1);
    $("setpoint-down").onclick = () => this.step(-1);
    $("setpoint-unit").onchange = () => this.rate();
    $("settings-filter").oninput = () => this.filter();
  }

  async ask(op, args, words) {
    try {
      const result = await this.link().call(op, args);
      say(`${words}: from tick ${result.tick + 1} on`);
      return true;
    } catch (error) {
      say(`${words}: ${error.message}`, true);
      return false;
    }
  }

  hello(hello) {
    const { control } = hello;
    $("switches").hidden = !control;
    $("access").textContent = control ? "with control" : "read-only";
    for (const input of document.querySelectorAll("#setpoint input, #setpoint select, #setpoint button")) input.disabled = !control;
    const unit = hello.signals.find((s) => s.name === "target" || s.name === "ref")?.unit ?? this.unit;
    if (unit !== this.unit) {
      this.unit = unit;
      const units = unit === "rad" ? ["rad", "mrad", "deg", "mm"] : ["mm", "um", "m", "rad"];
      $("setpoint-unit").replaceChildren(...units.map((u) => new Option(u, u)));
      this.rate();
    }
    this.settings(hello.settings, control);
  }

  rate() {
    $("setpoint-rate").textContent = `${$("setpoint-unit").value}/s`;
    $("setpoint-step-unit").textContent = $("setpoint-unit").value;
  }

  status(status) {
    const s = status.signals ?? {};
    const where = s.capstan ?? s.position ?? s.x ?? s.feedback;
    this.target = s.target ?? s.ref ?? 0;
    $("setpoint-now").textContent = `target ${withUnit(this.target, this.unit)}, machine at ${withUnit(where, this.unit)}`;
  }

  number(id) {
    const value = typed($(id).value);
    $(id).setAttribute("aria-invalid", value === null);
    if (value === null) say(`'${$(id).value}' is not a number`, true);
    return value;
  }

  async go() {
    const value = this.number("setpoint-value");
    const args = { value, unit: $("setpoint-unit").value };
    if ($("setpoint-ramp").value.trim()) {
      args.ramp = this.number("setpoint-ramp");
      args.ramp_unit = `${args.unit}/s`;
    }
    if (value === null || args.ramp === null) return;
    await this.ask("setpoint", args, `setpoint ${value} ${args.unit}`);
  }

  // A step from the target, in the chosen unit, which must be of the same kind as the target's unit.
  async step(sign) {
    const size = this.number("setpoint-step");
    if (size === null) return;
    const unit = $("setpoint-unit").value;
    const inOwn = { m: { m: 1, mm: 1e-3, um: 1e-6 }, rad: { rad: 1, mrad: 1e-3, deg: Math.PI / 180 } }[this.unit]?.[unit];
    if (inOwn === undefined) return say(`a step in ${unit} cannot be added to a target in ${this.unit}; choose another unit`, true);
    await this.ask("setpoint", { value: this.target + sign * size * inOwn }, `step by ${sign * size} ${unit}`);
  }

  // One row for each setting. A value is a number in SI, or a text with a unit such as 160 ms.
  settings(rows, control) {
    const text = JSON.stringify([rows, control]);
    if (text === this.shown) return;
    this.shown = text;
    const place = $("settings-rows");
    if (place.contains(document.activeElement) && document.activeElement.dataset.path) { // not while a person types in a field
      this.shown = "";
      place.onfocusout = () => setTimeout(() => this.settings(rows, control));
      return;
    }
    place.onfocusout = null;
    place.replaceChildren();
    let group = "";
    for (const row of rows) {
      const parts = row.path.split(".");
      const name = parts.pop();
      if (parts.join(".") !== group) {
        group = parts.join(".");
        place.append(Object.assign(document.createElement("h3"), { textContent: group }));
      }
      place.append(this.row(row, name, control));
    }
    this.filter();
  }

  row(row, name, control) {
    const label = document.createElement("label");
    label.title = row.help;
    label.dataset.path = row.path;
    const title = Object.assign(document.createElement("span"), { textContent: name });
    title.append(Object.assign(document.createElement("span"), { className: "bounds", textContent: row.bounds }));
    const input = document.createElement(row.type === "choice" ? "select" : "input");
    input.dataset.path = row.path;
    if (row.type === "choice") input.append(...row.choices.map((word) => new Option(word, word, false, word === row.value)));
    else if (row.type === "boolean") Object.assign(input, { type: "checkbox", checked: row.value });
    else Object.assign(input, { value: row.value ?? "", placeholder: "none", readOnly: !control });
    if (row.type === "choice" || row.type === "boolean") input.disabled = !control;
    input.onchange = () => this.set(row, input);
    input.onkeydown = (event) => {
      if (event.key === "Escape" && row.type !== "boolean") { input.value = row.value ?? ""; input.blur(); }
    };
    label.append(title, input, Object.assign(document.createElement("span"), { className: "unit", textContent: row.unit }));
    return label;
  }

  async set(row, input) {
    const value = row.type === "boolean" ? input.checked : row.type === "choice" ? input.value : input.value.trim() === "" ? null : typed(input.value) ?? input.value.trim();
    const done = await this.ask("set", { path: row.path, value }, `${row.path} ${value ?? "none"}`);
    input.setAttribute("aria-invalid", !done);
    if (!done && row.type === "boolean") input.checked = row.value;
    else if (!done && row.type === "choice") input.value = row.value;
    else if (done && typeof value !== "string") row.value = value;
  }

  filter() {
    const wanted = $("settings-filter").value.trim().toLowerCase();
    for (const label of document.querySelectorAll("#settings-rows label")) label.hidden = !`${label.dataset.path} ${label.title}`.toLowerCase().includes(wanted);
    for (const title of document.querySelectorAll("#settings-rows h3")) {
      let next = title.nextElementSibling;
      while (next?.tagName === "LABEL" && next.hidden) next = next.nextElementSibling;
      title.hidden = next?.tagName !== "LABEL";
    }
  }
}

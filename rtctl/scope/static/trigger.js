// The trigger panel; the server searches every row for the crossing.

import { typed } from "./units.js";

const $ = (id) => document.getElementById(id);

export class TriggerPanel {
  // `want` is the trigger part of the view, changed in place; `on` has changed() and middle(signal).
  constructor(want, on) {
    this.want = want;
    this.on = on;
    $("trigger-mode").onchange = () => this.set("mode", $("trigger-mode").value);
    $("trigger-signal").onchange = () => { this.set("signal", $("trigger-signal").value); this.middle(); };
    $("trigger-edge").onchange = () => this.set("edge", $("trigger-edge").value);
    $("trigger-level").onchange = () => {
      const level = typed($("trigger-level").value);
      $("trigger-level").setAttribute("aria-invalid", level === null);
      if (level !== null) this.set("level", level);
    };
    $("trigger-pre").onchange = () => this.set("pre", Math.min(100, Math.max(0, Number($("trigger-pre").value) || 0)) / 100);
    $("trigger-mid").onclick = () => this.middle();
    $("trigger-arm").onclick = () => this.arm();
  }

  set(key, value) {
    this.want[key] = value;
    this.want.armed += 1;
    this.on.changed();
  }

  middle() {
    const level = this.on.middle(this.want.signal);
    if (level !== null) this.set("level", Number(level.toPrecision(4)));
  }

  arm() {
    if (this.want.mode === "off") this.want.mode = "single";
    this.set("armed", this.want.armed);
  }

  choices(names, signals) {
    this.signals = signals;
    $("trigger-signal").replaceChildren(...names.map((name) => new Option(name, name, false, name === this.want.signal)));
  }

  // Show the wanted trigger in the form.
  mark() {
    const { mode, signal, edge, level, pre } = this.want;
    $("trigger-mode").value = mode;
    $("trigger-signal").value = signal;
    $("trigger-edge").value = edge;
    if (document.activeElement !== $("trigger-level")) $("trigger-level").value = Number(level.toPrecision(6));
    if (document.activeElement !== $("trigger-pre")) $("trigger-pre").value = Math.round(100 * pre);
    $("trigger-unit").textContent = this.signals?.get(signal)?.unit ?? "";
    if (mode === "off") $("trigger-state").textContent = "";
  }

  tell(about, held) {
    const { mode } = this.want;
    if (mode === "off") return;
    $("trigger-state").textContent = held ? "held" : about.done ? "one sweep caught; Catch takes the next"
      : about.sweep ? `${about.sweeps} sweep${about.sweeps === 1 ? "" : "s"}` : mode === "auto" ? "no crossing: rolls" : "waits for a crossing";
  }
}

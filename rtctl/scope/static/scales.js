// The scale of each lane: automatic, or fixed between two numbers, which the browser stores.

import { short, typed } from "./units.js";

const KEPT = "scope scales";

export class Scales {
  // `changed()` is called when a scale was set.
  constructor(changed) {
    this.changed = changed;
    try {
      this.fixed = new Map(JSON.parse(localStorage.getItem(KEPT)) ?? []);
    } catch {
      this.fixed = new Map(); // ignore an unreadable entry
    }
  }

  // The fixed range of a lane in its unit, or null.
  of(lane) {
    return this.fixed.get(lane.key) ?? null;
  }

  // A button that fixes the current scale of a lane, and two fields for its ends.
  controls(lane) {
    const place = Object.assign(document.createElement("span"), { className: "scale" });
    const button = Object.assign(document.createElement("button"), { type: "button", title: "fix the current scale of this lane, or scale automatically" });
    lane.lock = button;
    lane.ends = [0, 1].map((i) => {
      const field = Object.assign(document.createElement("input"), { inputMode: "decimal", title: `${i ? "upper" : "lower"} end of the scale` });
      field.setAttribute("aria-label", field.title);
      field.onchange = () => this.end(lane, i, typed(field.value));
      return field;
    });
    button.onclick = () => {
      if (!this.fixed.delete(lane.key)) this.fixed.set(lane.key, [...lane.yRange]);
      this.keep();
    };
    place.append(button, lane.ends[0], lane.ends[1]);
    return place;
  }

  end(lane, i, value) {
    const range = [...(this.fixed.get(lane.key) ?? lane.yRange)];
    if (value !== null) range[i] = value * lane.scale.factor;
    const right = value !== null && range[1] > range[0];
    lane.ends[i].setAttribute("aria-invalid", !right);
    if (!right) return;
    this.fixed.set(lane.key, range);
    this.keep();
  }

  keep() {
    localStorage.setItem(KEPT, JSON.stringify([...this.fixed]));
    this.changed();
  }

  // Show the scale of a lane; a field with the focus stays unchanged.
  tell(lane) {
    const fixed = this.fixed.has(lane.key);
    lane.lock.setAttribute("aria-pressed", fixed);
    const words = fixed ? "scale fixed" : "scale auto";
    if (lane.lock.textContent !== words) lane.lock.textContent = words;
    lane.ends.forEach((field, i) => {
      field.hidden = !fixed;
      if (!fixed || document.activeElement === field || field.getAttribute("aria-invalid") === "true") return;
      field.value = String(Number(short(lane.yRange[i] / lane.scale.factor, 4)));
    });
  }
}

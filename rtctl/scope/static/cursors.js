// Two cursors A and B on the common axis, and a table of the signals' values at them.

import { css } from "./plots.js";
import { prefixed, short, withUnit } from "./units.js";

export class Cursors {
  // `changed()` is called when a cursor was set or moved.
  constructor(section, changed) {
    this.section = section;
    this.changed = changed;
    this.at = { A: null, B: null };
    this.last = "A";
  }

  set(which, x) {
    this.at[which] = x;
    if (x !== null) this.last = which;
    this.changed();
  }

  clear() {
    this.at = { A: null, B: null };
    this.changed();
  }

  // Move the cursor last set by a number of columns. Returns whether one was set.
  move(columns, traces) {
    const x = this.at[this.last];
    if (x === null || !traces.x.length) return false;
    const i = Math.min(traces.x.length - 1, Math.max(0, traces.nearest(x) + columns));
    this.set(this.last, traces.x[i]);
    return true;
  }

  draw(plot, first) {
    const { ctx, bbox } = plot;
    for (const [name, x] of Object.entries(this.at)) {
      if (x === null || x < plot.scales.x.min || x > plot.scales.x.max) continue;
      const left = Math.round(plot.valToPos(x, "x", true));
      ctx.save();
      ctx.strokeStyle = ctx.fillStyle = css("--text");
      ctx.lineWidth = devicePixelRatio;
      ctx.setLineDash(name === "A" ? [] : [5 * devicePixelRatio, 3 * devicePixelRatio]);
      ctx.beginPath();
      ctx.moveTo(left, bbox.top);
      ctx.lineTo(left, bbox.top + bbox.height);
      ctx.stroke();
      if (first) {
        ctx.font = `${11 * devicePixelRatio}px system-ui, sans-serif`;
        ctx.fillText(name, left + 4 * devicePixelRatio, bbox.top + bbox.height - 5 * devicePixelRatio);
      }
      ctx.restore();
    }
  }

  // The table; `signals` maps a name to its unit and slot.
  tell(traces, signals) {
    const { A, B } = this.at;
    const none = (A === null && B === null) || traces.kind === "xy";
    this.section.hidden = none;
    if (none) return;
    const unit = traces.kind === "spectrum" ? "Hz" : "s";
    const places = { A, B };
    const decimals = Math.max(0, Math.min(9, 4 - Math.floor(Math.log10((traces.range[1] - traces.range[0]) || 1))));
    const both = A !== null && B !== null;
    const rows = [["", "A", "B", "B - A"]];
    rows.push([unit === "s" ? "t [s]" : "f [Hz]", ...["A", "B"].map((n) => (places[n] === null ? "" : places[n].toFixed(decimals))), both ? withUnit(B - A, unit) : ""]);
    if (both && unit === "s" && A !== B) rows.push(["1/t", "", "", withUnit(1 / Math.abs(B - A), "Hz")]);
    traces.names.forEach((name, i) => {
      const values = { A: null, B: null };
      const scale = prefixed(signals.get(name)?.unit ?? "", Math.max(...traces.high[i].map((v) => Math.abs(v ?? 0)), ...traces.low[i].map((v) => Math.abs(v ?? 0))));
      const texts = ["A", "B"].map((n) => {
        const k = places[n] === null ? -1 : traces.nearest(places[n]);
        if (k < 0) return "";
        const low = traces.low[i][k], high = traces.high[i][k];
        values[n] = low === null ? null : (low + high) / 2;
        const [from, to] = [short(low / scale.factor, 5), short(high / scale.factor, 5)];
        return from === to ? from : `${from}\n${to}`; // lowest and highest value of the column's rows
      });
      const difference = values.A !== null && values.B !== null ? short((values.B - values.A) / scale.factor, 5) : "";
      rows.push([`${name} [${scale.unit || "-"}]`, ...texts, difference]);
    });
    const cells = (row, tag) => {
      const tr = document.createElement("tr");
      tr.append(...row.map((text) => Object.assign(document.createElement(tag), { textContent: text })));
      return tr;
    };
    this.section.querySelector("thead").replaceChildren(cells(rows[0], "th"));
    this.section.querySelector("tbody").replaceChildren(...rows.slice(1).map((row) => cells(row, "td")));
  }
}

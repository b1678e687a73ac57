// The plots: one lane for each unit, one below the other, with a common axis. Errors have a separate lane.

import { Labels, spaceFor } from "./labels.js";
import { Scales } from "./scales.js";
import { prefixed } from "./units.js";

const uPlot = window.uPlot;
const AXIS = 78; // px, width of the y axes, so that the lanes are aligned
const DECADES = 6; // decades on the y axis of a spectrum

const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
export const colour = (slot) => css(`--c${slot % 8}`);

export class Plots {
  // `on` has zoom(from, to), unzoom(), and draw(plot, lane) for cursors and the trigger.
  constructor(place, on) {
    this.place = place;
    this.on = on;
    this.scales = new Scales(() => this.again());
    this.lanes = [];
    this.key = "";
    new ResizeObserver(() => this.resize()).observe(place);
  }

  // Draw `traces`; `signals` maps a name to its { unit, slot }.
  show(traces, signals) {
    this.traces = traces;
    const key = JSON.stringify([traces.kind, traces.xName, traces.names.map((n) => [n, signals.get(n)])]);
    if (key !== this.key) this.build(traces, signals, key);
    for (const lane of this.lanes) this.update(lane);
  }

  // Build the plots again at the next draw, after a change of the theme.
  rebuild() { this.key = ""; }

  // Draw again, after a change of a scale.
  again() { for (const lane of this.lanes) this.update(lane); }

  redraw() { for (const lane of this.lanes) lane.plot.redraw(false); }

  // Position of the mouse on the axis, or null.
  pointer() {
    for (const { plot } of this.lanes) if (plot.cursor.left >= 0) return plot.posToVal(plot.cursor.left, "x");
    return null;
  }

  build(traces, signals, key) {
    this.key = key;
    for (const lane of this.lanes) lane.plot.destroy();
    this.place.replaceChildren();
    this.lanes = grouped(traces.names, signals);
    if (!this.lanes.length) this.place.append(Object.assign(document.createElement("p"), { textContent: "choose signals to show" }));
    this.lanes.forEach((lane, i) => {
      lane.last = i === this.lanes.length - 1;
      lane.at = lane.names.map((name) => traces.names.indexOf(name));
      lane.xUnit = traces.kind === "time" ? "s" : traces.kind === "spectrum" ? "Hz" : signals.get(traces.xName)?.unit ?? "";
      lane.root = Object.assign(document.createElement("div"), { className: "lane" });
      lane.graph = Object.assign(document.createElement("div"), { className: "graph" });
      const legend = Object.assign(document.createElement("div"), { className: "legend" });
      for (const name of lane.names) {
        const item = Object.assign(document.createElement("span"), { title: signals.get(name).help ?? name });
        const line = document.createElement("i");
        line.style.background = colour(signals.get(name).slot);
        item.append(line, name);
        legend.append(item);
      }
      legend.append(this.scales.controls(lane));
      lane.root.append(lane.graph, legend);
      this.place.append(lane.root);
      lane.scale = { factor: 1, unit: lane.unit };
      lane.xScale = { factor: 1, unit: lane.xUnit };
      lane.labels = new Labels();
      const none = series(traces.kind, lane, traces).map(() => (traces.kind === "xy" ? [[], []] : []));
      lane.plot = new uPlot(this.options(lane, traces, signals), [traces.kind === "xy" ? null : [], ...none], lane.graph);
    });
    this.resize();
  }

  options(lane, traces, signals) {
    const kind = traces.kind;
    const axis = { stroke: () => css("--dim"), grid: { stroke: () => css("--grid"), width: 1 }, ticks: { stroke: () => css("--line"), width: 1, size: 4 }, font: "11px system-ui, sans-serif", labelFont: "11px system-ui, sans-serif" };
    const shown = series(kind, lane, traces);
    return {
      width: 300, height: 150, mode: kind === "xy" ? 2 : 1, legend: { show: false }, padding: [6, 10, lane.last ? 0 : 4, 0],
      scales: {
        x: { time: false, distr: kind === "spectrum" ? 3 : 1, range: () => lane.xRange ?? [0, 1] },
        y: { distr: kind === "spectrum" ? 3 : 1, range: () => lane.yRange ?? [0, 1] },
      },
      axes: [
        { ...axis, size: lane.last ? 22 : 4, gap: 3, labelSize: lane.last ? 16 : 0, labelGap: 0, label: lane.last ? () => this.xLabel(lane) : null,
          space: (plot, _axis, low, high, width) => spaceFor(low, high, width, lane.xScale.factor),
          values: (_, ticks) => (lane.last ? new Labels(Infinity).of(ticks, lane.xScale.factor) : ticks.map(() => "")) },
        { ...axis, size: AXIS - 16, labelSize: 16, labelGap: 0, label: () => this.yLabel(lane),
          values: (_, ticks) => lane.labels.of(ticks, lane.scale.factor) },
      ],
      series: [kind === "xy" ? null : {}, ...shown.map(({ name }) => {
        const stroke = colour(signals.get(name).slot);
        return kind === "xy"
          ? { stroke, paths: line, facets: [{ scale: "x", auto: false }, { scale: "y", auto: false }] }
          : { stroke, width: 1, points: { show: false }, spanGaps: false };
      })],
      bands: kind === "time" ? lane.names.map((name, i) => ({ series: [2 * i + 2, 2 * i + 1], fill: `${colour(signals.get(name).slot)}70` })) : [],
      cursor: {
        sync: { key: `lanes-${kind}`, setSeries: false, scales: ["x", null] }, points: { show: false }, y: true,
        drag: { x: kind !== "xy", y: false, setScale: false }, bind: { dblclick: () => () => { this.on.unzoom(); return null; } },
      },
      hooks: {
        draw: [(plot) => this.on.draw(plot, lane)],
        setSelect: [(plot) => {
          const { left, width } = plot.select;
          if (width > 3) this.on.zoom(plot.posToVal(left, "x"), plot.posToVal(left + width, "x"));
          plot.setSelect({ left: 0, width: 0, top: 0, height: 0 }, false);
        }],
      },
    };
  }

  // Label of the y axis, with the offset of the tick labels if they have one.
  yLabel(lane) {
    const { offset } = lane.labels;
    return `${lane.error ? "error " : ""}[${lane.scale.unit || "-"}]${offset ? ` ${offset < 0 ? "-" : "+"} ${Math.abs(offset)}` : ""}`;
  }

  xLabel(lane) {
    const { kind, xName, about } = this.traces;
    if (kind === "xy") return `${xName} [${lane.xScale.unit || "-"}]`;
    if (kind === "spectrum") return `frequency [${lane.xScale.unit}], amplitudes (Hann window)`;
    return `${about.sweep ? "t from the trigger" : "t of the controller"} [${lane.xScale.unit}]`;
  }

  // Set data and scales of one lane, with one redraw.
  update(lane) {
    const { traces } = this;
    const shown = series(traces.kind, lane, traces);
    const [low, high] = extent(lane.at.flatMap((i) => [traces.low[i], traces.high[i]]));
    const fixed = this.scales.of(lane);
    lane.scale = prefixed(lane.unit, Math.max(...(fixed ?? [low, high]).map(Math.abs)));
    if (traces.kind === "time") {
      lane.xRange = traces.range[1] > traces.range[0] ? traces.range : [0, 1];
      lane.yRange = fixed ?? padded(low, high);
      lane.xScale = traces.about.sweep ? prefixed("s", Math.max(...lane.xRange.map(Math.abs))) : { factor: 1, unit: "s" };
      lane.plot.setData([traces.x, ...shown.map((s) => s.values)], true);
    } else if (traces.kind === "spectrum") {
      lane.xRange = traces.x.length > 1 ? [traces.x[0], traces.x[traces.x.length - 1]] : [1, 10];
      const top = high > 0 ? 10 ** Math.ceil(Math.log10(high)) : 1;
      lane.yRange = [Math.max(10 ** Math.floor(Math.log10(Math.max(low, 1e-300))), top / 10 ** DECADES), top];
      if (lane.yRange[0] >= top) lane.yRange[0] = top / 10;
      if (fixed && fixed[0] > 0) lane.yRange = fixed;
      lane.plot.setData([traces.x, ...shown.map((s) => s.values.map((v) => (v > 0 ? v : null)))], true);
    } else {
      const [left, right] = extent([traces.x]);
      lane.xRange = padded(left, right);
      lane.yRange = fixed ?? padded(low, high);
      lane.xScale = prefixed(lane.xUnit, Math.max(Math.abs(left), Math.abs(right)));
      lane.plot.setData([null, ...shown.map((s) => [traces.x, s.values])], true);
    }
    this.scales.tell(lane);
  }

  resize() {
    for (const { plot, graph } of this.lanes) {
      const { clientWidth: width, clientHeight: height } = graph;
      if (width > 0 && height > 0 && (plot.width !== width || plot.height !== height)) plot.setSize({ width, height });
    }
  }
}

function grouped(names, signals) {
  const lanes = new Map();
  for (const name of names) {
    const unit = signals.get(name)?.unit;
    if (unit === undefined) continue;
    const error = name.endsWith("_error");
    const key = `${unit}|${error}`;
    if (!lanes.has(key)) lanes.set(key, { key, unit, error, names: [] });
    lanes.get(key).names.push(name);
  }
  return [...lanes.values()];
}

// Series of a lane for uPlot: over time the lower and upper edge of each signal, else one line.
function series(kind, lane, traces) {
  return lane.names.flatMap((name, n) => {
    const i = lane.at[n];
    return kind === "time" ? [{ name, values: traces.low[i] }, { name, values: traces.high[i] }] : [{ name, values: traces.high[i] }];
  });
}

function extent(lists) {
  let low = Infinity, high = -Infinity;
  for (const list of lists) for (const v of list ?? []) {
    if (v === null) continue;
    if (v < low) low = v;
    if (v > high) high = v;
  }
  return low <= high ? [low, high] : [0, 0];
}

function padded(low, high) {
  const room = 0.06 * (high - low) || 0.05 * Math.abs(high) || 1;
  return [low - room, high + room];
}

// Path of an XY plot: a line from point to point in order of time.
function line(plot, index) {
  uPlot.orient(plot, index, (serie, _dx, _dy, scaleX, scaleY, toX, toY, left, top, width, height) => {
    const [xs, ys] = plot.data[index];
    const path = new Path2D();
    let pen = false;
    for (let i = 0; i < xs.length; i++) {
      if (xs[i] === null || ys[i] === null) { pen = false; continue; }
      const x = toX(xs[i], scaleX, width, left), y = toY(ys[i], scaleY, height, top);
      if (pen) path.lineTo(x, y);
      else path.moveTo(x, y);
      pen = true;
    }
    plot.ctx.save();
    plot.ctx.beginPath();
    plot.ctx.rect(left, top, width, height);
    plot.ctx.clip();
    plot.ctx.strokeStyle = serie.stroke();
    plot.ctx.lineWidth = devicePixelRatio;
    plot.ctx.stroke(path);
    plot.ctx.restore();
  });
  return null;
}

export { css };

// Files of the shown plots: numbers as CSV, picture as PNG.

import { css } from "./plots.js";

const NAMES = 170; // px for the names beside the traces

// CSV text: the axis, then each signal; lowest and highest value where a column covers several rows.
export function table(traces, signals) {
  const head = (name, word = "") => quoted(`${name}${word} [${signals.get(name)?.unit || "-"}]`);
  const spread = traces.kind === "time" && traces.bucket > 1;
  const axis = { time: "t [s]", spectrum: "f [Hz]" }[traces.kind] ?? head(traces.xName);
  const lists = [traces.x], heads = [axis];
  traces.names.forEach((name, i) => {
    if (spread) {
      heads.push(head(name, " lowest"), head(name, " highest"));
      lists.push(traces.low[i], traces.high[i]);
    } else {
      heads.push(head(name));
      lists.push(traces.high[i]);
    }
  });
  const rows = Array.from(traces.x, (_, k) => lists.map((list) => number(list[k])).join(","));
  return [heads.join(","), ...rows, ""].join("\r\n");
}

// Canvas with all lanes, one below the other, and the names of their traces.
export function picture(lanes, title) {
  const ratio = devicePixelRatio, line = 16 * ratio;
  const canvases = lanes.map((lane) => lane.plot.ctx.canvas);
  const all = document.createElement("canvas");
  all.width = Math.max(...canvases.map((c) => c.width), 0) + NAMES * ratio;
  all.height = canvases.reduce((sum, c) => sum + c.height, 0) + 1.5 * line;
  const ctx = all.getContext("2d");
  ctx.fillStyle = css("--ground");
  ctx.fillRect(0, 0, all.width, all.height);
  ctx.font = `${12 * ratio}px system-ui, sans-serif`;
  ctx.fillStyle = css("--text");
  ctx.fillText(title, 8 * ratio, line);
  let top = 1.5 * line;
  lanes.forEach((lane, i) => {
    ctx.drawImage(canvases[i], 0, top);
    [...lane.root.querySelectorAll(".legend > span:not(.scale)")].forEach((item, k) => {
      const left = canvases[i].width + 6 * ratio, y = top + (k + 1) * line;
      ctx.fillStyle = getComputedStyle(item.querySelector("i")).backgroundColor;
      ctx.fillRect(left, y - 5 * ratio, 12 * ratio, 3 * ratio);
      ctx.fillStyle = css("--text");
      ctx.fillText(item.textContent, left + 18 * ratio, y);
    });
    top += canvases[i].height;
  });
  return all;
}

export function download(blob, name) {
  const link = Object.assign(document.createElement("a"), { href: URL.createObjectURL(blob), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60000);
}

// Number with 12 digits: further ones are rounding errors.
const number = (value) => (value === null || value === undefined ? "" : String(Number(value.toPrecision(12))));

const quoted = (text) => (/[",]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text);

// Shown traces: a common axis and, for each signal, the lowest and highest value in each column.

export class Traces {
  constructor() { this.clear(); }

  clear() {
    this.kind = "time"; // time, xy or spectrum
    this.x = [];
    this.names = [];
    this.low = [];
    this.high = [];
    this.bucket = 1; // rows in a column
    this.range = [0, 1];
    this.about = {};
  }

  // Store a frame, see Viewer in rtctl/scope/viewer.py.
  take(about, arrays) {
    this.about = about;
    if (about.kind === "roll") return this.roll(about, arrays);
    this.rolling = false;
    this.kind = about.kind === "picture" ? "time" : about.kind;
    this.bucket = about.bucket ?? 1;
    if (about.kind === "xy") {
      this.names = about.names.slice(1);
      this.xName = about.names[0];
      [this.x, ...this.high] = arrays;
      this.low = this.high;
      return;
    }
    const n = about.names.length;
    this.names = about.names;
    [this.x] = arrays;
    this.low = arrays.slice(1, 1 + n);
    this.high = this.bucket > 1 ? arrays.slice(1 + n) : this.low;
    if (about.span) this.range = about.span;
    else if (this.x.length) this.range = [this.x[0], this.x[this.x.length - 1]];
  }

  roll(about, arrays) {
    const n = about.names.length;
    if (about.restart || this.kind !== "time" || !this.rolling) {
      this.x = [];
      this.low = about.names.map(() => []);
      this.high = about.bucket > 1 ? about.names.map(() => []) : this.low;
    }
    this.kind = "time";
    this.rolling = true;
    this.names = about.names;
    this.bucket = about.bucket;
    const [x, ...values] = arrays;
    const width = this.x.length > 1 ? this.x[this.x.length - 1] - this.x[this.x.length - 2] : Infinity;
    if (x.length && this.x.length && x[0] - this.x[this.x.length - 1] > 10 * width + 0.05) this.gap(x[0]);
    append(this.x, x);
    for (let i = 0; i < n; i++) {
      append(this.low[i], values[i]);
      if (about.bucket > 1) append(this.high[i], values[n + i]);
    }
    const end = this.x[this.x.length - 1];
    let old = 0;
    while (old < this.x.length && this.x[old] < end - about.window) old++;
    if (old) for (const list of new Set([this.x, ...this.low, ...this.high])) list.splice(0, old);
    this.range = [end - about.window, end];
  }

  // Leave a gap in the lines where rows are missing.
  gap(x) {
    this.x.push((this.x[this.x.length - 1] + x) / 2);
    for (const list of new Set([...this.low, ...this.high])) list.push(null);
  }

  // Index of the column nearest to `x` on the axis; -1 without columns.
  nearest(x) {
    const list = this.x;
    if (!list.length) return -1;
    let first = 0, last = list.length - 1;
    while (first < last) {
      const middle = (first + last) >> 1;
      if (list[middle] < x) first = middle + 1;
      else last = middle;
    }
    return first > 0 && x - list[first - 1] < list[first] - x ? first - 1 : first;
  }
}

function append(list, values) {
  for (const value of values) list.push(value);
}

// Tick labels of an axis: distinct, and no wider than their space.

const CHARACTER = 6.6; // px of a digit at 11 px
const GAP = 14; // px between labels

export class Labels {
  // `longest` is the most characters of a label. Longer numbers are shown as differences to `offset`.
  constructor(longest = 8) {
    this.longest = longest;
    this.offset = 0;
  }

  of(ticks, factor) {
    const scaled = ticks.map((t) => (t === null ? null : t / factor));
    const known = scaled.filter((v) => v !== null);
    const words = told(scaled, known);
    this.offset = 0;
    if (known.length < 2 || Math.max(...words.map((word) => word.length)) <= this.longest) return words;
    this.offset = Number(known[Math.floor(known.length / 2)].toPrecision(12));
    const less = scaled.map((v) => (v === null ? null : v - this.offset));
    return told(less, less.filter((v) => v !== null), known);
  }
}

// Space between two labels in px, so that labels from low to high do not touch.
export function spaceFor(low, high, width, factor) {
  let space = 50;
  for (let i = 0; i < 3; i++) {
    const step = (Math.max(high - low, 1e-12) / factor / Math.max(1, width / space));
    const decimals = Math.max(0, Math.min(9, Math.ceil(-Math.log10(step))));
    const longest = Math.max(...[low, high].map((v) => (v / factor).toFixed(decimals).length));
    space = Math.max(space, longest * CHARACTER + GAP);
  }
  return space;
}

function told(values, known, scale = known) {
  const largest = Math.max(...known.map(Math.abs), 0), size = Math.max(...scale.map(Math.abs), 0);
  return values.map((value) => {
    if (value === null) return "";
    const round = Number((size > 1e3 * largest ? value.toFixed(12) : value.toPrecision(12))); // 0.3, not 0.30000000000000004
    if (round === 0 || Math.abs(value) < Math.max(largest * 1e-9, size * 1e-13)) return "0";
    const short = Number(round.toPrecision(size > 1e3 * largest ? 6 : 12));
    if (Math.abs(short) >= 1e6 || Math.abs(short) < 1e-3) return short.toExponential().replace("e+", "e");
    return String(short);
  });
}

// Numbers for people: three to five digits, and an SI prefix that suits the unit.

const PREFIXES = [["n", 1e-9], ["u", 1e-6], ["m", 1e-3], ["", 1], ["k", 1e3], ["M", 1e6]];
const NOTHING = 1e-12; // in the unit; smaller values are shown as 0
const PREFIXED = /^(m|s|V|A|N|rad|Hz|Nm|W|J|m\/s|rad\/s|V\/s|N\/s)$/;

// The factor and the prefixed unit in which numbers up to `size` are short.
export function prefixed(unit, size) {
  if (!PREFIXED.test(unit) || !(size > 0) || !isFinite(size)) return { factor: 1, unit };
  let best = PREFIXES[0];
  for (const entry of PREFIXES) if (size >= entry[1] * 0.9995) best = entry;
  if (unit.startsWith("rad") && best[1] > 1) best = PREFIXES[3];
  return { factor: best[1], unit: best[0] + unit };
}

export function short(value, digits = 5) {
  if (value === null || value === undefined || !isFinite(value)) return "-";
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size >= 1e6 || size < 1e-4) return value.toExponential(digits - 2);
  return value.toFixed(Math.max(0, Math.min(8, digits - 1 - Math.floor(Math.log10(size)))));
}

export function withUnit(value, unit) {
  if (value === null || value === undefined || !isFinite(value)) return "-";
  if (Number.isInteger(value) && Math.abs(value) < 1e9 && !PREFIXED.test(unit)) return `${value} ${unit}`.trim();
  if (PREFIXED.test(unit) && Math.abs(value) < NOTHING) return `0 ${unit}`;
  const scale = prefixed(unit, Math.abs(value));
  const scaled = value / scale.factor;
  return `${Number.isInteger(scaled) ? scaled : short(scaled, 4)} ${scale.unit}`.trim();
}

// A typed number, or null. A comma counts as a decimal point.
export function typed(text) {
  const cleaned = String(text).trim().replace(",", ".");
  const value = Number(cleaned);
  return cleaned !== "" && isFinite(value) ? value : null;
}

// Numbers as an engineer reads them: SI prefixes, round ticks, steady width.

const PREFIXES = [[1e9, "G"], [1e6, "M"], [1e3, "k"], [1, ""], [1e-3, "m"], [1e-6, "µ"], [1e-9, "n"]];
const PLAIN = new Set(["", "mixed", "1/m^2", "m^2"]);
const SHOWN = { "N m": "N·m", "m/s": "m/s", "rad/s": "rad/s", mixed: "" };

/** Prefix of a unit for values up to `size`: its factor, and the unit with it. */
export function prefixed(unit, size) {
  const shown = SHOWN[unit] ?? unit;
  if (PLAIN.has(unit) || !(size > 0) || !Number.isFinite(size)) return [1, shown];
  const [factor, letter] = PREFIXES.find(([f]) => size >= f * 0.9999) ?? PREFIXES.at(-1);
  if (unit === "s" && factor > 1) return [1, shown];
  return [factor, letter + shown];
}

/** A step of 1, 2 or 5 times a power of ten, at least `least`. */
export function niceStep(least) {
  if (!(least > 0)) return 1;
  const power = 10 ** Math.floor(Math.log10(least));
  const lead = least / power;
  return power * (lead <= 1.0000001 ? 1 : lead <= 2.0000001 ? 2 : lead <= 5.0000001 ? 5 : 10);
}

/** Digits after the point that a step of ticks asks for. */
export function digitsOf(step) {
  return Math.max(0, Math.min(9, -Math.floor(Math.log10(step) + 1e-9)));
}

export function fixed(value, digits) {
  const text = value.toFixed(digits);
  return (Number(text) === 0 ? (0).toFixed(digits) : text).replace("-", "−");
}

/** Four significant digits with a prefix, as in `−12.35 mm`. */
export function quantity(value, unit) {
  if (value !== value) return "–";
  const [factor, shown] = prefixed(unit, Math.abs(value));
  return `${significant(value / factor, 4)}${shown ? " " + shown : ""}`;
}

export function significant(value, digits) {
  if (value !== value) return "–";
  const size = Math.abs(value);
  if (size === 0) return "0";
  if (size >= 1e6 || size < 1e-4) return value.toExponential(digits - 2).replace("e+", "e").replaceAll("-", "−");
  const places = Math.max(0, Math.min(9, digits - 1 - Math.floor(Math.log10(size))));
  return fixed(value, places);
}

/** A span of time: `50 ms`, `2 s`, `1 min`. */
export function duration(seconds) {
  if (seconds < 0.9995) return `${significant(seconds * 1000, 3).replace(/\.0+$/, "")} ms`;
  if (seconds < 59.95) return `${Number(seconds.toFixed(seconds < 10 ? 1 : 0))} s`;
  return `${Number((seconds / 60).toFixed(1))} min`;
}

// SPDX-License-Identifier: GPL-3.0-or-later
// From values to the unit interval and back; round ticks.

/** Share of an axis that is left free at either end, so that the outermost points are seen whole. */
const MARGIN = 0.03;

/** More ticks than any axis has room for. */
const MOST_TICKS = 200;

/** Position of a value on its axis, 0 to 1 with margins. @param {import("./data.js").Column} column @param {number} value */
export function position(column, value) {
  const half = Number.isFinite(column.high - column.low) ? 1 : 0.5; // no number holds the length of a longer range
  const [low, high, at] = (column.log ? [column.low, column.high, value].map(Math.log) : [column.low, column.high, value].map((one) => half * one));
  return MARGIN + ((1 - 2 * MARGIN) * (at - low)) / (high - low);
}

/** Positions of a whole column, NaN where there is no value. @param {import("./data.js").Column} column */
export function positions(column) {
  const values = /** @type {Float64Array} */ (column.values);
  const out = new Float32Array(values.length);
  for (let i = 0; i < values.length; i++) out[i] = position(column, values[i]);
  return out;
}

/**
 * Bars of the histogram of a column, at most ``most``, over the range of its values. Of texts and whole numbers each bar
 * but the last has equally many, or some would be twice as high.
 * @param {import("./data.js").Column} column @param {number} most
 */
export function barsOf(column, most) {
  const values = /** @type {Float64Array} */ (column.values);
  const isWhole = column.kind === "text" || (!column.log && values.every((value) => Number.isNaN(value) || Number.isInteger(value)));
  const half = column.kind === "text" ? 0.5 : 0;
  const [first, last] = [column.low + half, column.high - half];
  const number = last - first + 1;
  if (!isWhole || !Number.isInteger(first) || !Number.isFinite(number)) {
    return { low: position(column, column.low), high: position(column, column.high), count: most };
  }
  const each = Math.ceil(number / most);
  const count = Math.ceil(number / each);
  return { low: position(column, first - 0.5), high: position(column, first - 0.5 + count * each), count };
}

/**
 * Round values within the range of an axis.
 * @param {import("./data.js").Column} column @param {number} wanted @returns {{at: number, text: string}[]}
 */
export function ticks(column, wanted) {
  if (column.kind === "text") {
    const step = Math.max(1, Math.ceil(column.order.length / wanted));
    return column.order.filter((_, i) => i % step === 0).map((text, i) => ({ at: position(column, i * step), text: shortened(text, 40) }));
  }
  if (!column.values?.some((value) => !Number.isNaN(value))) return []; // a scale would claim values that there are not
  const found = [];
  if (column.log && column.high / column.low > 9) {
    const first = Math.ceil(Math.log10(column.low) - 1e-9);
    for (let power = first; 10 ** power <= column.high * (1 + 1e-9); power++) {
      found.push({ at: position(column, 10 ** power), text: plain(10 ** power) });
    }
    if (found.length > 1) return found;
    const values = [1, 2, 5].flatMap((k) => [first - 1, first, first + 1].map((power) => k * 10 ** power));
    const inside = values.filter((value) => value >= column.low && value <= column.high).sort((a, b) => a - b);
    return inside.map((value) => ({ at: position(column, value), text: plain(value) }));
  }
  if (!Number.isFinite(column.high - column.low)) return [column.low, 0, column.high].map((at) => ({ at: position(column, at), text: plain(at) }));
  const rough = (column.high - column.low) / Math.max(wanted, 1);
  const power = 10 ** Math.floor(Math.log10(rough));
  const inRange = (/** @type {number} */ k) => Math.floor(column.high / k + 1e-9) - Math.ceil(column.low / k - 1e-9) + 1;
  const steps = [0.5, 1, 2, 5, 10].map((k) => k * power);
  const wide = steps.find((k) => k >= rough) ?? 10 * power;
  const fine = inRange(wide) > 1 ? wide : steps.filter((k) => k < wide && inRange(k) > 1).at(-1) ?? wide; // one tick tells no scale
  const step = column.of === "integer" ? Math.max(fine, 1) : fine; // there is no value between whole numbers
  const first = Math.ceil(column.low / step - 1e-9);
  const count = Math.min(inRange(step), MOST_TICKS); // beyond 2^53 a number may be its own successor
  for (let i = 0; i < count; i++) found.push({ at: position(column, (first + i) * step), text: plain((first + i) * step) });
  // a range too narrow for six digits: the roundest tick in full, and how far the others are from it
  if (new Set(found.map((tick) => tick.text)).size < found.length) {
    const full = found.map((_, i) => inFull((first + i) * step, step));
    const base = full.reduce((best, text, i) => (text.length < full[best].length ? i : best), 0);
    return found.map((tick, i) => ({ ...tick, text: i === base ? full[i] : `${i > base ? "+" : ""}${plain((i - base) * step)}` }));
  }
  return found;
}

/** A text on one line with its middle left out: what tells names apart often stands last. @param {string} text @param {number} length */
export function shortened(text, length) {
  const line = text.replace(/\s+/g, " ");
  if (line.length <= length) return line;
  const end = Math.floor((length - 1) / 2);
  return `${line.slice(0, length - 1 - end)}…${end ? line.slice(-end) : ""}`;
}

/** A tick with all its digits, without rounding noise. @param {number} value @param {number} step */
function inFull(value, step) {
  const rounded = Number(value.toPrecision(15));
  const exact = Math.abs(rounded - value) < 1e-3 * step ? rounded : value;
  const [plainly, exponential] = [String(exact), exact.toExponential()];
  return exponential.length < plainly.length ? exponential : plainly;
}

/** A number with six digits at most, and no more than it has. @param {number} value */
function plain(value) {
  const rounded = Number(value.toPrecision(6));
  const size = Math.abs(rounded);
  return size !== 0 && (size >= 1e5 || size < 1e-3) ? rounded.toExponential() : String(rounded);
}

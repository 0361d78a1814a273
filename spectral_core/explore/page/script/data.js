// SPDX-License-Identifier: GPL-3.0-or-later
// The table of the page: columns as typed arrays, decoded from what the page was built with.

/**
 * @typedef {{name: string, kind: "number"|"text", role: "parameter"|"value"|"manual"|"file"|"time", unit: string,
 *   group: string, log: boolean, of?: "real"|"integer"|"choice", range?: number[], values: Float64Array|null, texts: string[]|null, low: number, high: number,
 *   order: string[]}} Column
 * A column. `range`: of a parameter of numbers, in the sweep. `values` holds numbers, or for texts the position in `order`; NaN where there is none.
 * @typedef {{title: string, id: string, keys: string[], columns: Column[], byName: Map<string, Column>, count: number,
 *   files: Map<string, string[]>, thumbnails: {sheets: string[], size: number, perRow: number, perSheet: number, missing: number[]}|null,
 *   live: boolean, version: string, limits: {constraints?: string[], ball?: Ball}}} Table
 * `limits`: the constraints and the ball of the sweep's region. `missing`: rows without a small picture.
 * @typedef {{center: Record<string, number>, radii: Record<string, number>, p: number|"inf"}} Ball
 */

/** Decode base64 to bytes. @param {string} text @returns {Uint8Array} */
export function bytesOf(text) {
  const raw = atob(text);
  const bytes = new Uint8Array(raw.length);
  for (let i = 0; i < raw.length; i++) bytes[i] = raw.charCodeAt(i);
  return bytes;
}

/** Numbers of a packed column: float32 or float64, little endian. @param {any} packed @returns {Float64Array} */
function unpack(packed) {
  const bytes = bytesOf(packed.data);
  const count = bytes.length / packed.width;
  const view = new DataView(bytes.buffer);
  const out = new Float64Array(count);
  for (let i = 0; i < count; i++) {
    out[i] = packed.width === 4 ? view.getFloat32(4 * i, true) : view.getFloat64(8 * i, true);
  }
  return out;
}

/** Lowest and highest finite number; 0 and 1 where there is none. @param {Float64Array} values */
export function extent(values) {
  let low = Infinity;
  let high = -Infinity;
  for (const value of values) {
    if (value < low && value !== -Infinity) low = value;
    if (value > high && value !== Infinity) high = value;
  }
  if (!(low <= high)) return [0, 1];
  const room = Math.max(0.5, 1e-9 * Math.abs(low)); // a half is lost in the rounding of a large number
  return low === high ? [low - room, high + room] : [low, high];
}

/** "name 2" before "name 10", alike on every machine. */
const NATURAL = new Intl.Collator("en", { numeric: true });

/** Column of texts: positions in their sorted order. @param {string[]} texts @param {boolean} [takesEmpty] an empty text is a value */
export function textColumn(texts, takesEmpty = false) {
  const order = [...new Set(texts.filter((text) => takesEmpty || text !== ""))].sort(NATURAL.compare);
  const place = new Map(order.map((text, i) => [text, i]));
  const values = Float64Array.from(texts, (text) => place.get(text) ?? NaN);
  return { values, order };
}

/** A column from its entry in the payload. @param {any} entry @returns {Column} */
export function columnOf(entry) {
  if (entry.kind === "text") {
    const { values, order } = textColumn(entry.texts, entry.role === "parameter"); // every point has its parameters
    return { ...entry, values, order, low: -0.5, high: Math.max(order.length, 1) - 0.5, log: false };
  }
  const values = unpack(entry.packed);
  let [low, high] = extent(values);
  const first = values.find((value) => Number.isFinite(value)) ?? 0;
  if (entry.log && first > 0 && values.every((value) => value === first || !Number.isFinite(value))) {
    [low, high] = [first / 2, first * 2]; // half a unit to both sides may lead below 0
  }
  const log = Boolean(entry.log) && low > 0;
  return { ...entry, values, texts: null, order: [], low, high, log };
}

/** The table of a payload. @param {any} payload @returns {Table} */
export function tableOf(payload) {
  const columns = payload.columns.map(columnOf);
  return {
    title: payload.title,
    id: payload.id,
    keys: payload.keys,
    columns,
    byName: new Map(columns.map((/** @type {Column} */ column) => [column.name, column])),
    count: payload.keys.length,
    files: new Map(Object.entries(payload.files)),
    thumbnails: payload.thumbnails,
    live: payload.live,
    version: payload.version,
    limits: payload.limits,
  };
}

/** A value as a reader wants it. @param {Column} column @param {number} row */
export function shown(column, row) {
  const value = column.values ? column.values[row] : NaN;
  if (column.kind === "text") return Number.isNaN(value) ? "" : column.order[value];
  const narrow = Math.max(Math.abs(column.low), Math.abs(column.high)) / (column.high - column.low);
  return format(value, 4 + Math.max(0, Math.min(11, Math.floor(Math.log10(narrow)))));
}

/** A number of things, in words: 1 row, 2 rows. @param {number} count @param {string} noun */
export function counted(count, noun) {
  return `${count} ${noun}${count === 1 ? "" : "s"}`;
}

/** All digits of a number, without those that a float of 32 bits adds. @param {number} value */
export function digits(value) {
  if (Number.isNaN(value)) return "NaN";
  if (Number.isInteger(value)) return String(value); // fewer digits would be those of another whole number
  for (let count = 6; count < 10 && Math.fround(value) === value; count++) {
    const short = Number(value.toPrecision(count));
    if (Math.fround(short) === value) return String(short);
  }
  return String(value);
}

/** Four significant digits, or as many as tell the values of a narrow column apart; all digits of a whole number below
 * a billion. @param {number} value @param {number} [count] */
export function format(value, count = 4) {
  if (!Number.isFinite(value)) return Number.isNaN(value) ? "–" : value > 0 ? "∞" : "-∞";
  if (Number.isInteger(value) && Math.abs(value) < 1e9) return String(value);
  const rounded = Number(value.toPrecision(count));
  const size = Math.abs(rounded);
  return size < 1e-3 || (size >= 1e5 && (count <= 4 || size >= 1e15)) ? rounded.toExponential() : String(rounded);
}

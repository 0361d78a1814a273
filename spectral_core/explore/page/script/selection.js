// SPDX-License-Identifier: GPL-3.0-or-later
// Selections as masks over rows, and how a new one joins the old: replace, union, intersection, difference.

/** @typedef {"replace"|"union"|"intersection"|"difference"} Operation */

/** Join two masks. @param {Uint8Array} old @param {Uint8Array} fresh @param {Operation} operation */
export function combine(old, fresh, operation) {
  const out = new Uint8Array(old.length);
  for (let i = 0; i < old.length; i++) {
    if (operation === "union") out[i] = old[i] | fresh[i];
    else if (operation === "intersection") out[i] = old[i] & fresh[i];
    else if (operation === "difference") out[i] = old[i] & ~fresh[i] & 1;
    else out[i] = fresh[i];
  }
  return out;
}

/**
 * Rows whose point lies in a polygon (even-odd rule), by their positions on two axes.
 * @param {Float32Array} x @param {Float32Array} y @param {number[][]} polygon
 */
export function inPolygon(x, y, polygon) {
  const out = new Uint8Array(x.length);
  let left = Infinity;
  let right = -Infinity;
  let low = Infinity;
  let high = -Infinity;
  for (const [px, py] of polygon) {
    left = Math.min(left, px);
    right = Math.max(right, px);
    low = Math.min(low, py);
    high = Math.max(high, py);
  }
  for (let i = 0; i < x.length; i++) {
    const a = x[i];
    const b = y[i];
    if (!(a >= left && a <= right && b >= low && b <= high)) continue;
    let inside = 0;
    for (let k = 0, j = polygon.length - 1; k < polygon.length; j = k++) {
      const [xk, yk] = polygon[k];
      const [xj, yj] = polygon[j];
      if (yk > b !== yj > b && a < ((xj - xk) * (b - yk)) / (yj - yk) + xk) inside ^= 1;
    }
    out[i] = inside;
  }
  return out;
}

/** Rows within an interval of one axis. @param {Float32Array} x @param {number} low @param {number} high */
export function inInterval(x, low, high) {
  const out = new Uint8Array(x.length);
  for (let i = 0; i < x.length; i++) out[i] = x[i] >= low && x[i] <= high ? 1 : 0;
  return out;
}

/** How many rows are selected. @param {Uint8Array} mask */
export function size(mask) {
  let count = 0;
  for (const bit of mask) count += bit;
  return count;
}

/** Selected rows. @param {Uint8Array} mask @param {number} [most] */
export function rowsOf(mask, most = Infinity) {
  const out = [];
  for (let i = 0; i < mask.length && out.length < most; i++) if (mask[i]) out.push(i);
  return out;
}

/**
 * Region around rows over the parameters: the smallest ranges, with the limits of the sweep's region, as in its file.
 * @param {import("./data.js").Table} table @param {number[]} rows @param {string} name
 */
export function regionAround(table, rows, name) {
  /** @type {Record<string, number[]>} */
  const ranges = {};
  /** @type {Record<string, (string|number)[]>} */
  const choices = {};
  for (const column of table.columns) {
    if (column.role !== "parameter" || !column.values) continue;
    const values = rows.map((row) => /** @type {Float64Array} */ (column.values)[row]).filter((v) => !Number.isNaN(v));
    if (!values.length) continue;
    if (column.kind === "text") choices[column.name] = [...new Set(values.map((v) => column.order[v]))];
    else if (column.of === "choice") choices[column.name] = [...new Set(values)].sort((a, b) => a - b);
    else {
      const low = values.reduce((a, b) => Math.min(a, b));
      const high = values.reduce((a, b) => Math.max(a, b));
      // one real value alone is no range: a hundredth of the axis around it
      const alone = low === high && column.of !== "integer";
      const room = alone && !column.log ? 0.005 * (column.high - column.low) : 0;
      const factor = alone && column.log ? (column.high / column.low) ** 0.005 : 1;
      // as far as the range of the sweep, beyond which a value may have no meaning
      const [least, most] = column.range && low >= column.range[0] && high <= column.range[1] ? column.range : [-Infinity, Infinity];
      ranges[column.name] = [Math.max((low - room) / factor, least), Math.min((high + room) * factor, most)];
    }
  }
  return { name, ranges, ...(Object.keys(choices).length ? { choices } : {}), ...table.limits };
}

/**
 * A region as text of a sweep file (TOML), whose texts are written as in JSON.
 * @param {{name: string, ranges: Record<string, number[]>, choices?: Record<string, (string|number)[]>,
 *   constraints?: string[], ball?: import("./data.js").Ball}} region
 */
export function tomlOf(region) {
  const text = (/** @type {string} */ word) => JSON.stringify(word).replaceAll("\u007f", "\\u007f");
  const value = (/** @type {string|number} */ one) => (typeof one === "string" ? text(one) : String(one));
  const lines = ["[region]", `name = ${text(region.name)}`];
  if (region.constraints) lines.push(`constraints = [${region.constraints.map(text).join(", ")}]`);
  for (const [part, byName] of /** @type {[string, Record<string, (string|number)[]>][]} */ ([["ranges", region.ranges], ["choices", region.choices ?? {}]])) {
    const entries = Object.entries(byName).map(([name, values]) => `${text(name)} = [${values.map(value).join(", ")}]`);
    if (entries.length) lines.push("", `[region.${part}]`, ...entries);
  }
  if (region.ball) {
    const table = (/** @type {Record<string, number>} */ byName) =>
      `{${Object.entries(byName).map(([name, number]) => `${text(name)} = ${number}`).join(", ")}}`;
    const { center, radii, p } = region.ball;
    lines.push("", "[region.ball]", `center = ${table(center)}`, `radii = ${table(radii)}`, `p = ${value(p)}`);
  }
  return `${lines.join("\n")}\n`;
}

// SPDX-License-Identifier: GPL-3.0-or-later
// Colors of points: a perceptually even map for numbers, ten distinct colors for texts; as bytes for the rasterizer.

/** Viridis (van der Walt and Smith, CC0) at eight places. */
const MAP = [
  [68, 1, 84], [70, 50, 126], [54, 92, 141], [39, 127, 142], [31, 161, 135], [74, 193, 109], [160, 218, 57], [253, 231, 37],
];
/**
 * Ten colors, at least ΔE2000 12 apart from each other and from gray, also to people who lack a type of cone, on a light
 * and on a dark ground; found by a search. The first ones differ most.
 */
const DISTINCT = [
  [34, 119, 221], [187, 187, 34], [187, 0, 51], [51, 187, 255], [255, 153, 153], [187, 51, 153], [0, 119, 85],
  [170, 119, 0], [51, 170, 102], [187, 136, 187],
];
/** Number of distinct colors; more texts share them. */
export const MOST_DISTINCT = DISTINCT.length;
const PLAIN = [76, 120, 200];
/** Color of rows without a value. */
export const MISSING = [128, 128, 128];

/** Where the map begins: its first third cannot be told from a dark ground. */
let mapStart = 0;

/** Fit the map to the ground of the page. @param {boolean} isDark */
export function onGround(isDark) {
  mapStart = isDark ? 0.3 : 0;
}

/** Color of a position from 0 to 1. @param {number} at @returns {number[]} */
export function mapped(at) {
  const place = (mapStart + (1 - mapStart) * Math.min(Math.max(at, 0), 1)) * (MAP.length - 1);
  const k = Math.min(Math.floor(place), MAP.length - 2);
  const rest = place - k;
  return [0, 1, 2].map((c) => Math.round(MAP[k][c] * (1 - rest) + MAP[k + 1][c] * rest));
}

/** Color of the k-th text. @param {number} k */
export function distinct(k) {
  return DISTINCT[((k % DISTINCT.length) + DISTINCT.length) % DISTINCT.length];
}

/** Pixel word of a color for a little-endian canvas buffer. @param {number[]} rgb */
export function word(rgb) {
  return ((255 << 24) | (rgb[2] << 16) | (rgb[1] << 8) | rgb[0]) >>> 0;
}

/** A color for style sheets. @param {number[]} rgb */
export function css(rgb) {
  return `rgb(${rgb[0]} ${rgb[1]} ${rgb[2]})`;
}

/**
 * Pixel word of every row.
 * @param {import("./data.js").Column|undefined} column @param {Float32Array|null} at @param {number} count
 */
export function rowColors(column, at, count) {
  const out = new Uint32Array(count);
  if (!column || !at) return out.fill(word(PLAIN));
  if (column.kind === "text") {
    const values = /** @type {Float64Array} */ (column.values);
    const missing = word(MISSING);
    for (let i = 0; i < count; i++) out[i] = Number.isNaN(values[i]) ? missing : word(distinct(values[i]));
    return out;
  }
  const lookup = Uint32Array.from({ length: 256 }, (_, k) => word(mapped(k / 255)));
  const missing = word(MISSING);
  for (let i = 0; i < count; i++) out[i] = Number.isNaN(at[i]) ? missing : lookup[Math.floor(Math.min(255, Math.max(0, at[i] * 255)))];
  return out;
}

// SPDX-License-Identifier: GPL-3.0-or-later
// The legend of the color: a bar for numbers, a dot for each text or an only number, gray for rows without a value.

import { MISSING, MOST_DISTINCT, css, distinct, mapped } from "./colors.js";
import { shown } from "./data.js";
import { position, shortened } from "./scales.js";

const LONGEST_TEXT = 24;

/** Parts of a column's legend. @param {import("./data.js").Column} column @returns {HTMLElement[]} */
export function legendOf(column) {
  const parts = column.kind === "text" ? dotsOf(column.order) : scaleOf(column);
  if (column.values?.some((value) => Number.isNaN(value))) parts.push(dot("no value", MISSING));
  return parts;
}

/** A bar, where a column has more than one value: its ends would claim values that there are not. @param {import("./data.js").Column} column */
function scaleOf(column) {
  const first = column.values?.findIndex((value) => !Number.isNaN(value)) ?? -1;
  if (first < 0) return [];
  const only = /** @type {Float64Array} */ (column.values)[first];
  if (column.values?.some((value) => value !== only && !Number.isNaN(value))) return barOf(column);
  return [dot(shown(column, first), mapped(position(column, only)))];
}

/** @param {import("./data.js").Column} column */
function barOf(column) {
  const strip = document.createElement("span");
  strip.className = "bar";
  strip.style.background = `linear-gradient(to right, ${[0, 0.25, 0.5, 0.75, 1].map((at) => css(mapped(at))).join(",")})`;
  const [low, high] = [column.low, column.high].map((value) => wordsOf(shown({ ...column, values: Float64Array.of(value) }, 0)));
  return [low, strip, high];
}

/** @param {string[]} order */
function dotsOf(order) {
  const parts = order.slice(0, MOST_DISTINCT).map((text, k) => dot(text, distinct(k)));
  const more = order.length - parts.length;
  return more > 0 ? [...parts, wordsOf(`and ${more} more in the same colors`)] : parts;
}

/** @param {string} text @param {number[]} color */
function dot(text, color) {
  const made = wordsOf(text === "" ? "(empty)" : shortened(text, LONGEST_TEXT));
  made.className = "item";
  made.title = text;
  made.style.setProperty("--color", css(color));
  return made;
}

/** @param {string} text */
function wordsOf(text) {
  const made = document.createElement("span");
  made.textContent = text;
  return made;
}

// SPDX-License-Identifier: GPL-3.0-or-later
// What the user has chosen: kept between visits, saved to a file, restored.

import { rowsOf } from "./selection.js";

/**
 * @typedef {{selection: Uint8Array, selected: boolean, color: string, columns: string[], view: string, tool: string,
 *   operation: import("./selection.js").Operation, theme: string, labels: Record<string, Record<string, string>>,
 *   compare: number[], hover: number, sort: {column: string, down: boolean}, paper: boolean}} State
 * `paper`: the page is being printed.
 */

/** Most variables that are shown at once when a page is opened (thesis: hide what is over eight dimensions). */
export const MOST_SHOWN = 8;
const NARROW = 760;
const MOST_SHOWN_NARROW = 4;

/** True if the rows have more than one value in a column, beyond rounding. @param {import("./data.js").Column} column */
function varies(column) {
  const known = (column.values ?? new Float64Array()).filter((value) => !Number.isNaN(value));
  // no distance is beyond the rounding of an infinite value
  if (known.some((value) => !Number.isFinite(value))) return known.some((value) => value !== known[0]);
  return known.some((value) => Math.abs(value - known[0]) > 1e-12 * Math.max(1, Math.abs(known[0])));
}

/** State of a page that is opened for the first time. @param {import("./data.js").Table} table @returns {State} */
export function freshState(table) {
  const plotted = table.columns.filter((column) => column.values && column.role !== "time");
  const first = plotted.filter((column) => column.role === "parameter");
  const outcomes = plotted.filter((column) => column.role !== "parameter");
  const varied = outcomes.filter(varies);
  const rest = varied.length ? varied : outcomes;
  const most = window.innerWidth < NARROW ? MOST_SHOWN_NARROW : MOST_SHOWN;
  // Parameters leave room for outcomes, up to half of it: without outcomes the plots show only the sampling design.
  const parameters = first.slice(0, most - Math.min(rest.length, most / 2));
  const names = [...parameters, ...rest].map((column) => column.name).slice(0, most);
  return {
    selection: new Uint8Array(table.count),
    selected: false,
    color: rest.length ? rest[0].name : names[0] ?? "",
    columns: names,
    view: "matrix",
    tool: "lasso",
    operation: "replace",
    theme: "auto",
    labels: {},
    compare: [],
    hover: -1,
    sort: { column: "", down: false },
    paper: false,
  };
}

/** State as plain JSON; rows by key. @param {State} state @param {import("./data.js").Table} table */
export function toPlain(state, table) {
  return {
    id: table.id,
    color: state.color,
    columns: state.columns,
    view: state.view,
    tool: state.tool,
    theme: state.theme,
    labels: state.labels,
    sort: state.sort,
    selection: rowsOf(state.selection).map((row) => table.keys[row]),
    compare: state.compare.map((row) => table.keys[row]),
  };
}

/**
 * Take plain JSON over where it fits the table. Returns what it names that the table lacks.
 * @param {State} state @param {any} plain @param {import("./data.js").Table} table @returns {string[]}
 */
export function fromPlain(state, plain, table) {
  /** @type {string[]} */
  const lost = [];
  if (typeof plain !== "object" || plain === null) return lost;
  const rows = new Map(table.keys.map((key, i) => [key, i]));
  const known = (/** @type {any} */ name) => typeof name === "string" && table.byName.has(name);
  if (Array.isArray(plain.columns)) {
    const kept = plain.columns.filter(known);
    if (kept.length) state.columns = kept;
    lost.push(...plain.columns.filter((/** @type {any} */ name) => !known(name)).map((/** @type {any} */ name) => `the column ${name}`));
  }
  if (known(plain.color) || plain.color === "") state.color = plain.color;
  if (["matrix", "parallel", "table"].includes(plain.view)) state.view = plain.view;
  if (["box", "lasso"].includes(plain.tool)) state.tool = plain.tool;
  if (["auto", "light", "dark"].includes(plain.theme)) state.theme = plain.theme;
  if (known(plain.sort?.column) || plain.sort?.column === "") state.sort = { column: plain.sort.column, down: plain.sort.down === true };
  if (typeof plain.labels === "object" && plain.labels !== null) {
    for (const [name, byKey] of Object.entries(plain.labels)) {
      if (typeof byKey !== "object" || byKey === null) continue;
      const entries = Object.entries(byKey).filter(([key, text]) => rows.has(key) && typeof text === "string");
      state.labels[name] = Object.fromEntries(entries);
    }
  }
  if (Array.isArray(plain.selection)) {
    const found = plain.selection.filter((/** @type {any} */ key) => rows.has(key));
    state.selection.fill(0); // what was selected before is no part of this state
    for (const key of found) state.selection[/** @type {number} */ (rows.get(key))] = 1;
    state.selected = found.length > 0;
    if (found.length < plain.selection.length) lost.push(`${plain.selection.length - found.length} of ${plain.selection.length} selected rows`);
  }
  if (Array.isArray(plain.compare)) {
    state.compare = plain.compare.filter((/** @type {string} */ key) => rows.has(key)).map((/** @type {string} */ key) => rows.get(key));
  }
  return lost;
}

/** Keep the state for the next visit. @param {State} state @param {import("./data.js").Table} table */
export function remember(state, table) {
  try {
    localStorage.setItem(`explore-${table.id}`, JSON.stringify(toPlain(state, table)));
  } catch {
    // storage is full or switched off: the state can still be saved to a file
  }
}

/** Take up what was kept. @param {State} state @param {import("./data.js").Table} table */
export function recall(state, table) {
  try {
    const text = localStorage.getItem(`explore-${table.id}`);
    if (text) fromPlain(state, JSON.parse(text), table);
  } catch {
    // nothing kept, or not readable
  }
}

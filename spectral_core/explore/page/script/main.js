// SPDX-License-Identifier: GPL-3.0-or-later
// The page: reads the table, builds the views, links them, hears keys and buttons.

import { columnOf, counted, digits, shown, tableOf, textColumn } from "./data.js";
import { onGround } from "./colors.js";
import { legendOf } from "./legend.js";
import { List } from "./list.js";
import { ask } from "./live.js";
import { Matrix } from "./matrix.js";
import { Parallel } from "./parallel.js";
import { Compare, fillCard, note, thumbnail } from "./pictures.js";
import { combine, regionAround, rowsOf, size, tomlOf } from "./selection.js";
import { MOST_SHOWN, freshState, fromPlain, recall, remember, toPlain } from "./state.js";

const started = performance.now();
const REMEMBER_MS = 250;
/** What readers of tables take for a number. */
const NUMBER = /^\s*[+-]?(((\d[\d_]*\.?[\d_]*|\.\d[\d_]*)(e[+-]?\d+)?)|nan|inf|infinity)\s*$/i;

/** @param {string} id */
function element(id) {
  return /** @type {HTMLElement} */ (document.getElementById(id));
}

/** @param {string} id */
function input(id) {
  return /** @type {HTMLInputElement} */ (document.getElementById(id));
}

class Explorer {
  constructor() {
    const payload = JSON.parse(element("payload").textContent ?? "{}");
    this.table = tableOf(payload);
    this.state = freshState(this.table);
    recall(this.state, this.table);
    for (const [name, byKey] of Object.entries(this.state.labels)) this.setLabels(name, byKey);
    recall(this.state, this.table); // what names a column of labels is understood now
    /** @type {Record<string, number>} */
    this.timing = {};
    this.later = 0;
    const on = {
      select: (/** @type {Uint8Array} */ mask) => this.select(mask),
      hover: (/** @type {number} */ row, /** @type {number} */ x, /** @type {number} */ y) => this.hover(row, x, y),
      pick: (/** @type {number} */ row) => this.pick(row),
      positions: (/** @type {string} */ name) => this.matrix.positions(name),
      sorted: () => this.changed(),
    };
    this.matrix = new Matrix(element("matrix"), this.table, this.state, on);
    this.parallel = new Parallel(element("parallel"), this.table, this.state, on);
    this.list = new List(element("table"), this.table, this.state, on);
    this.compare = new Compare(element("compare"), this.table, this.state);
    document.title = this.table.title;
    element("title").textContent = this.table.title;
    this.controls();
    this.keys();
    this.variables();
    this.changed();
    window.addEventListener("resize", () => this.paint());
    window.addEventListener("beforeprint", () => this.print(true));
    window.addEventListener("afterprint", () => this.print(false));
    window.addEventListener("pagehide", () => remember(this.state, this.table));
    this.timing.first_paint_ms = performance.now() - started;
    requestAnimationFrame(() => {
      this.timing.shown_ms = performance.now();
    });
  }

  /** Join a fresh selection to the old one and repaint everything that is linked. @param {Uint8Array} mask */
  select(mask) {
    const start = performance.now();
    const joined = combine(this.state.selection, mask, this.state.operation);
    this.state.selection.set(joined);
    this.state.selected = size(joined) > 0;
    this.changed();
    this.timing.select_ms = performance.now() - start;
  }

  /** Repaint, and remember once there is time: to write down many rows takes longer than to paint them. */
  changed() {
    this.details();
    this.paint(); // last: all above may take room from the view
    clearTimeout(this.later);
    this.later = setTimeout(() => remember(this.state, this.table), REMEMBER_MS);
  }

  paint() {
    const { view, theme, paper } = this.state;
    document.documentElement.dataset.theme = paper ? "light" : theme;
    onGround(isDark());
    this.legend(); // before the view, because its width may wrap the header, which takes room from the view
    for (const name of ["matrix", "parallel", "table"]) {
      element(name).hidden = name !== view;
      element(`view-${name}`).setAttribute("aria-pressed", String(name === view));
    }
    for (const name of ["box", "lasso"]) element(`tool-${name}`).setAttribute("aria-pressed", String(name === this.state.tool));
    for (const name of ["replace", "union", "intersection", "difference"]) {
      element(`op-${name}`).setAttribute("aria-pressed", String(name === this.state.operation));
    }
    if (view === "matrix") this.matrix.draw();
    else if (view === "parallel") this.parallel.draw();
    else this.list.draw();
  }

  /** Paint for paper, or for the screen again. @param {boolean} paper */
  print(paper) {
    this.state.paper = paper;
    this.paint();
  }

  details() {
    const { table, state } = this;
    const count = size(state.selection);
    element("count").textContent = state.selected ? `${count} of ${table.count} selected` : counted(table.count, "point");
    const rows = rowsOf(state.selection, 60);
    const strip = rows.map((row) => {
      const image = thumbnail(table, row);
      if (!image) return null;
      image.title = `row ${row + 1}`;
      image.tabIndex = 0;
      image.setAttribute("role", "button");
      image.setAttribute("aria-label", `row ${row + 1}`);
      image.addEventListener("click", () => this.pick(row));
      image.addEventListener("keydown", (event) => {
        if (event.key === "Enter" || event.key === " ") {
          event.preventDefault();
          this.pick(row);
        }
      });
      return image;
    });
    element("strip").replaceChildren(.../** @type {HTMLElement[]} */ (strip.filter((one) => one !== null)));
    this.compare.draw();
  }

  /** @param {number} row @param {number} x @param {number} y */
  hover(row, x, y) {
    const card = element("card");
    card.hidden = row < 0;
    this.state.hover = row;
    if (row < 0) return;
    fillCard(card, this.table, row, this.state.columns);
    const box = card.getBoundingClientRect();
    card.style.left = `${Math.max(4, Math.min(x + 14, window.innerWidth - box.width - 8))}px`;
    card.style.top = `${Math.max(4, Math.min(y + 14, window.innerHeight - box.height - 8))}px`;
  }

  /** Show a row's picture, beside the one picked before. @param {number} row */
  pick(row) {
    const rest = this.state.compare.filter((one) => one !== row);
    this.state.compare = [...rest, row].slice(-2);
    this.details();
    if (this.state.view === "table") this.list.fill(); // marks the rows that are picked
    clearTimeout(this.later);
    this.later = setTimeout(() => remember(this.state, this.table), REMEMBER_MS);
  }

  /** A legend of the color. */
  legend() {
    const column = this.table.byName.get(this.state.color);
    element("legend").replaceChildren(...(column ? legendOf(column) : []));
  }

  /** Checkboxes of the variables by dimension group, and the choice of the color. */
  variables() {
    const groups = new Map();
    for (const column of this.table.columns) {
      if (!column.values) continue;
      if (!groups.has(column.group)) groups.set(column.group, []);
      groups.get(column.group).push(column);
    }
    const blocks = [...groups].map(([group, columns]) => {
      const block = document.createElement("fieldset");
      const head = document.createElement("legend");
      const whole = document.createElement("button");
      whole.textContent = group;
      whole.title = "Show this group alone";
      whole.addEventListener("click", () => {
        this.state.columns = columns.map((/** @type {any} */ c) => c.name).slice(0, 2 * MOST_SHOWN);
        this.variables();
        this.changed();
      });
      head.append(whole);
      block.append(head);
      for (const column of columns) block.append(this.checkbox(column));
      return block;
    });
    element("variables").replaceChildren(...blocks);
    const choice = /** @type {HTMLSelectElement} */ (document.getElementById("color"));
    const options = [["", "one color"], ...this.table.columns.filter((c) => c.values).map((c) => [c.name, c.name])];
    choice.replaceChildren(...options.map(([value, text]) => new Option(text, value, false, value === this.state.color)));
  }

  /** @param {import("./data.js").Column} column */
  checkbox(column) {
    const label = document.createElement("label");
    const box = document.createElement("input");
    box.type = "checkbox";
    box.checked = this.state.columns.includes(column.name);
    box.addEventListener("change", () => {
      const names = this.table.columns.map((c) => c.name);
      const chosen = new Set(this.state.columns);
      if (box.checked) chosen.add(column.name);
      else if (chosen.size > 1) chosen.delete(column.name);
      this.state.columns = names.filter((name) => chosen.has(name));
      this.changed();
    });
    label.append(box, ` ${column.name}`);
    label.title = column.unit ? `${column.name} in ${column.unit}` : column.name;
    return label;
  }

  /** Make or renew a text column of labels. @param {string} name @param {Record<string, string>} byKey */
  setLabels(name, byKey) {
    const texts = this.table.keys.map((key) => byKey[key] ?? "");
    const made = columnOf({ name, kind: "text", role: "manual", unit: "", group: "labels", texts });
    const old = this.table.byName.get(name);
    if (old && old.role !== "manual") return; // a state of another table names it
    if (old) Object.assign(old, made, textColumn(texts));
    else {
      this.table.columns.push(made);
      this.table.byName.set(name, made);
    }
    this.matrix?.forget(name);
  }

  /** Name of the column of labels: one that the table has not from elsewhere. */
  labelName() {
    const taken = (/** @type {string} */ name) => (this.table.byName.get(name)?.role ?? "manual") !== "manual";
    let name = "label";
    for (let number = 2; taken(name); number++) name = `label_${number}`;
    return name;
  }

  /** Label the selected rows. @param {string} text @param {string} [name] */
  label(text, name = this.labelName()) {
    const old = this.table.byName.get(name);
    if (old && old.role !== "manual") throw new Error(`${name} is not a column of labels`);
    const keys = rowsOf(this.state.selection).map((row) => this.table.keys[row]);
    const byKey = { ...this.state.labels[name] };
    for (const key of keys) {
      if (text) byKey[key] = text;
      else delete byKey[key];
    }
    this.state.labels[name] = byKey;
    this.setLabels(name, byKey);
    this.state.color = name;
    this.variables();
    this.changed();
    if (this.table.live) this.serve("label", { name, values: Object.fromEntries(keys.map((key) => [key, text || null])) });
    return keys.length;
  }

  /** The whole table with labels as CSV; like data.csv, with an apostrophe before a text that could be a formula or a number. */
  csv() {
    const columns = this.table.columns.filter((column) => column.values);
    const quoted = (/** @type {string} */ text) => (/[",\n\r]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text);
    const harmless = (/** @type {string} */ text) => quoted(/^[=+\-@\t\r\n']/.test(text) ? `'${text}` : text);
    const asText = (/** @type {string} */ text) => (NUMBER.test(text) ? quoted(`'${text}`) : harmless(text));
    const cell = (/** @type {any} */ column, /** @type {number} */ row) =>
      column.kind === "text" ? asText(shown(column, row)) : digits(column.values[row]);
    let mark = "selected";
    for (let number = 2; this.table.byName.has(mark); number++) mark = `selected_${number}`;
    const lines = [["key", ...columns.map((c) => harmless(c.name)), mark].join(",")];
    for (let row = 0; row < this.table.count; row++) {
      lines.push([harmless(this.table.keys[row]), ...columns.map((c) => cell(c, row)), this.state.selection[row]].join(","));
    }
    return `${lines.join("\n")}\n`;
  }

  /** The selection as a region of interest. */
  region() {
    const name = input("label-text").value.trim() || "region";
    return regionAround(this.table, rowsOf(this.state.selection), name);
  }

  /** Use the region around the selection, if there is one. @param {(region: any) => void} work */
  aroundSelection(work) {
    if (this.state.selected) work(this.region());
    else element("status").textContent = "Select points first; the region is the smallest one around them.";
  }

  /** Ask the server and say what came of it. @param {string} action @param {any} content */
  async serve(action, content) {
    const status = element("status");
    status.textContent = `${action} …`;
    try {
      const said = await ask(action, content);
      status.textContent = said.message ?? "done";
      if (said.reload) location.reload();
    } catch (error) {
      status.textContent = String(error instanceof Error ? error.message : error);
    }
  }

  controls() {
    const click = (/** @type {string} */ id, /** @type {() => void} */ work) => element(id).addEventListener("click", work);
    const { state } = this;
    for (const view of ["matrix", "parallel", "table"]) click(`view-${view}`, () => { state.view = view; this.changed(); });
    for (const tool of ["box", "lasso"]) click(`tool-${tool}`, () => { state.tool = tool; this.changed(); });
    for (const operation of ["replace", "union", "intersection", "difference"]) {
      click(`op-${operation}`, () => { state.operation = /** @type {any} */ (operation); this.changed(); });
    }
    click("clear", () => this.clear());
    click("invert", () => this.invert());
    click("theme", () => {
      state.theme = isDark() ? "light" : "dark";
      this.changed();
    });
    click("menu", () => element("side").classList.toggle("open"));
    click("label", () => {
      element("status").textContent = state.selected
        ? `${counted(this.label(input("label-text").value.trim()), "row")} labeled in ${state.color}`
        : "Select points first; the label is written on them.";
    });
    click("export-csv", () => download("table.csv", this.csv(), "text/csv"));
    click("export-region", () => this.aroundSelection((region) => download("region.toml", tomlOf(region), "application/toml")));
    click("export-state", () => download("state.json", JSON.stringify(toPlain(state, this.table), null, 1), "application/json"));
    input("open-state").addEventListener("change", async () => {
      const file = input("open-state").files?.[0];
      if (!file) return;
      try {
        const plain = JSON.parse(await file.text());
        fromPlain(state, plain, this.table);
        for (const [name, byKey] of Object.entries(state.labels)) this.setLabels(name, byKey);
        const lost = fromPlain(state, plain, this.table);
        this.variables();
        this.changed();
        element("status").textContent = lost.length ? `not in this table: ${lost.join(", ")}` : "";
      } catch (error) {
        element("status").textContent = `this file holds no state: ${error}`;
      }
    });
    element("color").addEventListener("change", (event) => {
      state.color = /** @type {HTMLSelectElement} */ (event.target).value;
      this.changed();
    });
    element("live").hidden = !this.table.live;
    if (!this.table.live) return;
    click("live-sample", () => this.aroundSelection((region) => this.serve("sample", { region, budget: Number(input("live-budget").value) })));
    click("live-refine", () => this.serve("refine", {}));
    click("live-render", () => this.serve("render", {}));
    click("live-derive", () => this.serve("derive", { name: input("live-name").value, expression: input("live-expression").value }));
    click("live-distance", () => this.distance());
    click("live-apply", () => {
      const picked = state.compare.at(-1);
      if (picked === undefined) element("status").textContent = "Click a point first; the scene is set to it.";
      else this.serve("apply", { key: this.table.keys[picked] });
    });
  }

  /** Ask for the distances of all rows to the point that was picked last. */
  distance() {
    const picked = this.state.compare.at(-1);
    const words = input("live-weights").value.trim().split(/[\s,]+/).filter((word) => word);
    const weights = Object.fromEntries(words.map((word) => {
      const [name, number] = word.split("=");
      return [name, number === undefined || number === "" ? 1 : Number(number)];
    }));
    if (picked === undefined) element("status").textContent = "Click a point first; distances are measured from it.";
    else this.serve("distance", { key: this.table.keys[picked], weights, p: Number(input("live-norm").value), name: "distance" });
  }

  clear() {
    this.state.selection.fill(0);
    this.state.selected = false;
    this.changed();
  }

  invert() {
    this.state.selection.forEach((bit, i) => (this.state.selection[i] = 1 - bit));
    this.state.selected = size(this.state.selection) > 0;
    this.changed();
  }

  /** Keys: v views, b and l tools, 1 to 4 operations, a all, i invert, Escape clear, arrows walk, Enter picks. */
  keys() {
    const views = ["matrix", "parallel", "table"];
    const operations = ["replace", "union", "intersection", "difference"];
    document.addEventListener("keydown", (event) => {
      if (takesKeys(/** @type {HTMLElement} */ (event.target)) || event.ctrlKey || event.metaKey || event.altKey) return;
      const { state } = this;
      const operation = operations["1234".indexOf(event.key)];
      if (event.key === "Escape") this.clear();
      else if (event.key === "i") this.invert();
      else if (event.key === "a") { state.selection.fill(1); state.selected = true; this.changed(); }
      else if (event.key === "v") { state.view = views[(views.indexOf(state.view) + 1) % 3]; this.changed(); }
      else if (event.key === "b" || event.key === "l") { state.tool = event.key === "b" ? "box" : "lasso"; this.changed(); }
      else if (operation) { state.operation = /** @type {any} */ (operation); this.changed(); }
      else if (event.key === "ArrowRight" || event.key === "ArrowLeft") this.walk(event.key === "ArrowRight" ? 1 : -1);
      else if (event.key === "Enter" && state.hover >= 0 && document.activeElement === this.matrix.canvas) this.pick(state.hover);
      else return;
      event.preventDefault();
    });
  }

  /** Go to the next row, among the selected ones where some are. @param {number} step */
  walk(step) {
    const inTable = this.state.view === "table"; // there, in the order of the table
    const all = this.state.selected ? rowsOf(this.state.selection) : [...Array(this.table.count).keys()];
    const rows = inTable ? this.list.rows : all;
    if (!rows.length) return;
    // from the point under the pointer, else from the one picked last, else from the end where the way begins
    const from = inTable || this.state.hover < 0 ? this.state.compare.at(-1) ?? -1 : this.state.hover;
    const at = rows.indexOf(from);
    const next = rows[at < 0 && step < 0 ? rows.length - 1 : (at + step + rows.length) % rows.length];
    if (inTable) this.state.hover = next; // the row is marked; the card would cover others
    else this.hover(next, window.innerWidth / 2, 80);
    this.pick(next);
    if (inTable) this.list.reveal(next);
  }
}

/** True if an element has its own use for keys: all but a checkbox, which takes the space bar alone. @param {HTMLElement} target */
function takesKeys(target) {
  return target.matches?.("input:not([type=checkbox]), select, textarea") ?? false;
}

function isDark() {
  return getComputedStyle(document.documentElement).getPropertyValue("color-scheme").includes("dark");
}

/** Offer a text as a file. @param {string} name @param {string} text @param {string} kind */
function download(name, text, kind) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([text], { type: kind }));
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}

try {
  /** @type {any} */ (window).explorer = new Explorer();
} catch (error) {
  element("status").replaceChildren(note(`The page cannot be shown: ${error}`));
  throw error;
}

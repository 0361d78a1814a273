// SPDX-License-Identifier: GPL-3.0-or-later
// The table view: only the rows in sight are in the page. Texts are set as text, so nothing in them is ever markup.

import { counted, shown } from "./data.js";
import { note } from "./pictures.js";

const ROW = 24;
/** Room for the bar that moves the table sideways, and for the margins. */
const BAR = 40;
/** Most rows on paper. */
const MOST_PRINTED = 1000;

/** Draws the rows in sight and hears clicks. */
export class List {
  /**
   * @param {HTMLElement} host @param {import("./data.js").Table} table @param {import("./state.js").State} state
   * @param {{pick: (row: number) => void, sorted: () => void}} on
   */
  constructor(host, table, state, on) {
    this.host = host;
    this.table = table;
    this.state = state;
    this.on = on;
    /** @type {number[]} */
    this.rows = [];
    this.head = document.createElement("div");
    this.head.className = "row head";
    this.body = document.createElement("div");
    this.body.className = "rows";
    this.body.tabIndex = 0;
    this.space = document.createElement("div");
    this.body.append(this.space);
    host.append(this.head, this.body);
    this.body.addEventListener("scroll", () => {
      this.head.scrollLeft = this.body.scrollLeft;
      this.fill();
    });
  }

  /** Order the rows: selected ones only where some are, by the column that was clicked. */
  draw() {
    const { table, state } = this;
    /** @type {number[]} */
    const rows = [];
    for (let i = 0; i < table.count; i++) if (!state.selected || state.selection[i]) rows.push(i);
    const column = table.byName.get(state.sort.column);
    if (column && column.values) {
      const values = column.values;
      const sign = state.sort.down ? -1 : 1;
      rows.sort((a, b) => (Number.isNaN(values[a]) ? 1 : Number.isNaN(values[b]) ? -1 : sign * (values[a] - values[b])));
    }
    this.rows = rows;
    this.head.replaceChildren(...table.columns.filter((c) => c.values).map((c) => this.headCell(c)));
    this.space.style.height = `${rows.length * ROW}px`;
    this.space.style.width = `${table.columns.length * 110}px`;
    // a short table ends after its last row: on a phone an empty area would follow before the selection
    this.host.style.height = "";
    if (state.paper) return this.print();
    const needed = this.head.offsetHeight + rows.length * ROW + BAR;
    if (needed < this.host.getBoundingClientRect().height) this.host.style.height = `${needed}px`;
    this.fill();
  }

  /** @param {import("./data.js").Column} column */
  headCell(column) {
    const cell = document.createElement("button");
    const arrow = this.state.sort.column === column.name ? (this.state.sort.down ? " ▼" : " ▲") : "";
    cell.textContent = column.name + arrow;
    cell.title = `${column.name}${column.unit ? ` in ${column.unit}` : ""}: sort`;
    cell.addEventListener("click", () => {
      const same = this.state.sort.column === column.name;
      this.state.sort = { column: column.name, down: same && !this.state.sort.down };
      this.on.sorted();
    });
    return cell;
  }

  fill() {
    if (this.state.paper) return;
    const first = Math.max(0, Math.floor(this.body.scrollTop / ROW) - 5);
    const last = Math.min(this.rows.length, first + Math.ceil(this.body.clientHeight / ROW) + 10);
    const lines = [];
    for (let k = first; k < last; k++) {
      const line = this.line(this.rows[k]);
      line.style.top = `${k * ROW}px`;
      lines.push(line);
    }
    this.space.replaceChildren(...lines);
  }

  /** All rows one below the other: paper does not scroll. */
  print() {
    const lines = this.rows.slice(0, MOST_PRINTED).map((row) => this.line(row));
    const more = this.rows.length - lines.length;
    if (more > 0) lines.push(note(`${counted(more, "further row")} ${more === 1 ? "is" : "are"} in the file of the button Table (CSV).`));
    this.space.replaceChildren(...lines);
  }

  /** Move the table until a row is in sight. @param {number} row */
  reveal(row) {
    const top = this.rows.indexOf(row) * ROW;
    const room = this.body.clientHeight - ROW;
    this.body.scrollTop = Math.max(top - room, Math.min(this.body.scrollTop, top));
    this.fill();
  }

  /** The cells of a row. @param {number} row */
  line(row) {
    const line = document.createElement("div");
    line.className = this.state.compare.includes(row) ? "row picked" : "row";
    for (const column of this.table.columns) {
      if (!column.values) continue;
      const cell = document.createElement("span");
      cell.textContent = shown(column, row);
      line.append(cell);
    }
    line.addEventListener("click", () => this.on.pick(row));
    return line;
  }
}

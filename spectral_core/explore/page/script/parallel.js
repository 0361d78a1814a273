// SPDX-License-Identifier: GPL-3.0-or-later
// Parallel axes: one vertical axis per variable, one line per row; a drag along an axis selects a range.

import { MISSING, css, distinct, mapped, rowColors } from "./colors.js";
import { shortened, ticks } from "./scales.js";
import { inInterval } from "./selection.js";

const BINS = 56;
const MOST_LINES = 4000;
/** Half the length of the mark of a value from which no line goes to a neighboring axis. */
const MARK = 4;

/** Draws the axes and hears the pointer. */
export class Parallel {
  /**
   * @param {HTMLElement} host @param {import("./data.js").Table} table @param {import("./state.js").State} state
   * @param {{select: (mask: Uint8Array) => void, positions: (name: string) => Float32Array}} on
   */
  constructor(host, table, state, on) {
    this.host = host;
    this.table = table;
    this.state = state;
    this.on = on;
    this.canvas = document.createElement("canvas");
    this.canvas.setAttribute("role", "img");
    this.canvas.setAttribute("aria-label", "Parallel axes. Drag along an axis to select a range.");
    host.append(this.canvas);
    this.width = 0;
    this.height = 0;
    /** @type {{axis: number, from: number, to: number}|null} */
    this.drag = null;
    /** The pointer that drags. */
    this.pointer = -1;
    this.listen();
  }

  /** Place of an axis. @param {number} k */
  axisX(k) {
    const count = this.state.columns.length;
    return 50 + (count > 1 ? (k * (this.width - 100)) / (count - 1) : 0);
  }

  /** Height of a position on the axes. @param {number} at */
  axisY(at) {
    return 30 + (1 - at) * (this.height - 60);
  }

  /** Paint everything. */
  draw() {
    const room = this.host.getBoundingClientRect();
    const ratio = this.state.paper ? 2 : Math.min(window.devicePixelRatio || 1, 2);
    this.width = Math.max(room.width - 4, 100 * Math.min(this.state.columns.length, 3));
    this.height = Math.max(room.height - 4, 260);
    this.canvas.width = this.width * ratio;
    this.canvas.height = this.height * ratio;
    this.canvas.style.width = `${this.width}px`;
    this.canvas.style.height = `${this.height}px`;
    const context = /** @type {CanvasRenderingContext2D} */ (this.canvas.getContext("2d"));
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    const style = getComputedStyle(document.documentElement);
    const ink = (/** @type {string} */ name) => style.getPropertyValue(name).trim();
    const mask = this.state.selected ? this.state.selection : null;
    const at = this.state.columns.map((name) => this.on.positions(name));
    if (this.table.count > MOST_LINES) this.binned(context, at, mask, ink);
    else this.lines(context, at, mask, ink);
    this.axes(context, ink);
  }

  /** @param {CanvasRenderingContext2D} context @param {Float32Array[]} at @param {Uint8Array|null} mask @param {(n: string) => string} ink */
  lines(context, at, mask, ink) {
    const column = this.table.byName.get(this.state.color);
    const color = column ? this.on.positions(column.name) : null;
    context.lineWidth = 1;
    for (const chosen of mask ? [0, 1] : [1]) {
      context.globalAlpha = Math.max(0.12, Math.min(0.8, (mask ? 150 : 300) / this.table.count)) * (chosen ? 1 : 0.5);
      for (let i = 0; i < this.table.count; i++) {
        if (mask && mask[i] !== chosen) continue;
        if (!chosen) context.strokeStyle = ink("--faint");
        else if (!color || !column) context.strokeStyle = ink("--accent");
        else if (Number.isNaN(color[i])) context.strokeStyle = css(MISSING);
        else context.strokeStyle = css(column.kind === "text" ? distinct(/** @type {any} */ (column.values)[i]) : mapped(color[i]));
        context.beginPath();
        const isKnown = (/** @type {number} */ k) => k >= 0 && k < at.length && !Number.isNaN(at[k][i]);
        for (let k = 0; k < at.length; k++) {
          if (!isKnown(k)) continue;
          const [x, y] = [this.axisX(k), this.axisY(at[k][i])];
          if (isKnown(k - 1)) context.lineTo(x, y);
          else if (isKnown(k + 1)) context.moveTo(x, y);
          else this.mark(context, x, y);
        }
        context.stroke();
      }
    }
    context.globalAlpha = 1;
  }

  /** A value without a line to a neighboring axis. @param {CanvasRenderingContext2D} context @param {number} x @param {number} y */
  mark(context, x, y) {
    context.moveTo(x - MARK, y);
    context.lineTo(x + MARK, y);
  }

  /** Many rows as bundles between bins of neighboring axes. @param {CanvasRenderingContext2D} context @param {Float32Array[]} at @param {Uint8Array|null} mask @param {(n: string) => string} ink */
  binned(context, at, mask, ink) {
    const column = this.table.byName.get(this.state.color);
    const words = column ? rowColors(column, this.on.positions(column.name), this.table.count) : null;
    const [faint, accent] = ["--faint", "--accent"].map(ink);
    for (let k = 0; k < at.length; k++) {
      for (const chosen of mask ? [false, true] : [true]) {
        const { counts, sums } = bundles(at, k, chosen ? mask : null, chosen ? words : null);
        const most = counts.reduce((x, y) => Math.max(x, y), 1);
        counts.forEach((count, place) => {
          if (!count) return;
          const mean = () => css([0, 1, 2].map((c) => Math.round(sums[3 * place + c] / count)));
          context.strokeStyle = !chosen ? faint : words ? mean() : accent;
          context.globalAlpha = 0.08 + 0.8 * (count / most);
          const next = place % (BINS + 1);
          const [from, to] = [Math.floor(place / (BINS + 1)), next].map((bin) => this.axisY((bin + 0.5) / BINS));
          context.beginPath();
          if (next === BINS) this.mark(context, this.axisX(k), from);
          else {
            context.moveTo(this.axisX(k), from);
            context.lineTo(this.axisX(k + 1), to);
          }
          context.stroke();
        });
      }
    }
    context.globalAlpha = 1;
  }

  /** @param {CanvasRenderingContext2D} context @param {(n: string) => string} ink */
  axes(context, ink) {
    context.font = "11px system-ui, sans-serif";
    this.state.columns.forEach((name, k) => {
      const column = /** @type {import("./data.js").Column} */ (this.table.byName.get(name));
      const x = this.axisX(k);
      context.strokeStyle = ink("--ink");
      context.beginPath();
      context.moveTo(x, this.axisY(0));
      context.lineTo(x, this.axisY(1));
      context.stroke();
      context.fillStyle = ink("--ink");
      context.textAlign = "center";
      context.fillText(shortened(name, 16), x, k % 2 ? 26 : 13);
      context.fillStyle = ink("--quiet");
      context.textAlign = "right";
      context.lineWidth = 3;
      context.strokeStyle = ink("--ground");
      for (const tick of ticks(column, 5)) {
        const text = shortened(tick.text, 12);
        context.strokeText(text, x - 5, this.axisY(tick.at) + 4);
        context.fillText(text, x - 5, this.axisY(tick.at) + 4);
      }
      context.lineWidth = 1;
    });
    if (this.drag) {
      context.fillStyle = ink("--accent");
      context.globalAlpha = 0.35;
      context.fillRect(this.axisX(this.drag.axis) - 8, this.drag.from, 16, this.drag.to - this.drag.from);
      context.globalAlpha = 1;
    }
  }

  listen() {
    const place = (/** @type {PointerEvent} */ event) => {
      const box = this.canvas.getBoundingClientRect();
      return [event.clientX - box.left, event.clientY - box.top];
    };
    this.canvas.addEventListener("pointerdown", (event) => {
      if (event.button || this.drag) return; // a menu's button, or a second finger
      this.pointer = event.pointerId;
      const [x, y] = place(event);
      const near = this.state.columns.map((_, k) => Math.abs(this.axisX(k) - x));
      const axis = near.indexOf(Math.min(...near));
      if (near[axis] >= 40) return;
      this.drag = { axis, from: y, to: y };
      try {
        this.canvas.setPointerCapture(event.pointerId); // the drag may end outside
      } catch {
        // a scripted event has no pointer to capture
      }
    });
    for (const kind of /** @type {const} */ (["pointercancel", "lostpointercapture"])) {
      this.canvas.addEventListener(kind, (event) => {
        if (!this.drag || event.pointerId !== this.pointer) return;
        this.drag = null;
        this.draw();
      });
    }
    this.canvas.addEventListener("pointermove", (event) => {
      if (!this.drag || event.pointerId !== this.pointer) return;
      this.drag.to = place(event)[1];
      this.draw();
    });
    this.canvas.addEventListener("pointerup", (event) => {
      if (event.pointerId !== this.pointer) return;
      const drag = this.drag;
      this.drag = null;
      if (!drag) return;
      if (Math.abs(drag.to - drag.from) < 4) {
        this.on.select(new Uint8Array(this.table.count));
        return;
      }
      const ends = [drag.from, drag.to].map((y) => 1 - (y - 30) / (this.height - 60)).sort((a, b) => a - b);
      this.on.select(inInterval(this.on.positions(this.state.columns[drag.axis]), ends[0], ends[1]));
    });
  }
}

/**
 * Rows by their bins on an axis and on the next: how many, and the sums of their colors. The last bin of the next axis
 * has the rows from which no line goes to a neighboring axis.
 * @param {Float32Array[]} at @param {number} k @param {Uint8Array|null} mask @param {Uint32Array|null} words
 */
export function bundles(at, k, mask, words) {
  const counts = new Uint32Array(BINS * (BINS + 1));
  const sums = new Float64Array(words ? 3 * counts.length : 0);
  const isKnown = (/** @type {number|undefined} */ place) => place !== undefined && place >= 0 && place <= 1;
  const binOf = (/** @type {number} */ place) => Math.min(BINS - 1, (place * BINS) | 0);
  for (let i = 0; i < at[k].length; i++) {
    const goesOn = isKnown(at[k + 1]?.[i]);
    if (!isKnown(at[k][i]) || (!goesOn && isKnown(at[k - 1]?.[i])) || (mask && !mask[i])) continue;
    const place = binOf(at[k][i]) * (BINS + 1) + (goesOn ? binOf(at[k + 1][i]) : BINS);
    counts[place]++;
    if (words) for (let c = 0; c < 3; c++) sums[3 * place + c] += (words[i] >>> (8 * c)) & 255;
  }
  return { counts, sums };
}

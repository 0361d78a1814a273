// SPDX-License-Identifier: GPL-3.0-or-later
// The scatter-plot matrix: lower triangle of plots, histograms on the diagonal, box and lasso over any plot.

import { rowColors, word } from "./colors.js";
import { drawHistogram, drawPoints } from "./raster.js";
import { barsOf, positions, shortened, ticks } from "./scales.js";
import { inPolygon } from "./selection.js";

/**
 * @typedef {{row: number, column: number, left: number, top: number, width: number, height: number}} Panel
 * In pixels of the style sheet. `row` and `column` count variables; equal on the diagonal.
 */

const GAP = 10;
/** Room for the ticks on the left; more if their numbers need it, up to the second. */
const LEFT = 58;
const MOST_LEFT = 130;
const BOTTOM = 40;
const TOP = 6;
const RIGHT = 8;
const NEAR = 14;
const FONT = "11px system-ui, sans-serif";

/** Draws the matrix and hears the pointer. */
export class Matrix {
  /**
   * @param {HTMLElement} host @param {import("./data.js").Table} table @param {import("./state.js").State} state
   * @param {{select: (mask: Uint8Array) => void, hover: (row: number, x: number, y: number) => void, pick: (row: number) => void}} on
   */
  constructor(host, table, state, on) {
    this.host = host;
    this.table = table;
    this.state = state;
    this.on = on;
    this.canvas = document.createElement("canvas");
    this.canvas.tabIndex = 0;
    this.canvas.setAttribute("role", "img");
    this.canvas.setAttribute("aria-label", "Scatter-plot matrix. Drag to select; left and right arrow move from point to point.");
    host.append(this.canvas);
    /** @type {Panel[]} */
    this.panels = [];
    /** @type {Map<string, Float32Array>} */
    this.at = new Map();
    /** @type {number[][]} */
    this.path = [];
    /** @type {Panel|null} */
    this.active = null;
    /** The pointer that drags. */
    this.pointer = -1;
    this.left = LEFT;
    this.listen();
  }

  /** Position of every row on a variable's axis. @param {string} name */
  positions(name) {
    let found = this.at.get(name);
    if (!found) {
      found = positions(/** @type {any} */ (this.table.byName.get(name)));
      this.at.set(name, found);
    }
    return found;
  }

  /** Forget positions of a column that changed. @param {string} name */
  forget(name) {
    this.at.delete(name);
  }

  /** Place the panels in the available room. */
  layout() {
    const count = this.state.columns.length;
    this.host.style.height = "";
    const room = this.host.getBoundingClientRect();
    const down = (Math.max(room.height, 240) - BOTTOM - TOP - GAP * (count - 1)) / count;
    const across = () => Math.max(36, Math.floor((room.width - this.left - RIGHT - GAP * (count - 1)) / count));
    const high = () => Math.max(36, Math.floor(Math.min(down, across() * 1.2)));
    this.left = LEFT;
    this.left = this.roomForNumbers(high());
    const width = across();
    const height = high();
    this.panels = [];
    for (let row = 0; row < count; row++) {
      for (let column = 0; column <= row; column++) {
        this.panels.push({ row, column, left: this.left + column * (width + GAP), top: TOP + row * (height + GAP), width, height });
      }
    }
    this.width = this.left + count * (width + GAP) - GAP + RIGHT;
    this.height = TOP + count * (height + GAP) + BOTTOM - GAP;
    this.ratio = this.state.paper ? 2 : Math.min(window.devicePixelRatio || 1, 2);
    this.canvas.width = Math.round(this.width * this.ratio);
    this.canvas.height = Math.round(this.height * this.ratio);
    this.canvas.style.width = `${this.width}px`;
    this.canvas.style.height = `${this.height}px`;
    // on a phone the width limits the panels: without this, an empty area would follow below them
    if (this.height < room.height && this.width <= room.width) this.host.style.height = `${this.height}px`;
  }

  /** Width of the left margin: a number on an axis has all its digits. @param {number} height of a panel */
  roomForNumbers(height) {
    const context = /** @type {CanvasRenderingContext2D} */ (this.canvas.getContext("2d"));
    context.font = FONT;
    const shown = this.state.columns.slice(1).map((name) => this.table.byName.get(name)).filter((column) => column?.kind === "number");
    const widths = shown.flatMap((column) => upward(/** @type {any} */ (column), height).map((tick) => context.measureText(tick.text).width));
    return Math.min(MOST_LEFT, widths.reduce((most, one) => Math.max(most, Math.ceil(one) + 8), LEFT));
  }

  /** Paint everything. */
  draw() {
    this.layout();
    const context = /** @type {CanvasRenderingContext2D} */ (this.canvas.getContext("2d"));
    const style = getComputedStyle(document.documentElement);
    const ink = (/** @type {string} */ name) => style.getPropertyValue(name).trim();
    const image = context.createImageData(this.canvas.width, this.canvas.height);
    const pixels = new Uint32Array(image.data.buffer);
    this.points(pixels, ink);
    context.putImageData(image, 0, 0);
    this.frames(context, ink);
    this.base = null;
  }

  /** @param {Uint32Array} pixels @param {(name: string) => string} ink */
  points(pixels, ink) {
    const { state, table } = this;
    const column = table.byName.get(state.color);
    const colors = rowColors(column, column ? this.positions(column.name) : null, table.count);
    const ground = word(numbers(ink("--panel")));
    const bars = [word(numbers(ink("--faint"))), word(numbers(ink("--accent")))];
    const mask = state.selected ? state.selection : null;
    const gray = new Uint32Array(table.count).fill(word(numbers(ink("--faint"))));
    const load = table.count * this.panels.length;
    const radius = table.count > 20000 || load > 600000 ? 1 : (table.count > 3000 ? 0.9 : table.count > 1000 ? 1.3 : table.count > 300 ? 2 : 2.8) * (this.ratio ?? 1);
    for (const panel of this.panels) {
      const scaled = this.scaled(panel);
      for (let y = scaled.top; y < scaled.top + scaled.height; y++) {
        pixels.fill(ground, y * this.canvas.width + scaled.left, y * this.canvas.width + scaled.left + scaled.width);
      }
      const x = this.positions(state.columns[panel.column]);
      if (panel.row === panel.column) {
        const shown = /** @type {import("./data.js").Column} */ (table.byName.get(state.columns[panel.column]));
        const most = Math.max(6, Math.min(40, Math.floor(scaled.width / 6)));
        drawHistogram(pixels, this.canvas.width, scaled, x, mask, bars, barsOf(shown, most));
        continue;
      }
      const y = this.positions(state.columns[panel.row]);
      const margin = Math.ceil(radius) + 1;
      const inner = { left: scaled.left + margin, top: scaled.top + margin, width: scaled.width - 2 * margin, height: scaled.height - 2 * margin };
      if (mask) {
        drawPoints(pixels, this.canvas.width, inner, x, y, gray, null, { radius, fade: 1 });
        drawPoints(pixels, this.canvas.width, inner, x, y, colors, mask, { radius, fade: 1 });
      } else {
        drawPoints(pixels, this.canvas.width, inner, x, y, colors, null, { radius, fade: table.count > 20000 ? 0.8 : 1 });
      }
    }
  }

  /** A panel in pixels of the canvas. @param {Panel} panel */
  scaled(panel) {
    const ratio = this.ratio ?? 1;
    return {
      left: Math.round(panel.left * ratio), top: Math.round(panel.top * ratio),
      width: Math.round(panel.width * ratio), height: Math.round(panel.height * ratio),
    };
  }

  /** Frames, ticks, names. @param {CanvasRenderingContext2D} context @param {(name: string) => string} ink */
  frames(context, ink) {
    const ratio = this.ratio ?? 1;
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.font = FONT;
    context.strokeStyle = ink("--line");
    context.fillStyle = ink("--quiet");
    const count = this.state.columns.length;
    for (const panel of this.panels) {
      context.strokeRect(panel.left + 0.5, panel.top + 0.5, panel.width - 1, panel.height - 1);
      const column = /** @type {import("./data.js").Column} */ (this.table.byName.get(this.state.columns[panel.column]));
      const row = /** @type {import("./data.js").Column} */ (this.table.byName.get(this.state.columns[panel.row]));
      if (panel.row === panel.column) {
        context.fillStyle = ink("--ink");
        context.textAlign = "left";
        context.font = `600 ${FONT}`;
        context.fillText(fitted(context, column.name, panel.width - 8), panel.left + 4, panel.top + 13);
        context.font = FONT;
        context.fillStyle = ink("--quiet");
        if (column.unit && panel.height > 44) context.fillText(fitted(context, column.unit, panel.width - 8), panel.left + 4, panel.top + 26);
      }
      if (panel.row === count - 1) this.across(context, panel, column);
      if (panel.column === 0 && panel.row > 0) this.up(context, panel, row);
    }
    context.setTransform(1, 0, 0, 1, 0, 0);
  }

  /** @param {CanvasRenderingContext2D} context @param {Panel} panel @param {import("./data.js").Column} column */
  across(context, panel, column) {
    context.textAlign = "center";
    const wanted = Math.max(3, Math.floor(panel.width / 42));
    let shown = this.beside(context, panel, column, wanted);
    // one tick tells no scale: of finer ticks two that are farther apart may have room
    for (let more = 2 * wanted; shown.length < 2 && more <= 8 * wanted; more *= 2) {
      const finer = this.beside(context, panel, column, more);
      if (finer.length > 1) shown = finer;
    }
    for (const { text, x } of shown) context.fillText(text, x, panel.top + panel.height + 13);
  }

  /**
   * Texts below a panel, without those that would touch the one before them.
   * @param {CanvasRenderingContext2D} context @param {Panel} panel @param {import("./data.js").Column} column @param {number} wanted
   */
  beside(context, panel, column, wanted) {
    const found = [];
    let end = -Infinity;
    for (const tick of ticks(column, wanted)) {
      const text = column.kind === "text" ? fitted(context, tick.text, panel.width / 2) : tick.text;
      const half = context.measureText(text).width / 2;
      // a text at the end of an axis stays out of the next panel's
      const low = panel.left - GAP / 2 + half + 1;
      const x = Math.max(low, Math.min(panel.left + tick.at * panel.width, panel.left + panel.width + GAP / 2 - half - 1));
      if (x - half < end + 4) continue;
      end = x + half;
      found.push({ text, x });
    }
    return found;
  }

  /** @param {CanvasRenderingContext2D} context @param {Panel} panel @param {import("./data.js").Column} row */
  up(context, panel, row) {
    context.textAlign = "right";
    let last = Infinity;
    for (const tick of upward(row, panel.height)) {
      const y = panel.top + (1 - tick.at) * panel.height;
      if (last - y < 12) continue;
      last = y;
      context.fillText(fitted(context, tick.text, this.left - 8), panel.left - 5, Math.min(Math.max(y + 4, panel.top + 9), panel.top + panel.height));
    }
  }

  /** The panel under a place of the canvas. @param {number} x @param {number} y */
  panelAt(x, y) {
    return this.panels.find((p) => x >= p.left && x < p.left + p.width && y >= p.top && y < p.top + p.height) ?? null;
  }

  /** Nearest row to a place, -1 where none is near. @param {Panel} panel @param {number} x @param {number} y */
  rowAt(panel, x, y) {
    if (panel.row === panel.column) return -1;
    const across = this.positions(this.state.columns[panel.column]);
    const up = this.positions(this.state.columns[panel.row]);
    const u = (x - panel.left) / panel.width;
    const v = 1 - (y - panel.top) / panel.height;
    let best = -1;
    let least = NEAR * NEAR;
    for (let i = 0; i < across.length; i++) {
      const dx = (across[i] - u) * panel.width;
      const dy = (up[i] - v) * panel.height;
      const far = dx * dx + dy * dy;
      if (far < least) {
        least = far;
        best = i;
      }
    }
    return best;
  }

  /** Select what a closed path in a panel holds. @param {Panel} panel @param {number[][]} path in pixels of the canvas */
  choose(panel, path) {
    const x = this.positions(this.state.columns[panel.column]);
    const polygon = path.map(([a, b]) => [(a - panel.left) / panel.width, 1 - (b - panel.top) / panel.height]);
    if (panel.row === panel.column) {
      const low = Math.min(...polygon.map(([a]) => a));
      const high = Math.max(...polygon.map(([a]) => a));
      this.on.select(inPolygon(x, new Float32Array(x.length).fill(0.5), [[low, 0], [high, 0], [high, 1], [low, 1]]));
      return;
    }
    this.on.select(inPolygon(x, this.positions(this.state.columns[panel.row]), polygon));
  }

  listen() {
    const canvas = this.canvas;
    const place = (/** @type {PointerEvent} */ event) => {
      const box = canvas.getBoundingClientRect();
      return [event.clientX - box.left, event.clientY - box.top];
    };
    canvas.addEventListener("pointerdown", (event) => {
      if (event.button || this.active) return; // a menu's button, or a second finger
      this.pointer = event.pointerId;
      const [x, y] = place(event);
      this.active = this.panelAt(x, y);
      if (!this.active) return;
      try {
        canvas.setPointerCapture(event.pointerId);
      } catch {
        // a scripted event has no pointer to capture
      }
      this.path = [[x, y]];
    });
    canvas.addEventListener("pointermove", (event) => {
      if (this.active && event.pointerId !== this.pointer) return;
      const [x, y] = place(event);
      if (this.active) {
        this.path.push([x, y]);
        this.outline();
        return;
      }
      const panel = this.panelAt(x, y);
      this.on.hover(panel ? this.rowAt(panel, x, y) : -1, event.clientX, event.clientY);
    });
    canvas.addEventListener("pointerup", (event) => {
      if (event.pointerId !== this.pointer) return;
      const panel = this.active;
      this.active = null;
      if (!panel) return;
      const [x, y] = place(event);
      this.path.push([x, y]);
      const [x0, y0] = this.path[0];
      if (this.path.every(([a, b]) => Math.hypot(a - x0, b - y0) < 4)) {
        this.outline();
        const row = this.rowAt(panel, x, y);
        if (row >= 0) this.on.pick(row);
        else this.on.select(new Uint8Array(this.table.count));
        return;
      }
      const box = [[x0, y0], [x, y0], [x, y], [x0, y]];
      this.choose(panel, this.state.tool === "box" ? box : this.path);
    });
    for (const kind of /** @type {const} */ (["pointercancel", "lostpointercapture"])) {
      canvas.addEventListener(kind, (event) => {
        if (event.pointerId === this.pointer) this.active = null;
      });
    }
    canvas.addEventListener("pointerleave", () => this.on.hover(-1, 0, 0));
  }

  /** The box or lasso while it is drawn, over the painted matrix. */
  outline() {
    const context = /** @type {CanvasRenderingContext2D} */ (this.canvas.getContext("2d"));
    if (!this.base) this.base = context.getImageData(0, 0, this.canvas.width, this.canvas.height);
    context.putImageData(this.base, 0, 0);
    if (!this.active) return;
    const ratio = this.ratio ?? 1;
    const accent = getComputedStyle(document.documentElement).getPropertyValue("--accent").trim();
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.beginPath();
    const [x0, y0] = this.path[0];
    const [x, y] = this.path[this.path.length - 1];
    if (this.state.tool === "box") context.rect(x0, y0, x - x0, y - y0);
    else this.path.forEach(([a, b], i) => (i ? context.lineTo(a, b) : context.moveTo(a, b)));
    context.strokeStyle = accent;
    context.lineWidth = 1.5;
    context.globalAlpha = 0.15;
    context.fillStyle = accent;
    context.fill();
    context.globalAlpha = 1;
    context.stroke();
    context.setTransform(1, 0, 0, 1, 0, 0);
  }
}

/** Ticks of an upward axis. @param {import("./data.js").Column} column @param {number} height */
function upward(column, height) {
  return ticks(column, Math.max(2, Math.floor(height / 26)));
}

/** Red, green and blue of "rgb(1 2 3)" or "#rrggbb". @param {string} text */
export function numbers(text) {
  if (text.startsWith("#")) return [1, 3, 5].map((k) => parseInt(text.slice(k, k + 2), 16));
  return (text.match(/\d+/g) ?? ["0", "0", "0"]).slice(0, 3).map(Number);
}

/** A text shortened to a width. @param {CanvasRenderingContext2D} context @param {string} text @param {number} width */
function fitted(context, text, width) {
  let shown = text;
  for (let length = Math.min(text.length, 80); length > 1 && context.measureText(shown).width > width; length--) shown = shortened(text, length);
  return shown;
}


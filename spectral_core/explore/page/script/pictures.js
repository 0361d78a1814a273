// SPDX-License-Identifier: GPL-3.0-or-later
// Thumbnails from sprite sheets, full pictures by relative path, two of them side by side with their difference.

import { shown } from "./data.js";

/** A row's thumbnail as an element; null where there is none. @param {import("./data.js").Table} table @param {number} row */
export function thumbnail(table, row) {
  const sprites = table.thumbnails;
  if (!sprites || sprites.missing.includes(row)) return null;
  const sheet = Math.floor(row / sprites.perSheet);
  const place = row % sprites.perSheet;
  const box = document.createElement("div");
  box.className = "thumbnail";
  box.style.width = box.style.height = `${sprites.size}px`;
  box.style.backgroundImage = `url(${sprites.sheets[sheet]})`;
  box.style.backgroundPosition = `-${(place % sprites.perRow) * sprites.size}px -${Math.floor(place / sprites.perRow) * sprites.size}px`;
  return box;
}

/** Address of a row's full picture; "" where there is none or where it would lead elsewhere. @param {import("./data.js").Table} table @param {number} row @param {string} [column] */
export function pictureOf(table, row, column = "FILE") {
  const name = table.files.get(column)?.[row] ?? "";
  const parts = name.split("/");
  const inside = !/[\\:\p{Cc}]/u.test(name) && !parts.includes("") && !parts.includes("..");
  return inside && /\.(png|jpe?g|webp)$/i.test(name) ? parts.map(encodeURIComponent).join("/") : "";
}

/** Fill the card that follows the pointer. @param {HTMLElement} card @param {import("./data.js").Table} table @param {number} row @param {string[]} names */
export function fillCard(card, table, row, names) {
  const lines = names.map((name) => {
    const column = table.byName.get(name);
    const line = document.createElement("div");
    line.textContent = column ? `${name}: ${shown(column, row)}${column.unit ? ` ${column.unit}` : ""}` : "";
    return line;
  });
  const image = thumbnail(table, row);
  card.replaceChildren(...(image ? [image] : []), ...lines);
}

/** Two pictures over each other with a divider, and their difference. */
export class Compare {
  /** @param {HTMLElement} host @param {import("./data.js").Table} table @param {import("./state.js").State} state */
  constructor(host, table, state) {
    this.host = host;
    this.table = table;
    this.state = state;
    this.mode = "side";
    this.at = 50;
    this.gain = 4;
  }

  /** Show the rows that are picked. */
  draw() {
    const picked = this.state.compare.slice(-2);
    const rows = picked.filter((row) => pictureOf(this.table, row));
    if (picked.length && !rows.length) {
      this.host.replaceChildren(note(this.table.files.size ? "These points have no picture." : "This table has no pictures."), this.differences(picked));
      return;
    }
    if (!rows.length) {
      this.host.replaceChildren(note(this.table.files.size ? "Click a point to see its picture, a second one to compare." : "This table has no pictures."));
      return;
    }
    const buttons = document.createElement("div");
    buttons.className = "buttons";
    for (const [mode, text] of [["side", "Side by side"], ["swipe", "Swipe"], ["difference", "Difference"]]) {
      const button = document.createElement("button");
      button.textContent = text;
      button.setAttribute("aria-pressed", String(mode === this.mode));
      button.addEventListener("click", () => {
        this.mode = mode;
        this.draw();
      });
      if (rows.length === 2) buttons.append(button);
    }
    const stage = document.createElement("div");
    stage.className = `stage ${rows.length === 2 ? this.mode : "side"}`;
    for (const row of rows) {
      const image = document.createElement("img");
      image.src = pictureOf(this.table, row);
      image.alt = `picture of row ${row + 1}`;
      image.addEventListener("error", () => {
        image.replaceWith(thumbnail(this.table, row) ?? note(`The picture of row ${row + 1} was not found: ${this.table.files.get("FILE")?.[row]}`));
      });
      stage.append(image);
    }
    this.host.replaceChildren(buttons, stage, ...(rows.length === 2 && this.mode !== "side" ? [this.slider(stage)] : []), this.differences(picked));
    this.apply(stage);
  }

  /** @param {HTMLElement} stage */
  slider(stage) {
    const label = document.createElement("label");
    const swipe = this.mode === "swipe";
    label.textContent = swipe ? "Divider " : "Gain ";
    const input = document.createElement("input");
    input.type = "range";
    input.min = swipe ? "0" : "1";
    input.max = swipe ? "100" : "32";
    input.value = String(swipe ? this.at : this.gain);
    input.addEventListener("input", () => {
      if (swipe) this.at = Number(input.value);
      else this.gain = Number(input.value);
      this.apply(stage);
    });
    label.append(input);
    return label;
  }

  /** @param {HTMLElement} stage */
  apply(stage) {
    stage.style.setProperty("--divider", `${this.at}%`);
    stage.style.setProperty("--gain", String(this.gain));
  }

  /** Values of the picked rows beside each other. @param {number[]} rows */
  differences(rows) {
    const table = document.createElement("table");
    for (const column of this.table.columns) {
      if (!column.values) continue;
      const line = table.insertRow();
      line.insertCell().textContent = column.name;
      for (const row of rows) line.insertCell().textContent = shown(column, row);
    }
    return table;
  }
}

/** A quiet line of text. @param {string} text */
export function note(text) {
  const line = document.createElement("p");
  line.className = "note";
  line.textContent = text;
  return line;
}

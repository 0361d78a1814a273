// SPDX-License-Identifier: GPL-3.0-or-later
// Points straight into the pixels of a canvas: a hundred thousand in six panels within a frame or two.

/** Pixels of a disk with soft edges: offsets and opacities. @param {number} radius */
function stamp(radius) {
  const reach = Math.ceil(radius);
  const dx = [];
  const dy = [];
  const alpha = [];
  for (let y = -reach; y <= reach; y++) {
    for (let x = -reach; x <= reach; x++) {
      const cover = Math.min(1, Math.max(0, radius + 0.5 - Math.hypot(x, y)));
      if (cover > 0.05) {
        dx.push(x);
        dy.push(y);
        alpha.push(cover);
      }
    }
  }
  return { dx, dy, alpha };
}

/** Mix a pixel word over another. @param {number} under @param {number} over @param {number} alpha */
function blend(under, over, alpha) {
  const a = (alpha * 256) | 0;
  const b = 256 - a;
  const rb = ((((under & 0xff00ff) >>> 0) * b + ((over & 0xff00ff) >>> 0) * a) >>> 8) & 0xff00ff;
  const g = (((under & 0x00ff00) * b + (over & 0x00ff00) * a) >>> 8) & 0x00ff00;
  return (0xff000000 | rb | g) >>> 0;
}

/**
 * Draw one panel's points.
 * @param {Uint32Array} pixels @param {number} stride width of the whole buffer
 * @param {{left: number, top: number, width: number, height: number}} panel in pixels of the buffer
 * @param {Float32Array} x @param {Float32Array} y positions from 0 to 1
 * @param {Uint32Array} colors @param {Uint8Array|null} mask rows to draw, null for all
 * @param {{radius: number, fade: number}} style radius in pixels; fade is the opacity
 */
export function drawPoints(pixels, stride, panel, x, y, colors, mask, style) {
  const { left, top, width, height } = panel;
  const right = left + width - 1;
  const bottom = top + height - 1;
  if (style.radius < 1.2) {
    for (let i = 0; i < x.length; i++) {
      if (mask !== null && !mask[i]) continue;
      if (!(x[i] >= 0 && y[i] >= 0 && x[i] <= 1 && y[i] <= 1)) continue;
      const px = (left + x[i] * (width - 2)) | 0;
      const at = ((bottom - 1 - y[i] * (height - 2)) | 0) * stride + px;
      const color = style.fade < 1 ? blend(pixels[at], colors[i], style.fade) : colors[i];
      pixels[at] = color;
      pixels[at + 1] = color;
      pixels[at + stride] = color;
      pixels[at + stride + 1] = color;
    }
    return;
  }
  const { dx, dy, alpha } = stamp(style.radius);
  for (let i = 0; i < x.length; i++) {
    if (mask !== null && !mask[i]) continue;
    if (!(x[i] >= 0 && y[i] >= 0 && x[i] <= 1 && y[i] <= 1)) continue;
    const px = (left + x[i] * (width - 1) + 0.5) | 0;
    const py = (bottom - y[i] * (height - 1) + 0.5) | 0;
    for (let k = 0; k < dx.length; k++) {
      const u = px + dx[k];
      const v = py + dy[k];
      if (u < left || u > right || v < top || v > bottom) continue;
      const at = v * stride + u;
      const cover = alpha[k] * style.fade;
      pixels[at] = cover > 0.98 ? colors[i] : blend(pixels[at], colors[i], cover);
    }
  }
}

/**
 * Bars of a histogram, all rows behind, selected rows before.
 * @param {Uint32Array} pixels @param {number} stride
 * @param {{left: number, top: number, width: number, height: number}} panel
 * @param {Float32Array} x @param {Uint8Array|null} mask @param {number[]} words colors of the two kinds of bars
 * @param {{low: number, high: number, count: number}} bars positions of their ends, and how many of equal width
 */
export function drawHistogram(pixels, stride, panel, x, mask, words, bars) {
  const { low, high, count: bins } = bars;
  const all = new Uint32Array(bins);
  const chosen = new Uint32Array(bins);
  for (let i = 0; i < x.length; i++) {
    if (!(x[i] >= 0 && x[i] <= 1)) continue;
    const k = Math.max(0, Math.min(bins - 1, Math.floor(((x[i] - low) * bins) / (high - low))));
    all[k]++;
    if (mask === null || mask[i]) chosen[k]++;
  }
  const most = all.reduce((a, b) => Math.max(a, b), 1);
  const room = panel.height * 0.66;
  const edge = (/** @type {number} */ k) => Math.round(Math.max(0, Math.min(1, low + (k * (high - low)) / bins)) * panel.width);
  for (let k = 0; k < bins; k++) {
    const from = panel.left + edge(k);
    const to = panel.left + Math.max(edge(k) + 1, edge(k + 1) - 1);
    for (const [count, color] of [[all[k], words[0]], [chosen[k], words[1]]]) {
      const first = panel.top + panel.height - Math.round((room * count) / most);
      for (let v = first; v < panel.top + panel.height; v++) pixels.fill(color, v * stride + from, v * stride + to);
    }
  }
}

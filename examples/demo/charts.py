# SPDX-License-Identifier: GPL-3.0-or-later
"""Small SVG charts and swatches for the demo's report: no plotting library, readable at a glance."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

import numpy as np
from numpy.typing import ArrayLike

from spectral_core.spectra.color import display_rgb_from_linear, linear_rgb_from_xyz
from spectral_core.spectra.observer import observer
from spectral_core.spectra.spectrum import Spectrum

WIDTH, HEIGHT = 460, 210
LEFT, RIGHT, TOP, BOTTOM = 44, 12, 12, 40


def css_color(linear_rgb: ArrayLike) -> str:
    """``#rrggbb`` of a linear sRGB color, clipped to the range of a screen."""
    shown = np.clip(display_rgb_from_linear(linear_rgb), 0, 1)
    return "#" + "".join(f"{round(255 * float(channel)):02x}" for channel in shown)


def swatch(linear_rgb: ArrayLike, title: str = "") -> str:
    """A square of color with a tooltip."""
    return f'<span class="swatch" style="background:{css_color(linear_rgb)}" title="{escape(title)}"></span>'


def wavelength_color(wavelength_nm: float) -> str:
    """The hue of a wavelength, desaturated to the gamut of a screen; for axes."""
    viewer = observer()
    xyz = np.array([np.interp(wavelength_nm, viewer.wavelengths_nm, row) for row in viewer.cmfs])
    rgb = np.maximum(linear_rgb_from_xyz(xyz), 0)
    return css_color(0.9 * rgb / max(float(rgb.max()), 0.25) + 0.02)


def chart(series: Sequence[tuple[Spectrum, str]], *, title: str, top: float | None = None) -> str:
    """Curves over wavelength. ``series``: (spectrum, CSS color); ``top``: value at the top, None for the greatest."""
    low = min(spectrum.grid.wavelengths_nm[0] for spectrum, _ in series)
    high = max(spectrum.grid.wavelengths_nm[-1] for spectrum, _ in series)
    peak = top or 1.05 * max(float(spectrum.values.max()) for spectrum, _ in series)
    inner_width, inner_height = WIDTH - LEFT - RIGHT, HEIGHT - TOP - BOTTOM

    def x(wavelength: float) -> float:
        return LEFT + inner_width * (wavelength - low) / (high - low)

    def y(value: float) -> float:
        return TOP + inner_height * (1 - value / peak)

    parts = [
        f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="{escape(title)}"><title>{escape(title)}</title>'
    ]
    for step in np.arange(low, high, 5):
        place = f'x="{x(step):.1f}" y="{HEIGHT - BOTTOM + 1}" width="{x(step + 5) - x(step) + 0.6:.1f}" height="7"'
        parts.append(f'<rect {place} fill="{wavelength_color(step + 2.5)}"/>')
    for value in np.linspace(0, peak / 1.05 if top is None else peak, 3):
        parts.append(f'<line x1="{LEFT}" x2="{WIDTH - RIGHT}" y1="{y(value):.1f}" y2="{y(value):.1f}" class="grid"/>')
        parts.append(f'<text x="{LEFT - 6}" y="{y(value) + 4:.1f}" class="end">{value:.3g}</text>')
    for tick in range(int(np.ceil(low / 50) * 50), int(high) + 1, 50):
        parts.append(f'<text x="{x(tick):.1f}" y="{HEIGHT - 14}" class="mid">{tick}</text>')
    for spectrum, color in series:
        points = " ".join(
            f"{x(w):.1f},{y(v):.1f}" for w, v in zip(spectrum.grid.wavelengths_nm, spectrum.values, strict=True)
        )
        parts.append(f'<polyline points="{points}" fill="none" stroke="{color}" stroke-width="2"/>')
    parts.append(f'<text x="{WIDTH - RIGHT}" y="{HEIGHT - 1}" class="end">wavelength in nm</text></svg>')
    return "".join(parts)

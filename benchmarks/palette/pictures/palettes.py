# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures of palettes and of their errors; nothing is drawn where matplotlib is missing."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from spectral_core.palette import PaletteSolution
from spectral_core.spectra.color import display_rgb_from_linear

INK = "#333333"


def plotting() -> Any:
    try:
        import matplotlib

        matplotlib.use("Agg")
        from matplotlib import pyplot
    except ImportError:
        print("matplotlib is not installed, so no pictures are drawn; pip install 'spectral-scene[figures]'")
        return None
    pyplot.rcParams.update({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False, "text.color": INK})
    return pyplot


def draw_palette(solution: PaletteSolution, path: Path) -> None:
    """The table: lights above, reflectances left, each cell its actual color with the wanted one framed inside."""
    pyplot = plotting()
    if pyplot is None:
        return
    rows, columns = solution.delta_e_2000.shape
    figure, axes = pyplot.subplots(
        rows + 1, columns + 1, figsize=(1.9 * (columns + 1), 1.25 * (rows + 1)), squeeze=False
    )
    axes[0, 0].axis("off")
    for j, light in enumerate(solution.illuminants):
        _curve(axes[0, j + 1], light, light.values.max() * 1.08, f"{light.name}")
    for i, surface in enumerate(solution.reflectances):
        _curve(axes[i + 1, 0], surface, max(1.0, float(surface.values.max())), surface.name)
        for j in range(columns):
            _cell(axes[i + 1, j + 1], solution, (i, j))
    figure.tight_layout(h_pad=0.6, w_pad=0.6)
    figure.savefig(path, dpi=130)
    pyplot.close(figure)


def _curve(axis: Any, spectrum: Any, top: float, title: str) -> None:
    wavelengths = spectrum.grid.wavelengths_nm
    inside = (wavelengths >= 380) & (wavelengths <= 780)
    axis.plot(wavelengths[inside], spectrum.values[inside], color=INK, linewidth=1)
    axis.set_ylim(0, top or 1)
    axis.set_title(title, fontsize=8)
    axis.tick_params(labelsize=6, length=2)


def _cell(axis: Any, solution: PaletteSolution, cell: tuple[int, int]) -> None:
    axis.axis("off")
    axis.set_aspect("equal")
    shown = np.clip(display_rgb_from_linear(solution.actual_linear_rgb[cell]), 0, 1)
    axis.add_patch(_box((0, 0), 1, shown, "0.75"))
    if np.isfinite(solution.delta_e_2000[cell]):
        wanted = np.clip(display_rgb_from_linear(solution.target_linear_rgb[cell]), 0, 1)
        axis.add_patch(_box((0.3, 0.3), 0.4, wanted, "white"))
        axis.text(0.5, -0.12, f"ΔE {solution.delta_e_2000[cell]:.2f}", ha="center", va="top", fontsize=7)
    axis.set_xlim(0, 1)
    axis.set_ylim(-0.2, 1)


def _box(corner: tuple[float, float], size: float, color: Any, edge: str | None) -> Any:
    from matplotlib.patches import Rectangle

    return Rectangle(corner, size, size, facecolor=color, edgecolor=edge or "none", linewidth=0.8)


def draw_errors(figures: dict[str, dict[str, float]], path: Path) -> None:
    """Mean error against palette size, one line per spectral model."""
    pyplot = plotting()
    if pyplot is None:
        return
    figure, axis = pyplot.subplots(figsize=(5.2, 3.2))
    for name, errors in figures.items():
        axis.plot([int(size) for size in errors], list(errors.values()), marker="o", markersize=3, label=name)
    axis.axhline(10, color="0.7", linewidth=0.8, linestyle="--")
    axis.axhline(3, color="0.7", linewidth=0.8, linestyle=":")
    axis.set_xlabel("k reflectances × k lights")
    axis.set_ylabel("mean ΔE76, one round")
    axis.legend(frameon=False)
    figure.tight_layout()
    figure.savefig(path, dpi=130)
    pyplot.close(figure)


def draw_distances(pairs: dict[str, list[np.ndarray]], path: Path) -> None:
    """Wanted against actual distance of color pairs, one panel per spectral model."""
    pyplot = plotting()
    if pyplot is None:
        return
    figure, axes = pyplot.subplots(1, len(pairs), figsize=(3.0 * len(pairs), 3.0), sharey=True, squeeze=False)
    for axis, (name, (wanted, actual)) in zip(axes[0], pairs.items(), strict=True):
        axis.plot(wanted, actual, ".", markersize=1, alpha=0.4, color="#2060a0")
        largest = max(wanted.max(), actual.max())
        axis.plot([0, largest], [0, largest], color=INK, linewidth=0.6)
        axis.set_title(name, fontsize=9)
        axis.set_xlabel("wanted ΔE76")
    axes[0, 0].set_ylabel("actual ΔE76")
    figure.tight_layout()
    figure.savefig(path, dpi=130)
    pyplot.close(figure)

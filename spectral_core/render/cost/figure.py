# SPDX-License-Identifier: GPL-3.0-or-later
"""Error over time as a figure: the settings of the scene and alternatives to them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from spectral_core.checks import path_of
from spectral_core.errors import InvalidInputError, MissingDependencyError, counted
from spectral_core.files.whole import require_writable, whole_file
from spectral_core.render.cost.curve import CostCurve, CostPoint, require_axis

FORMATS = (".png", ".svg", ".pdf")
VISIBLE = ((1.0, "not visible"), (3.0, "visible side by side"), (1e9, "obvious"))
"""Upper limits of mean ΔE2000 with the visibility of a difference below each."""
SHADES = ("#e8f3ea", "#fdf6e0", "#fbe9e4")
LINE, MARK = "#1f5fa8", "#c2410c"
TICKS_S = (
    0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 30.0, 60.0, 120.0, 300.0, 600.0, 1800.0, 3600.0, 7200.0,
    18000.0, 36000.0, 86400.0, 172800.0,
)  # fmt: skip
"""Seconds, minutes and hours that an axis may be marked at."""
UNITS = {"samples": "samples per pixel", "bounces": "bounces", "transport": "transport", "volume step": "volume step"}


def write_figure(path: str | Path, curve: CostCurve, axis: str = "samples", title: str = "") -> None:
    """Draw noise and bias together over the time of the whole picture, both logarithmic, for one axis of the curve.

    Parameters
    ----------
    path
        Where to, ``.png``, ``.svg`` or ``.pdf``.
    curve
        The measured points.
    axis
        Settings to draw: "samples", "bounces", "transport", "volume step".
    title
        Name of the scene.

    Raises
    ------
    InvalidInputError : an axis that was not measured, another type of file. MissingDependencyError : no matplotlib.
    """
    path = path_of(path)
    points = [point for point in curve.axis(axis) if point.seconds > 0]
    if not points:
        known = ", ".join(dict.fromkeys(point.axis for point in curve.points))
        raise InvalidInputError(f"the cost curve has no axis {axis!r}; it has {known}")
    _require_format(path)
    pyplot = _pyplot()
    figure, axes = pyplot.subplots(figsize=(7.2, 4.6), dpi=130)
    x = np.array([point.seconds for point in points])
    y = np.array([max(float(np.hypot(point.delta_e, point.bias)), 1e-3) for point in points])
    order = np.argsort(x, kind="stable")
    axes.plot(x[order], y[order], color=LINE, linewidth=1.5, zorder=2)
    for k in range(len(points)):
        fill = LINE if points[k].measured else "white"
        axes.plot(x[k], y[k], "o", markersize=6, color=LINE, markerfacecolor=fill, zorder=3)
        axes.annotate(points[k].setting, (x[k], y[k]), (5, 5), textcoords="offset points", fontsize=8, color="#334155")
    _mark_now(axes, curve)
    _name_axes(axes, axis, points)
    _shade(axes)
    axes.set_title(f"What accuracy costs{' in ' + title if title else ''}", loc="left", fontsize=12, fontweight="bold")
    axes.legend(handles=_legend(pyplot, points), fontsize=8, frameon=False, loc="lower left")
    figure.tight_layout()
    try:
        with whole_file(path) as unfinished:
            figure.savefig(unfinished, format=path.suffix.lower()[1:])
    finally:
        pyplot.close(figure)


def require_drawable(path: str | Path, axis: str = "samples") -> None:
    """Raise the errors of ``write_figure`` for its file, its axis and matplotlib, before the work for it is done."""
    require_axis(axis)
    _require_format(path_of(path))
    _pyplot()
    require_writable(path)


def _require_format(path: Path) -> None:
    if path.suffix.lower() not in FORMATS:
        raise InvalidInputError(f"{path.name} ends in {path.suffix!r}; a plot is one of {', '.join(FORMATS)}")


def _mark_now(axes: Any, curve: CostCurve) -> None:
    """Mark the settings of the scene, and a requested ΔE of 1."""
    marks = (
        (
            curve.now,
            "*",
            f"as it is set:\n{counted(curve.now.samples, 'sample', form='.0f')}, {_clock(curve.now.seconds)}",
            (12, 26),
        ),
        (curve.at_error, "D", f"requested ΔE 1:\n{_clock(curve.at_error.seconds)}", (-78, -36)),
    )
    for found, shape, text, away in marks:
        axes.plot(found.seconds, max(found.delta_e, 1e-3), shape, markersize=11, color=MARK, zorder=4)
        axes.annotate(
            text, (found.seconds, max(found.delta_e, 1e-3)), away, textcoords="offset points", fontsize=8.5, color=MARK,
            arrowprops={"arrowstyle": "-", "color": MARK, "linewidth": 0.8},
        )  # fmt: skip


def _name_axes(axes: Any, axis: str, points: list[CostPoint]) -> None:
    from matplotlib.ticker import FixedLocator

    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.xaxis.set_major_locator(FixedLocator(_times([point.seconds for point in points])))
    axes.xaxis.set_minor_locator(FixedLocator([]))
    axes.xaxis.set_major_formatter(lambda seconds, _: _clock(seconds))
    axes.yaxis.set_major_formatter(lambda error, _: f"{error:g}")
    axes.yaxis.set_minor_formatter(lambda error, _: "")
    axes.set_xlabel(f"time for the whole picture; numbers at the points: {UNITS.get(axis, axis)}")
    axes.set_ylabel("error of a pixel in the mean (ΔE2000)")
    axes.grid(True, which="major", color="#cbd5e1", linewidth=0.6, zorder=1)
    axes.spines[["top", "right"]].set_visible(False)
    axes.margins(x=0.08, y=0.12)


def _times(seconds: list[float]) -> list[float]:
    """Round times over the range of ``seconds``, for the ticks of an axis."""
    low, high = min(seconds) / 1.5, max(seconds) * 1.5
    known = [each for each in TICKS_S if low <= each <= high]
    return known[:: max(1, -(-len(known) // 7))]


def _shade(axes: Any) -> None:
    """Shade the ranges of visibility behind the curves."""
    low, high = axes.get_ylim()
    start = low
    for (end, words), shade in zip(VISIBLE, SHADES, strict=True):
        top = min(end, high)
        if top > start:
            axes.axhspan(start, top, color=shade, zorder=0)
            if np.log10(top / start) > 0.12:
                middle = float(np.sqrt(start * top))
                axes.text(0.99, middle, words, transform=axes.get_yaxis_transform(), ha="right", va="center",
                          fontsize=8, color="#64748b", style="italic")  # fmt: skip
        start = max(start, top)
    axes.set_ylim(low, high)


def _legend(pyplot: Any, points: list[CostPoint]) -> list[Any]:
    line = pyplot.Line2D
    found = [line([], [], marker="o", color=LINE, label="measured on some of the picture's pixels")]
    if any(not point.measured for point in points):
        found.append(line([], [], marker="o", color=LINE, markerfacecolor="white", label="predicted"))
    return found


def _clock(seconds: float) -> str:
    """A time with a suitable unit."""
    if seconds < 1:
        return f"{seconds:.2g} s"
    if seconds < 90 and seconds % 60:
        return f"{seconds:.0f} s" if seconds >= 10 else f"{seconds:.1f} s".replace(".0 s", " s")
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"


def _pyplot() -> Any:
    try:
        import matplotlib
    except ImportError as error:
        raise MissingDependencyError.package("matplotlib", "drawing a cost curve", "figures") from error
    matplotlib.use("Agg")
    from matplotlib import pyplot

    return pyplot

# SPDX-License-Identifier: GPL-3.0-or-later
"""Figures for papers: the scatter-plot matrix, and error against time, as PNG, SVG or PDF by Matplotlib."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from spectral_core.errors import InvalidInputError, MissingDependencyError, UnknownNameError
from spectral_core.explore.features.expression import as_column
from spectral_core.explore.page.fonts import save_figure

ENDINGS = (".png", ".svg", ".pdf")
MOST_TEXTS = 12
"""Categories that an axis names."""
MOST_CHARACTERS = 16
"""Of a category's name; also of all names of an x axis together, beyond which they stand upright."""
MOST_OF_NAME = 24
"""Characters of a variable's name: as many as a plot is wide."""


def draw_matrix(
    path: str | Path,
    columns: Mapping[str, Sequence[Any]],
    names: Sequence[str],
    *,
    color: str = "",
    logarithmic: Collection[str] = (),
) -> Path:
    """Write the lower triangle of scatter plots over ``names`` with histograms on the diagonal.

    Parameters
    ----------
    path : ends in .png, .svg or .pdf.
    columns : the table.
    names : variables, 2 to 12.
    color : the variable that colors the points; none if empty. Points without a value of it are gray.
    logarithmic : variables with a logarithmic axis, if all their values are above 0.
    """
    if not 2 <= len(set(names)) == len(names) <= 12:
        raise InvalidInputError(f"the variables are {', '.join(names)}; a figure shows 2 to 12, each once")
    data = {name: _plotted(columns, name) for name in {*names, *([color] if color else [])}}
    figure = _figure(path, 1.6 * len(names))
    axes = figure.subplots(len(names), len(names), squeeze=False)
    shade = data[color][0] if color else None
    scales = {name: name in logarithmic and _is_positive(data[name][0]) for name in names}
    for row, upward in enumerate(names):
        for column, across in enumerate(names):
            plot = axes[row][column]
            if column > row:
                plot.axis("off")
                continue
            if column == row:
                values = data[across][0]
                plot.hist(
                    values[np.isfinite(values)], bins=_bins(values, data[across][1], scales[across]), color="#9aa7b8"
                )
                plot.set_yticks([])
                plot.set_title(_plain(across, MOST_OF_NAME), fontsize=8, loc="left")
            else:
                _scattered(plot, data[across][0], data[upward][0], shade, s=6)
                _scaled(plot.yaxis, data[upward][1], scales[upward])
            _scaled(plot.xaxis, data[across][1], scales[across])
            plot.tick_params(labelsize=6, labelbottom=row == len(names) - 1, labelleft=column == 0 and row > 0)
            if column == 0 and row > 0:
                plot.set_ylabel(_plain(upward, MOST_OF_NAME), fontsize=7)
            if row == len(names) - 1:
                plot.set_xlabel(_plain(across, MOST_OF_NAME), fontsize=7)
    if color:
        gray = "" if np.isfinite(data[color][0]).all() else "; gray: no value"
        figure.suptitle(f"color: {_plain(color)}{gray}", fontsize=8, ha="right", x=0.98)
    save_figure(figure, path)
    return Path(path)


def draw_error_against_time(
    path: str | Path, columns: Mapping[str, Sequence[Any]], time: str, errors: Sequence[str], *, by: Sequence[str] = ()
) -> Path:
    """Write error measures against time (R9; thesis Fig. 1.2), a column of plots per measure, a row per factor.

    Parameters
    ----------
    path : ends in .png, .svg or .pdf.
    columns : the table.
    time : column of seconds.
    errors : columns of error.
    by : columns whose values color the points, one row of plots each; the front of the best points is drawn in each.
    """
    from spectral_core.explore.analysis.pareto import pareto_front

    factors = list(by) or [""]
    figure = _figure(path, 2.6 * max(len(errors), 2), 2.4 * len(factors))
    axes = figure.subplots(len(factors), len(errors), squeeze=False)
    for name in (time, *errors):
        if _plotted(columns, name)[1]:
            raise InvalidInputError(f"the column {name!r} holds texts; errors and times are numbers")
    seconds = _plotted(columns, time)[0]
    for row, factor in enumerate(factors):
        shade, texts = _plotted(columns, factor) if factor else (np.zeros(len(seconds)), [])
        for column, error in enumerate(errors):
            plot, values = axes[row][column], _plotted(columns, error)[0]
            norm = "linear" if texts else _norm(shade)
            drawn = _scattered(plot, seconds, values, shade, s=12, norm=norm)
            front = pareto_front(np.stack([seconds, values], axis=1))
            order = front[np.argsort(seconds[front])]
            plot.plot(seconds[order], values[order], color="#c33", linewidth=0.8)
            plot.set_xscale("log")
            if _norm(values) == "log":
                plot.set_yscale("log")
            for axis in (plot.xaxis, plot.yaxis):
                if axis.get_scale() == "log":
                    _plain_log_ticks(axis)
            plot.tick_params(labelsize=6)
            plot.set_xlabel(f"{_plain(time)} (s)", fontsize=7)
            plot.set_ylabel(_plain(error, MOST_OF_NAME), fontsize=7)
            if factor and column == len(errors) - 1:
                bar = figure.colorbar(drawn, ax=plot)
                bar.set_label(_plain(factor, MOST_OF_NAME), fontsize=7)
                bar.ax.tick_params(labelsize=6)
                if texts:
                    bar.set_ticks(range(len(texts)), labels=[_plain(text, MOST_CHARACTERS) for text in texts])
    save_figure(figure, path)
    return Path(path)


def draw_error_against_factors(
    path: str | Path, columns: Mapping[str, Sequence[Any]], factors: Sequence[str], errors: Sequence[str], *, color: str
) -> Path:
    """Plot error measures over the varied factors (thesis Fig. 1.2a): a row per factor, a column per measure.

    Parameters
    ----------
    path : ends in .png, .svg or .pdf.
    columns : the table.
    factors : columns that were varied.
    errors : columns of error.
    color : the column of numbers that colors the points.
    """
    figure = _figure(path, 2.6 * max(len(errors), 2), 2.2 * len(factors))
    axes = figure.subplots(len(factors), len(errors), squeeze=False)
    shade = _plotted(columns, color)[0]
    for row, factor in enumerate(factors):
        across, texts = _plotted(columns, factor)
        for column, error in enumerate(errors):
            plot, values = axes[row][column], _plotted(columns, error)[0]
            drawn = _scattered(plot, across, values, shade, s=12, norm=_norm(shade))
            for axis, numbers in ((plot.xaxis, across), (plot.yaxis, values)):
                if _norm(numbers) == "log" and not (texts and axis is plot.xaxis):
                    axis.axes.set(**{f"{axis.axis_name}scale": "log"})
                    _plain_log_ticks(axis)
            if texts:
                plot.set_xticks(range(len(texts)), [_plain(text, MOST_CHARACTERS) for text in texts])
                plot.set_xlim(-0.5, len(texts) - 0.5)
            plot.tick_params(labelsize=6)
            plot.set_xlabel(_plain(factor, MOST_OF_NAME), fontsize=7)
            plot.set_ylabel(_plain(error, MOST_OF_NAME), fontsize=7)
    bar = figure.colorbar(drawn, ax=axes.ravel().tolist())
    bar.set_label(_plain(color, MOST_OF_NAME), fontsize=7)
    bar.ax.tick_params(labelsize=6)
    save_figure(figure, path)
    return Path(path)


def _scattered(plot: Any, across: Any, upward: Any, shade: Any, **style: Any) -> Any:
    """Points colored by ``shade``, all in one color without it; those without a value of it are gray."""
    if shade is None:
        style.pop("norm", None)
        return plot.scatter(across, upward, color="#3b6fb6", linewidths=0, **style)
    missing = ~np.isfinite(shade)
    if missing.any():
        plot.scatter(across[missing], upward[missing], s=style["s"], color="#b0b0b0", linewidths=0)
    known = ~missing
    return plot.scatter(across[known], upward[known], c=shade[known], cmap="viridis", linewidths=0, **style)


def _scaled(axis: Any, texts: Sequence[str], is_log: bool) -> None:
    """A logarithmic axis, or the texts of an axis of categories."""
    if is_log:
        axis.axes.set(**{f"{axis.axis_name}scale": "log"})
    elif texts:
        step = -(-len(texts) // MOST_TEXTS)
        labels = [_plain(text, MOST_CHARACTERS) for text in texts[::step]]
        upright = axis.axis_name == "x" and len(labels) * max(map(len, labels)) > MOST_CHARACTERS
        axis.set_ticks(range(0, len(texts), step), labels, rotation=90 if upright else 0)
        axis.axes.set(**{f"{axis.axis_name}lim": (-0.5, len(texts) - 0.5)})


def _bins(values: Any, texts: Sequence[str], is_log: bool) -> Any:
    """Edges of the histogram of a variable, even on its axis; one bar for each category."""
    if texts:
        return np.arange(len(texts) + 1) - 0.5
    known = values[np.isfinite(values)]
    return np.geomspace(known.min() / 1.001, known.max() * 1.001, 21) if is_log else 20


def _is_positive(values: Any) -> bool:
    known = values[np.isfinite(values)]
    return bool(known.size and known.min() > 0)


def _plain(text: str, most: int = 200) -> str:
    """A text that Matplotlib shows as it is: two dollar signs would enclose a formula. A long one loses its middle."""
    if len(text) > most:
        text = f"{text[: most // 2]}…{text[-((most - 1) // 2) :]}"
    return text.replace("$", r"\$")


def _norm(values: Any) -> str:
    """Logarithmic if numbers span more than a factor of eight."""
    known = values[np.isfinite(values)]
    return "log" if known.size and known.min() > 0 and known.max() > 8 * known.min() else "linear"


def _plain_log_ticks(axis: Any) -> None:
    """Ticks at 1, 2 and 5 times the powers of ten, written as plain numbers."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())


def require_figure_name(path: str | Path) -> None:
    """Raise InvalidInputError for a file whose ending is that of no figure."""
    path = Path(path)
    if path.suffix.lower() not in ENDINGS:
        raise InvalidInputError(f"a figure ends in {', '.join(ENDINGS)}; got {path.name!r}")


def _figure(path: str | Path, width: float, height: float | None = None) -> Any:
    require_figure_name(path)
    try:
        from matplotlib.figure import Figure
    except ImportError as error:
        raise MissingDependencyError.package("matplotlib", "a figure", "figures") from error
    return Figure(figsize=(width, height or width), layout="constrained", dpi=150)


def _plotted(columns: Mapping[str, Sequence[Any]], name: str) -> tuple[Any, list[str]]:
    """A column as numbers, and the text of each number; NaN where a text is missing."""
    if name not in columns:
        raise UnknownNameError.among("column", name, columns)
    column = as_column(columns[name])
    if column.dtype.kind == "f":
        return column, []
    texts = sorted({*column} - {""})
    place = {text: number for number, text in enumerate(texts)}
    return np.array([place.get(text, np.nan) for text in column], float), [str(text) for text in texts]

# SPDX-License-Identifier: GPL-3.0-or-later
"""Figures for papers: the scatter-plot matrix, and error against time, as PNG, SVG or PDF by Matplotlib."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from spectral_core.checks import path_of
from spectral_core.errors import InvalidInputError, MissingDependencyError
from spectral_core.explore.page.axes import (
    MOST_CHARACTERS,
    MOST_OF_NAME,
    add_bar,
    bins,
    is_wide,
    known_of,
    norm_of,
    plain,
    plain_log_ticks,
    plotted,
    scaled,
    scattered,
    takes_log,
)
from spectral_core.explore.page.fonts import save_figure

ENDINGS = (".png", ".svg", ".pdf")


def draw_matrix(
    path: str | Path,
    columns: Mapping[str, Sequence[Any]],
    names: Sequence[str],
    *,
    color: str = "",
    logarithmic: Collection[str] = (),
    parameters: Collection[str] = (),
) -> Path:
    """Write the lower triangle of scatter plots over ``names`` with histograms on the diagonal.

    Parameters
    ----------
    path : ends in .png, .svg or .pdf.
    columns : the table.
    names : variables, 2 to 12.
    color : the variable that colors the points; none if empty. Points without a value of it are gray.
    logarithmic : variables with a logarithmic scale, if all their values are above 0.
    parameters : variables whose empty text is a value; in others it is a missing one.
    """
    if not 2 <= len(set(names)) == len(names) <= 12:
        raise InvalidInputError(f"the variables are {', '.join(names)}; a figure shows 2 to 12, each once")
    wanted = {*names, *([color] if color else [])}
    data = {name: plotted(columns, name, takes_empty=name in parameters) for name in wanted}
    scales = {name: name in logarithmic and not data[name][1] and takes_log(data[name][0]) for name in wanted}
    figure = _figure(path, 1.6 * len(names))
    axes = figure.subplots(len(names), len(names), squeeze=False)
    shade = data[color][0] if color else None
    norm = norm_of(shade, is_log=scales[color]) if shade is not None else None
    for row, upward in enumerate(names):
        for column, across in enumerate(names):
            plot = axes[row][column]
            if column > row:
                plot.axis("off")
                continue
            if column == row:
                values, texts = data[across]
                plot.hist(known_of(values), bins=bins(values, texts, is_log=scales[across]), color="#9aa7b8")
                plot.set_yticks([])
                plot.set_title(plain(across, MOST_OF_NAME), fontsize=8, loc="left")
            else:
                scattered(plot, data[across][0], data[upward][0], shade, norm=norm, size=6)
                scaled(plot.yaxis, *data[upward], is_log=scales[upward])
            scaled(plot.xaxis, *data[across], is_log=scales[across])
            plot.tick_params(labelsize=6, labelbottom=row == len(names) - 1, labelleft=column == 0 and row > 0)
            if column == 0 and row > 0:
                plot.set_ylabel(plain(upward, MOST_OF_NAME), fontsize=7)
            if row == len(names) - 1:
                plot.set_xlabel(plain(across, MOST_OF_NAME), fontsize=7)
    if shade is not None:
        gray = "" if np.isfinite(shade).all() else "; gray: no value"
        figure.suptitle(f"color: {plain(color)}{gray}", fontsize=8, ha="right", x=0.98)
        # in the upper triangle, which has no plots
        place = axes[0][-1].inset_axes([0.35, 0.05, 0.07, 0.85])
        add_bar(figure, shade, data[color][1], "", norm=norm, cax=place)
        place.set_visible(bool(known_of(shade).size))
    save_figure(figure, path)
    return Path(path)


def draw_error_against_time(
    path: str | Path,
    columns: Mapping[str, Sequence[Any]],
    time: str,
    errors: Sequence[str],
    *,
    by: Sequence[str] = (),
    parameters: Collection[str] = (),
) -> Path:
    """Write error measures against time (thesis Fig. 1.2), a column of plots per measure, a row per factor.

    Parameters
    ----------
    path : ends in .png, .svg or .pdf.
    columns : the table.
    time : column of seconds.
    errors : columns of error.
    by : columns whose values color the points, one row of plots each; the front of the best points is drawn in each.
    parameters : columns whose empty text is a value; in others it is a missing one.
    """
    from spectral_core.explore.analysis.pareto import pareto_front

    factors = list(by) or [""]
    figure = _figure(path, 2.6 * max(len(errors), 2), 2.4 * len(factors))
    axes = figure.subplots(len(factors), len(errors), squeeze=False)
    for name in (time, *errors):
        if plotted(columns, name)[1]:
            raise InvalidInputError(f"the column {name!r} holds texts; errors and times are numbers")
    seconds = plotted(columns, time)[0]
    for row, factor in enumerate(factors):
        shade, texts = (
            plotted(columns, factor, takes_empty=factor in parameters) if factor else (np.zeros(len(seconds)), [])
        )
        norm = norm_of(shade, is_log=not texts and is_wide(shade))
        for column, error in enumerate(errors):
            plot, values = axes[row][column], plotted(columns, error)[0]
            scattered(plot, seconds, values, shade, norm=norm, size=12)
            front = pareto_front(np.stack([seconds, values], axis=1))
            order = front[np.argsort(seconds[front])]
            plot.plot(seconds[order], values[order], color="#c33", linewidth=0.8)
            scaled(plot.xaxis, seconds, [], is_log=True)
            scaled(plot.yaxis, values, [], is_log=is_wide(values))
            for axis in (plot.xaxis, plot.yaxis):
                if axis.get_scale() == "log":
                    plain_log_ticks(axis)
            plot.tick_params(labelsize=6)
            plot.set_xlabel(f"{plain(time)} (s)", fontsize=7)
            plot.set_ylabel(plain(error, MOST_OF_NAME), fontsize=7)
            if factor and column == len(errors) - 1:
                add_bar(figure, shade, texts, factor, norm=norm, ax=plot)
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
    shade = plotted(columns, color)[0]
    norm = norm_of(shade, is_log=is_wide(shade))
    for row, factor in enumerate(factors):
        across, texts = plotted(columns, factor)
        for column, error in enumerate(errors):
            plot, values = axes[row][column], plotted(columns, error)[0]
            scattered(plot, across, values, shade, norm=norm, size=12)
            for axis, numbers in ((plot.xaxis, across), (plot.yaxis, values)):
                is_log = is_wide(numbers) and not (texts and axis is plot.xaxis)
                scaled(axis, numbers, [], is_log=is_log)
                if is_log:
                    plain_log_ticks(axis)
            if texts:
                plot.set_xticks(range(len(texts)), [plain(text, MOST_CHARACTERS) for text in texts])
                plot.set_xlim(-0.5, len(texts) - 0.5)
            plot.tick_params(labelsize=6)
            plot.set_xlabel(plain(factor, MOST_OF_NAME), fontsize=7)
            plot.set_ylabel(plain(error, MOST_OF_NAME), fontsize=7)
    add_bar(figure, shade, [], color, norm=norm, ax=axes.ravel().tolist())
    save_figure(figure, path)
    return Path(path)


def require_figure_name(path: str | Path) -> None:
    """Raise InvalidInputError for a file whose ending is that of no figure."""
    path = path_of(path)
    if path.suffix.lower() not in ENDINGS:
        raise InvalidInputError(f"a figure ends in {', '.join(ENDINGS)}; got {path.name!r}")


def _figure(path: str | Path, width: float, height: float | None = None) -> Any:
    require_figure_name(path)
    try:
        from matplotlib.figure import Figure
    except ImportError as error:
        raise MissingDependencyError.package("matplotlib", "a figure", "figures") from error
    return Figure(figsize=(width, height or width), layout="constrained", dpi=150)

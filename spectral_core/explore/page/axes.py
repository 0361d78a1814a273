# SPDX-License-Identifier: GPL-3.0-or-later
"""Axes, colors and texts of figures: what a column of numbers or of texts looks like in a plot."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.errors import InvalidInputError, UnknownNameError
from spectral_core.explore.features.expression import as_column

COLORS = "viridis"
MOST_TEXTS = 12
"""Categories that an axis names."""
MOST_CHARACTERS = 16
"""Of a category's name; also of all names of an x axis together, beyond which they stand upright."""
MOST_OF_NAME = 24
"""Characters of a variable's name: as many as a plot is wide."""
MOST_BARS, LARGEST_COUNT = 20, 2.0**50
"""Bars of a histogram of numbers, and so many whole numbers that halves between them are lost in rounding."""
MARGIN = 0.05
"""Room at either end of an axis, as a share of it."""
MOST, WIDEST = 1e307, 1e250
"""Largest size of a number, and largest ratio on a logarithmic axis, for which Matplotlib finds ends and ticks."""
EMPTY = "(empty)"
"""Name of the empty text where that is a value."""
Numbers = NDArray[np.float64]


def plotted(columns: Mapping[str, Sequence[Any]], name: str, *, takes_empty: bool = False) -> tuple[Numbers, list[str]]:
    """A column as numbers, and the text of each number; NaN where a text is missing.

    ``takes_empty``: the empty text is a value, as in a column of a parameter, of which every point has one.
    """
    if name not in columns:
        raise UnknownNameError.among("column", name, columns)
    column = as_column(columns[name])
    if column.dtype.kind == "f":
        if (np.abs(known_of(column)) > MOST).any():
            raise InvalidInputError(f"the column {name!r} has a number beyond {MOST:g}, which a figure cannot show")
        return column, []
    texts = sorted((str(text) for text in {*column} if text or takes_empty), key=_natural)
    place = {text: number for number, text in enumerate(texts)}
    return np.array([place.get(str(text), np.nan) for text in column], float), [text or EMPTY for text in texts]


def _natural(text: str) -> list[tuple[int, str]]:
    """Order in which "name 2" is before "name 10", as on the page."""
    parts = re.split(r"(\d+)", text.casefold())
    return [(len(part.lstrip("0")), part.lstrip("0")) if k % 2 else (0, part) for k, part in enumerate(parts)]


def known_of(values: Numbers) -> Numbers:
    """The values that are finite."""
    return values[np.isfinite(values)]


def takes_log(values: Numbers) -> bool:
    """True if there are values, and all of them are above 0 and not too far apart for a logarithmic axis."""
    known = known_of(values)
    return bool(known.size and known.min() > 0 and known.max() / WIDEST < known.min())


def is_wide(values: Numbers) -> bool:
    """True if positive numbers span more than a factor of eight, so that a logarithmic scale shows them better."""
    return takes_log(values) and bool(known_of(values).max() > 8 * known_of(values).min())


def scaled(axis: Any, values: Numbers, texts: Sequence[str], *, is_log: bool) -> None:
    """An axis over all values of a variable: logarithmic, with the texts of categories, or without a value no scale.

    Its ends do not depend on which points a plot has: the scale of one plot holds for others of the same variable.
    """
    if texts:
        step = -(-len(texts) // MOST_TEXTS)
        labels = [plain(text, MOST_CHARACTERS) for text in texts[::step]]
        upright = axis.axis_name == "x" and len(labels) * max(map(len, labels)) > MOST_CHARACTERS
        axis.set_ticks(range(0, len(texts), step), labels, rotation=90 if upright else 0)
        axis.axes.set(**{f"{axis.axis_name}lim": (-0.5, len(texts) - 0.5)})
    elif not known_of(values).size:  # a scale would claim values that there are not
        axis.set_ticks([])
    else:
        axis.axes.set(**{f"{axis.axis_name}scale": "log" if is_log else "linear"})
        axis.axes.set(**{f"{axis.axis_name}lim": _ends(known_of(values), is_log=is_log)})


def _ends(known: Numbers, *, is_log: bool) -> tuple[float, float]:
    """Ends of an axis: those of the values, and some room."""
    low, high = float(known.min()), float(known.max())
    if is_log:
        room = high**MARGIN / low**MARGIN if high > low else 2.0
        return low / room, high * room
    room = MARGIN * high - MARGIN * low if high > low else max(0.5, 1e-9 * abs(low))
    return low - room, high + room


def bins(values: Numbers, texts: Sequence[str], *, is_log: bool) -> Any:
    """Edges of the histogram of a variable, even on its axis; one bar for each category, and equally many whole numbers
    in each bar but the last, or some would be twice as high.
    """
    if texts:
        return np.arange(len(texts) + 1) - 0.5
    known = known_of(values)
    if is_log:
        return np.geomspace(known.min() / 1.001, known.max() * 1.001, MOST_BARS + 1)
    if known.size and known.min() == known.max():
        # NumPy takes a half to either side, which is lost in the rounding of a large value
        return np.linspace(*_ends(known, is_log=False), MOST_BARS + 1)
    if known.size and (known == np.round(known)).all() and (number := np.ptp(known) + 1) < LARGEST_COUNT:
        each = np.ceil(number / MOST_BARS)
        return known.min() - 0.5 + each * np.arange(np.ceil(number / each) + 1)
    return MOST_BARS


def norm_of(values: Numbers, *, is_log: bool) -> Any:
    """The map of a variable's values to [0, 1] of the colors, from all of its values."""
    from matplotlib.colors import LogNorm, Normalize

    known = known_of(values)
    low, high = (float(known.min()), float(known.max())) if known.size else (0.0, 1.0)
    if low == high:
        room = max(0.5, 1e-9 * abs(low))  # a half is lost in the rounding of a large number
        return Normalize(low - room, high + room)
    return LogNorm(low, high) if is_log and low > 0 else Normalize(low, high)


def scattered(plot: Any, across: Numbers, upward: Numbers, shade: Numbers | None, *, norm: Any, size: float) -> None:
    """Points colored by ``shade``, all in one color without it; those without a value of it are gray."""
    if shade is None:
        plot.scatter(across, upward, s=size, color="#3b6fb6", linewidths=0)
        return
    known = np.isfinite(shade)
    if not known.all():
        plot.scatter(across[~known], upward[~known], s=size, color="#b0b0b0", linewidths=0)
    plot.scatter(across[known], upward[known], s=size, c=shade[known], cmap=COLORS, norm=norm, linewidths=0)


def add_bar(figure: Any, shade: Numbers, texts: Sequence[str], name: str, *, norm: Any, **place: Any) -> None:
    """The legend of the colors: a bar with a scale, with the texts of categories, or with the only value."""
    from matplotlib.cm import ScalarMappable

    known = known_of(shade)
    if not known.size:
        return
    bar = figure.colorbar(ScalarMappable(norm, COLORS), **place)
    bar.set_label(plain(name, MOST_OF_NAME), fontsize=7)
    bar.ax.tick_params(labelsize=6)
    if texts:
        step = -(-len(texts) // MOST_TEXTS)
        bar.set_ticks(range(0, len(texts), step), labels=[plain(text, MOST_CHARACTERS) for text in texts[::step]])
    elif known.min() == known.max():
        bar.set_ticks([known[0]], labels=[f"{known[0]:g}"])


def plain(text: str, most: int = 200) -> str:
    """A text that Matplotlib shows as it is: two dollar signs would enclose a formula. A long one loses its middle."""
    if len(text) > most:
        text = f"{text[: most // 2]}…{text[-((most - 1) // 2) :]}"
    return text.replace("$", r"\$")


def plain_log_ticks(axis: Any) -> None:
    """Ticks at 1, 2 and 5 times the powers of ten, written as plain numbers."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())

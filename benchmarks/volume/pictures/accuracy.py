# SPDX-License-Identifier: GPL-3.0-or-later
"""Error against time as a figure: one panel per volume, one line per stepping."""

from __future__ import annotations

from pathlib import Path
from typing import Any

LOOKS = {
    "uniform midpoint": ("#9aa5b1", "o", "uniform"),
    "thesis midpoint": ("#d1902b", "s", "thesis"),
    "error midpoint": ("#1f4e79", "^", "error, midpoint"),
    "error preintegrated": ("#6a4c93", "v", "error, pre-integrated"),
    "auto auto": ("#d1495b", "o", "auto"),
}


def write(path: Path, rows: list[dict[str, Any]], function: str) -> Path:
    """Draw the rows of ``function``: SNR in dB over milliseconds, logarithmic."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    names = list(dict.fromkeys(row["volume"] for row in rows))
    columns = min(5, len(names))
    lines = -(-len(names) // columns)
    with plt.rc_context({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False}):
        figure, axes = plt.subplots(
            lines, columns, figsize=(2.3 * columns, 2.0 * lines + 0.6), squeeze=False, sharey=True
        )
        for axis in axes.flat[len(names) :]:
            axis.set_visible(False)
        for axis, name in zip(axes.flat, names, strict=False):
            _panel(axis, [row for row in rows if row["volume"] == name])
            axis.set_title(name, fontsize=10)
        for axis in axes[:, 0]:
            axis.set_ylabel("SNR, dB")
        figure.supxlabel(f"milliseconds on two cores, 512², function “{function}”")
        handles, labels = axes.flat[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="upper center", ncols=len(labels), frameon=False)
        figure.tight_layout(rect=(0, 0, 1, 1 - 0.35 / (2.0 * lines + 0.6)))
        figure.savefig(path, dpi=110)
        plt.close(figure)
    return path


def _panel(axis: Any, rows: list[dict[str, Any]]) -> None:
    from matplotlib.ticker import FixedLocator, NullFormatter, NullLocator

    for way, (color, marker, label) in LOOKS.items():
        own = [row for row in rows if row["way"] == way]
        style: dict[str, Any] = {"color": color, "marker": marker, "markersize": 4, "label": label}
        if way == "auto auto":  # lies on the line that it chose
            style |= {"linestyle": "none", "markersize": 8, "markerfacecolor": "none"}
        axis.plot([row["ms"] for row in own], [row["db"] for row in own], **style)
    every = [row["ms"] for row in rows]
    axis.set_xscale("log")
    ticks = [
        t for t in (0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000) if 0.8 * min(every) <= t <= 1.25 * max(every)
    ]
    axis.xaxis.set_major_locator(FixedLocator(ticks))
    axis.xaxis.set_minor_locator(NullLocator())
    axis.xaxis.set_minor_formatter(NullFormatter())
    axis.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
    axis.set_yticks(sorted({row["db"] for row in rows}))

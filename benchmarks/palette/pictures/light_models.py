# SPDX-License-Identifier: GPL-3.0-or-later
"""Accuracy of light models against multiplications, as a picture; nothing is drawn where matplotlib is missing."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from benchmarks.palette.pictures.palettes import INK, plotting

STYLES = {
    "RGB of D65": ("RGB", "#888888", "s"),
    "PCA, full R": ("principal components, full R", "#4477aa", "o"),
    "factor, searched intervals": ("spectral factors", "#cc8833", "^"),
    "nodes, natural": ("nodes", "#228855", "D"),
}
"""Name in the table -> label, color, marker."""


def draw_errors(tables: dict[str, list[dict[str, Any]]], path: Path) -> None:
    """One panel per table: mean ΔE2000 over multiplications, a line per model, m beside each point."""
    pyplot = plotting()
    if pyplot is None:
        return
    figure, axes = pyplot.subplots(1, len(tables), figsize=(9, 3.6), sharey=True, layout="constrained")
    for axis, (title, rows) in zip(axes, tables.items(), strict=True):
        for name, (label, color, marker) in STYLES.items():
            points = sorted((row["multiplications"], row["mean"], row["m"]) for row in rows if row["model"] == name)
            if not points:
                continue
            counts, means, _ = zip(*points, strict=True)
            axis.plot(counts, means, color=color, marker=marker, markersize=5, linewidth=1.3, label=label)
            for count, mean, size in points:
                axis.annotate(str(size), (count, mean), (4, 4), textcoords="offset points", fontsize=7, color=color)
        axis.axhline(1.0, color=INK, linewidth=0.6, linestyle=":")
        axis.set(xscale="log", yscale="log", title=title, xlabel="multiplications per reflection and color")
        axis.set_xticks([10, 20, 50, 100], ["10", "20", "50", "100"])
        axis.minorticks_off()
    axes[0].set_ylabel("mean ΔE2000")
    axes[0].set_yticks([0.2, 0.5, 1, 2, 5, 10, 20], ["0.2", "0.5", "1", "2", "5", "10", "20"])
    axes[-1].legend(frameon=False, fontsize=8, loc="upper right")
    figure.savefig(path, dpi=130)
    pyplot.close(figure)
    print(f"\npicture: {path}")

# SPDX-License-Identifier: GPL-3.0-or-later
"""Distances between rows: pictures against a reference, and weighted norms over features and pictures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.checks import require_whole
from spectral_core.errors import InvalidInputError, UnknownNameError
from spectral_core.explore.features.expression import as_column
from spectral_core.explore.features.images import difference_features
from spectral_core.explore.features.picture_files import read_linear
from spectral_core.explore.sweep.files import inside

if TYPE_CHECKING:
    from spectral_core.explore.sweep.store import Store

Array = NDArray[np.float64]


def compare_rows(store: Store, reference: str, prefix: str = "") -> list[str]:
    """Measure the picture of every row against a picture of the folder; returns the names of the columns.

    Pictures that are stored with 32-bit floats are compared as such, others by their 8 bits.
    """
    target = read_linear(inside(store.folder, reference))
    linear = reference.lower().endswith((".exr", ".npy"))
    found: dict[str, dict[str, Any]] = {}
    for row in store.ledger.rows("done"):
        name = (row.files.get("FILE_linear") if linear else None) or row.files.get("FILE")
        if name is None:
            continue
        measured = difference_features(read_linear(inside(store.folder, name)), target, prefix)
        for column, value in measured.items():
            found.setdefault(column, {})[row.key] = value if np.isfinite(value) else None
    store.add_columns(found)
    return list(found)


def feature_matrix(
    columns: Mapping[str, Sequence[Any]], names: Sequence[str], weights: Mapping[str, float] | None = None
) -> Array:
    """Features (rows, names) with their ranges made equal (thesis 6.4.2), then weighted; missing values are the mean.

    Parameters
    ----------
    columns : the table by column.
    names : which columns.
    weights : by column; 1 if none is given.
    """
    weights = weights or {}
    rows = []
    for name in names:
        if name not in columns:
            raise UnknownNameError.among("column", name, columns)
        column = as_column(columns[name])
        if column.dtype.kind != "f":
            raise InvalidInputError(f"the column {name!r} holds texts; a distance needs numbers")
        known = column[np.isfinite(column)]
        low, high = (known.min(), known.max()) if known.size else (0.0, 0.0)
        scaled = (column - low) / (high - low) if high > low else np.zeros_like(column)
        middle = float(np.nanmean(scaled)) if known.size else 0.0
        rows.append(float(weights.get(name, 1.0)) * np.where(np.isfinite(scaled), scaled, middle))
    if not rows:
        raise InvalidInputError("no feature is named; a distance needs at least one")
    return np.stack(rows, axis=1)


def distances_to(features: Array, row: int, p: float = 2.0) -> Array:
    """p-norm distance of every row (m, k) to one of them, (m,)."""
    if not p >= 1:
        raise InvalidInputError(f"p is {p}; expected a norm with p >= 1")
    row = require_whole("row", row, 0, len(features) - 1)
    apart = np.abs(features - features[row])
    largest = apart.max(axis=1, keepdims=True)
    # Relative to the largest difference: high powers of small numbers are 0.
    shares = np.divide(apart, largest, out=np.zeros_like(apart), where=largest > 0)
    result: Array = largest[:, 0] * np.linalg.norm(shares, ord=p, axis=1)
    return result


def picture_features(store: Store, rows: Sequence[Mapping[str, str]], size: int = 16) -> Array:
    """Pictures (rows, 3·size²) scaled to size × size, for distances between pictures; Lab, each channel over 100."""
    from spectral_core.explore.features.picture_files import read_display
    from spectral_core.spectra.color import lab_from_linear_rgb, linear_from_display_rgb

    stacked = []
    for files in rows:
        if not files.get("FILE"):
            raise InvalidInputError("a row of this table has no picture; leave pictures out of the weights")
        pixels = read_display(inside(store.folder, files["FILE"]))
        height, width = pixels.shape[:2]
        across = np.linspace(0, width, size + 1).astype(int)[:-1]
        down = np.linspace(0, height, size + 1).astype(int)[:-1]
        linear = linear_from_display_rgb(pixels / 255.0)
        means = np.add.reduceat(np.add.reduceat(linear, down, axis=0), across, axis=1)
        areas = np.diff(np.append(down, height))[:, None, None] * np.diff(np.append(across, width))[None, :, None]
        stacked.append(lab_from_linear_rgb(means / np.maximum(areas, 1)).ravel() / 100.0)
    return np.array(stacked)

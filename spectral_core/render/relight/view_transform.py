# SPDX-License-Identifier: GPL-3.0-or-later
"""View transform of a scene from linear light to a screen (AgX, Filmic, Standard, looks, curves), as a sampled table.

Blender's color management provides the transform; the add-on samples it when a transport is recorded. Pictures outside
of Blender, such as the page with the dial, then match the scene's look. ``agx_view`` is the table of AgX alone.
"""

from __future__ import annotations

import base64
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spectral_core.checks import frozen_array, read_only_when_copied, require_range, require_whole
from spectral_core.errors import InvalidInputError, counted

Array = NDArray[np.float64]

TABLE_SIZE = 33
"""Nodes per axis from 0 on, half a stop apart: error of a third of a level of 255 for looks of AgX in the mean, 21 at
most at their sharp bends.
"""
BELOW = 13
"""Nodes per axis below 0, a stop apart, down to -8: what a color outside of sRGB, as that of a laser, has there."""
_STEEPNESS = 1024.0
_BRIGHTEST = 64.0
"""Linear value at the last node; brighter light is shown with this value."""


@read_only_when_copied
@dataclass(frozen=True, slots=True, eq=False)
class ViewTransform:
    """``table``: (n, n, n, 3), display values, 0 to 1, by red, green and blue of linear sRGB at ``nodes``, of which
    ``below`` are below 0. ``exposure``: stops by which light is brightened before, so that what is the brightest light
    of a view stays at one place of its table.
    """

    name: str
    table: Array
    below: int = 0
    exposure: float = 0.0

    def __post_init__(self) -> None:
        size = np.shape(self.table)[0] if np.ndim(self.table) else 0
        table = frozen_array(f"view transform {self.name!r}", self.table, (size, size, size, 3))
        if size - require_whole("the nodes below 0", self.below, 0, 126) < 2:
            raise InvalidInputError(
                f"view transform {self.name!r} has {counted(size - self.below, 'node')} per axis from 0 on; expected "
                "at least 2"
            )
        object.__setattr__(self, "table", np.clip(table, 0.0, 1.0))
        object.__setattr__(self, "exposure", require_range("the exposure of a view", self.exposure, -100.0, 100.0))

    def coordinates(self, linear_rgb: ArrayLike) -> Array:
        """Light (..., 3) by which the table is ordered: linear sRGB itself."""
        return np.asarray(linear_rgb, dtype=np.float64)

    def shown(self, linear_rgb: ArrayLike) -> Array:
        """Display values (..., 3) in 0 to 1 of linear sRGB (..., 3): tetrahedral between nodes."""
        light = self.coordinates(linear_rgb) * 2.0**self.exposure
        return tetrahedral(self.table, positions(light, len(self.table) - self.below, self.below))

    def document(self) -> dict[str, Any]:
        """The entries of a file: 16 bits per value."""
        levels = np.round(self.table * 65535).astype("<u2")
        table = base64.b64encode(levels.tobytes()).decode("ascii")
        exposure = {"exposure": self.exposure} if self.exposure else {}
        return {"name": self.name, "size": len(self.table), "below": self.below, **exposure, "table": table}

    @classmethod
    def of_document(cls, document: dict[str, Any]) -> ViewTransform:
        """Read the result of ``document``. Raises InvalidInputError for a table of wrong size."""
        size, below = int(document["size"]), int(document.get("below", 0))  # files of earlier versions have none
        levels = np.frombuffer(base64.b64decode(document["table"], validate=True), "<u2")
        if not 2 <= size <= 128 or levels.size != 3 * size**3:
            raise InvalidInputError(
                f"a view transform of {size} nodes has {levels.size} values; expected {3 * size**3}"
            )
        exposure = float(document.get("exposure", 0.0))
        return cls(str(document["name"]), levels.reshape(size, size, size, 3) / 65535.0, below, exposure)


def tetrahedral(table: Array, position: Array) -> Array:
    """Values (..., 3) of a table (n, n, n, 3) at positions (..., 3) on its axes, in nodes: a mean over the tetrahedron.

    Six of them, around the diagonal of gray, fill each cell: gray is between two nodes, and not between eight.
    """
    corner = np.clip(position.astype(np.intp), 0, len(table) - 2)
    part = position - corner
    # From the lower corner of a cell to the upper one along its edges, the axis of the largest part first.
    order = np.argsort(-part, axis=-1, kind="stable")
    weights = -np.diff(np.take_along_axis(part, order, axis=-1), axis=-1, prepend=1.0, append=0.0)
    found = weights[..., :1] * table[corner[..., 0], corner[..., 1], corner[..., 2]]
    for step in range(3):
        corner = corner + (np.arange(3) == order[..., step : step + 1])
        found = found + weights[..., step + 1 : step + 2] * table[corner[..., 0], corner[..., 1], corner[..., 2]]
    return np.asarray(found)


def positions(linear_rgb: ArrayLike, size: int = TABLE_SIZE, below: int = 0) -> Array:
    """Position on the table's axes, in nodes: logarithmic above and below 0, linear near black.

    ``size``, ``below``: nodes from 0 on, and below 0.
    """
    light = np.clip(np.asarray(linear_rgb, dtype=np.float64), -_BRIGHTEST, _BRIGHTEST)
    stops = np.log2(1 + _STEEPNESS * np.abs(light))
    above = (size - 1) * stops / np.log2(1 + _STEEPNESS * _BRIGHTEST)
    return np.asarray(below + np.where(light >= 0, above, np.maximum(-stops, -below)), dtype=np.float64)


def nodes(size: int = TABLE_SIZE, below: int = 0) -> Array:
    """Linear values (below + size,) at the table's nodes, where the add-on samples the transform."""
    above = (np.exp2(np.linspace(0, 1, size) * np.log2(1 + _STEEPNESS * _BRIGHTEST)) - 1) / _STEEPNESS
    return np.concatenate([-(np.exp2(np.arange(below, 0, -1)) - 1) / _STEEPNESS, above])

# SPDX-License-Identifier: GPL-3.0-or-later
"""View transform of a scene from linear light to a screen (AgX, Filmic, Standard, looks, curves), as a sampled table.

Blender's color management provides the transform; the add-on samples it when a transport is recorded. Pictures outside
of Blender, such as the page with the dial, then match the scene's look.
"""

from __future__ import annotations

import base64
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spectral_core.checks import frozen_array, read_only_when_copied
from spectral_core.errors import InvalidInputError, counted

Array = NDArray[np.float64]

TABLE_SIZE = 33
"""Nodes per axis, half a stop apart: error of a quarter of a level of 255 for AgX in the mean, twelve at most at its
sharp bends.
"""
_STEEPNESS = 1024.0
_BRIGHTEST = 64.0
"""Linear value at the last node; brighter light is shown with this value."""


@read_only_when_copied
@dataclass(frozen=True, slots=True, eq=False)
class ViewTransform:
    """``table``: (n, n, n, 3), display values, 0 to 1, by red, green and blue of linear sRGB at ``nodes``."""

    name: str
    table: Array

    def __post_init__(self) -> None:
        size = np.shape(self.table)[0] if np.ndim(self.table) else 0
        table = frozen_array(f"view transform {self.name!r}", self.table, (size, size, size, 3))
        if size < 2:
            raise InvalidInputError(
                f"view transform {self.name!r} has {counted(size, 'node')} per axis; expected at least 2"
            )
        object.__setattr__(self, "table", np.clip(table, 0.0, 1.0))

    def shown(self, linear_rgb: ArrayLike) -> Array:
        """Display values (..., 3) in 0 to 1 of linear sRGB (..., 3): trilinear between nodes."""
        size = len(self.table)
        position = shaped(linear_rgb) * (size - 1)
        low = np.clip(position.astype(np.intp), 0, size - 2)
        part = position - low
        result = np.zeros(position.shape)
        for corner in range(8):
            step = np.array([corner & 1, corner >> 1 & 1, corner >> 2])
            weight = np.where(step, part, 1 - part).prod(axis=-1)
            index = low + step
            result += weight[..., None] * self.table[index[..., 0], index[..., 1], index[..., 2]]
        return result

    def document(self) -> dict[str, Any]:
        """The entries of a file: 16 bits per value."""
        levels = np.round(self.table * 65535).astype("<u2")
        return {"name": self.name, "size": len(self.table), "table": base64.b64encode(levels.tobytes()).decode("ascii")}

    @classmethod
    def of_document(cls, document: dict[str, Any]) -> ViewTransform:
        """Read the result of ``document``. Raises InvalidInputError for a table of wrong size."""
        size = int(document["size"])
        levels = np.frombuffer(base64.b64decode(document["table"], validate=True), "<u2")
        if not 2 <= size <= 128 or levels.size != 3 * size**3:
            raise InvalidInputError(
                f"a view transform of {size} nodes has {levels.size} values; expected {3 * size**3}"
            )
        return cls(str(document["name"]), levels.reshape(size, size, size, 3) / 65535.0)


def shaped(linear_rgb: ArrayLike) -> Array:
    """Position 0 to 1 on the table's axes: logarithmic above, linear near black."""
    light = np.clip(np.asarray(linear_rgb, dtype=np.float64), 0.0, _BRIGHTEST)
    return np.log2(1 + _STEEPNESS * light) / np.log2(1 + _STEEPNESS * _BRIGHTEST)


def nodes(size: int = TABLE_SIZE) -> Array:
    """Linear values (n,) at the table's nodes, where the add-on samples the transform."""
    return (np.exp2(np.linspace(0, 1, size) * np.log2(1 + _STEEPNESS * _BRIGHTEST)) - 1) / _STEEPNESS

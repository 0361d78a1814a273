# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's view AgX as its own table: on that table's axes, at its nodes, between them as it is interpolated.

AgX takes the logarithm of light in the E-Gamut of FilmLight, in which every color of light is positive, looks it up in
a table of 57³ colors by tetrahedral interpolation, and shows the result with a power of 2.4. A table that is sampled at
the same places gives the same picture; on other axes the view is bent between the nodes, most of all outside of sRGB.
"""

from __future__ import annotations

import base64
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spectral_core.checks import frozen_array, read_only_when_copied, require_range
from spectral_core.errors import InvalidInputError
from spectral_core.render.relight.view_transform import ViewTransform, tetrahedral
from spectral_core.spectra.color import display_rgb_from_linear, linear_from_display_rgb

Array = NDArray[np.float64]

LOWEST_STOP, STEP = -12.47393, 25.0 / 56.0
"""Logarithm (base 2) of light at the first node, and from node to node (Blender's ``config.ocio``)."""
NODES = 42
"""Nodes per axis, up to 2^5.83 = 57; brighter light is shown with this value."""
POWER = 2.4
"""The table holds what a display of this power shows, as that of Blender does."""
_WHITE = (0.3127, 0.3290)
_SRGB = ((0.64, 0.33), (0.30, 0.60), (0.15, 0.06))
_E_GAMUT = ((0.8, 0.3177), (0.18, 0.9), (0.065, -0.0805))
"""Chromaticities of the primaries (FilmLight, T-Log and E-Gamut)."""


@read_only_when_copied
@dataclass(frozen=True, slots=True, eq=False)
class AgxView:
    """``table``: (n, n, n, 3), display values to the power of ``POWER`` by light in E-Gamut. ``lowest``: logarithm of
    light at the first node; the exposure of a scene lowers it.
    """

    name: str
    table: Array
    lowest: float = LOWEST_STOP

    def __post_init__(self) -> None:
        size = np.shape(self.table)[0] if np.ndim(self.table) else 0
        table = frozen_array(f"view {self.name!r}", self.table, (size, size, size, 3))
        if not 2 <= size <= 128:
            raise InvalidInputError(f"the view {self.name!r} has {size} nodes per axis; expected 2 to 128")
        object.__setattr__(self, "table", np.clip(table, 0.0, 1.0))
        object.__setattr__(self, "lowest", require_range("the lowest stop of a view", self.lowest, -100.0, 100.0))

    @classmethod
    def of_shown(cls, name: str, shown: ArrayLike, lowest: float = LOWEST_STOP) -> AgxView:
        """The view that shows the light of ``node_light`` as ``shown`` (n, n, n, 3), in display values."""
        light = np.clip(linear_from_display_rgb(shown), 0.0, 1.0)
        return cls(name, light ** (1.0 / POWER), lowest)

    def coordinates(self, linear_rgb: ArrayLike) -> Array:
        """Light (..., 3) of linear sRGB in E-Gamut, by which the table is ordered; a mixture of lights mixes them."""
        return np.asarray(np.asarray(linear_rgb, dtype=np.float64) @ E_GAMUT_FROM_RGB.T)

    def shown(self, linear_rgb: ArrayLike) -> Array:
        """Display values (..., 3) in 0 to 1 of linear sRGB (..., 3): tetrahedral between nodes."""
        last = len(self.table) - 1
        light = np.maximum(self.coordinates(linear_rgb), 2.0**self.lowest)
        position = np.clip((np.log2(light) - self.lowest) / STEP, 0.0, last)
        found = tetrahedral(self.table, position)
        return np.asarray(display_rgb_from_linear(np.clip(found, 0.0, 1.0) ** POWER))

    def document(self) -> dict[str, Any]:
        """The entries of a file: 16 bits per value."""
        levels = np.round(self.table * 65535).astype("<u2")
        table = base64.b64encode(levels.tobytes()).decode("ascii")
        return {"name": self.name, "nodes": len(self.table), "lowest": self.lowest, "table": table}

    @classmethod
    def of_document(cls, document: dict[str, Any]) -> AgxView:
        """Read the result of ``document``. Raises InvalidInputError for a table of wrong size."""
        size = int(document["nodes"])
        levels = np.frombuffer(base64.b64decode(document["table"], validate=True), "<u2")
        if not 2 <= size <= 128 or levels.size != 3 * size**3:
            raise InvalidInputError(f"a view of {size} nodes has {levels.size} values; expected {3 * size**3}")
        table = levels.reshape(size, size, size, 3) / 65535.0
        return cls(str(document["name"]), table, float(document["lowest"]))


View = ViewTransform | AgxView


def view_of_document(document: dict[str, Any]) -> View:
    """The view of a file, of either type. Raises InvalidInputError for a table of wrong size."""
    return AgxView.of_document(document) if "nodes" in document else ViewTransform.of_document(document)


def node_light(lowest: float = LOWEST_STOP) -> Array:
    """Linear sRGB (NODES, NODES, NODES, 3) at the nodes of the table, where the add-on samples the view."""
    light = np.exp2(lowest + STEP * np.arange(NODES))
    grid = np.stack(np.meshgrid(light, light, light, indexing="ij"), axis=-1)
    return np.asarray(grid @ np.linalg.inv(E_GAMUT_FROM_RGB).T)


def _xyz_from_rgb(primaries: tuple[tuple[float, float], ...]) -> Array:
    """XYZ (3, 3) of primaries whose sum is white with Y = 1, as columns."""
    columns = np.array([[x / y, 1.0, (1.0 - x - y) / y] for x, y in (*primaries, _WHITE)]).T
    return np.asarray(columns[:, :3] * np.linalg.solve(columns[:, :3], columns[:, 3]))


E_GAMUT_FROM_RGB: Array = np.linalg.solve(_xyz_from_rgb(_E_GAMUT), _xyz_from_rgb(_SRGB))
"""Light in E-Gamut from linear sRGB, (3, 3)."""
E_GAMUT_FROM_RGB.setflags(write=False)

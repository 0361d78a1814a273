# SPDX-License-Identifier: GPL-3.0-or-later
"""The media of a loaded scene: the one at the eye of a view, and changes of their numbers in place."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.render.job import Loaded
from spectral_core.render.live.in_place.transplant import transplant
from spectral_core.render.mitsuba_scene.media.around import media_at
from spectral_core.render.mitsuba_scene.media.rows import medium_row
from spectral_core.render.trace.media.grids import GridRow
from spectral_core.render.trace.media.table import MediumRow
from spectral_core.scene import ScatteringMedium


def look_from(loaded: Loaded, eye: NDArray[np.float64]) -> bool:
    """Let paths begin in the medium at ``eye`` (3,), in the renderer's units. True if it is another one than before."""
    rules = loaded.scene.rules
    if rules.made_media is None:
        return False
    before = rules.around
    numbers = media_at(loaded.mitsuba, loaded.scene.scene, rules.inside, eye, before.world)
    if numbers == before.camera:
        return False
    rules.around = replace(before, camera=numbers)
    rules.made_media.begin_in(numbers)
    return True


def take(loaded: Loaded, subject: str, medium: ScatteringMedium) -> bool:
    """Copy the numbers of another medium of the same kind into that of a material; False, without any change, if
    kernels would differ.
    """
    rules, parts = loaded.scene.rules, loaded.scene.parts
    number = parts.shapes.number_of_medium(subject)
    row = medium_row(parts.context, medium, subject)
    if rules.made_media is None or not number or row is None:
        return False
    mine = rules.media[number - 1]
    if mine.lobes.shape != row.lobes.shape or _kinds(mine.grid) != _kinds(row.grid):
        return False
    pairs = [(getattr(mine, name), getattr(row, name)) for name in ("scattering", "absorption", "emission")]
    if not all(_alike(*pair) and transplant(*pair, loaded.mitsuba) for pair in pairs):
        return False
    grid = mine.grid if row.grid is None or mine.grid is None else replace(row.grid, tints=mine.grid.tints)
    rules.media[number - 1] = MediumRow(mine.scattering, mine.absorption, mine.emission, row.lobes, grid)
    rules.made_media.rewrite()
    return True


def _alike(mine: Any, given: Any) -> bool:
    return (mine is None) == (given is None)


def _kinds(grid: GridRow | None) -> Any:
    """What kernels and the sizes of tables depend on."""
    if grid is None:
        return None
    places = [None if slot is None else next(k for k, other in enumerate(grid.slots) if other is slot)
              for slot in grid.slots]  # fmt: skip
    return [None if slot is None else slot.shape for slot in grid.slots], places, grid.tints is None, grid.own

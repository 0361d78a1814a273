# SPDX-License-Identifier: GPL-3.0-or-later
"""Media in a closed mesh, in a Volume object, or in all of space: the volume socket of a material or a world."""

from __future__ import annotations

from typing import Any

import numpy as np

from spectral_core.scene import ScatteringMedium
from spectral_core.spectra.spectrum import Spectrum

from ..reader import Reader
from ..tree import input_of, linked
from .filling import Filling
from .regions import Region, depends_on_place
from .shaders import FILLS, default_filling, fill_of, spectral_filling

__all__ = ["FILLS", "Filling", "default_filling", "filling_of", "medium_alike", "medium_everywhere"]

UNKNOWN_INSIDE = frozenset({"normal", "true_normal", "incoming", "window", "backfacing", "step_x", "normal_there"})
"""Inputs of programs that depend on the view inside of a volume, in Cycles."""
AROUND = (16, 16, 16)
"""Points of the cube over which means are taken."""


def filling_of(reader: Reader, output: Any, spectrum: Spectrum | None = None) -> Filling | None:
    """The volume shader of an output node; None if its volume socket is unlinked. ``spectrum``: in place of its
    color.
    """
    source = linked(input_of(output, "Volume"))
    if source is None:
        return None
    found = spectral_filling(reader, source, spectrum)
    if found is not None:
        return found
    if spectrum is not None:
        reader.note(
            f"its spectrum does not color {source.label!r}; use Volume Scatter, Volume Absorption or Principled Volume"
        )
    fill = fill_of(reader, source)
    programs = fill.scatters.program(3), fill.absorbs.program(3), fill.emits.program(3)
    filling = Filling(programs, fill.lobes)
    for name in sorted(filling.inputs & UNKNOWN_INSIDE):
        reader.note(f"its volume depends on the {name.replace('_', ' ')}, which is 0 inside of it here")
    return filling


def medium_everywhere(reader: Reader, output: Any) -> ScatteringMedium | None:
    """The medium of a world, which fills all of space: values that vary are replaced by their means, with a note."""
    filling = filling_of(reader, output)
    if filling is None:
        return None
    if depends_on_place(filling):
        reader.note("its volume varies in space; fog without end has the mean everywhere. Put it into a large box")
    return medium_alike(filling)


def medium_alike(filling: Filling) -> ScatteringMedium | None:
    """The medium whose values are means over a cube from -1 to 1, for a shader that has no coordinates; None for empty
    space.
    """
    world_from_index, identity = np.diag([*(2.0 / n for n in AROUND), 1.0]), np.eye(4)
    world_from_index[:3, 3] = -1.0
    around = Region(AROUND, world_from_index, identity, identity, np.zeros(3), np.ones(3))
    return filling.alike(around.at_voxels)

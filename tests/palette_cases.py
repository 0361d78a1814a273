# SPDX-License-Identifier: GPL-3.0-or-later
"""For each field of a palette's cell and light, one that sets it: documents and Blender's table must keep all."""

from __future__ import annotations

import numpy as np

from spectral_core.palette import Cell, PaletteLight
from spectral_core.spectra.observer import xyz_of
from spectral_core.spectra.spectrum import Illuminant, SpectralGrid

GRID = SpectralGrid.uniform(400, 700, 10)
COLOR = (0.2, 0.3, 0.4)
CELLS = {
    "mode": Cell.black(),
    "target": Cell.fixed(COLOR),
    "others": Cell.same_as((0, 1)),
    "box": Cell.free(((0.1, 0.2, 0.3), (0.4, 0.5, 0.6))),
    "weight": Cell.fixed(COLOR, weight=7.5),
    "exact": Cell.fixed(COLOR, exact=True),
}


def lamp(name: str = "lamp", power: float = 0.3) -> Illuminant:
    return Illuminant(name, GRID, np.linspace(power, 2 * power, GRID.size))


LIGHTS = {
    "spectrum": PaletteLight(lamp(power=0.7)),
    "free": PaletteLight(lamp(), free=True),
    "primaries": PaletteLight(lamp(), free=True, primaries=(lamp("red"), lamp("blue", 0.1))),
    "white_xyz": PaletteLight(lamp(), free=True, white_xyz=np.array([0.9, 1.0, 1.1])),
    "luminance": PaletteLight(lamp(), free=True, luminance=float(xyz_of(lamp())[1])),
    "variants": PaletteLight(lamp(), variants=(lamp("other", 0.2),)),
}

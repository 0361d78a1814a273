# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights and materials designed together, so that each material shows a wanted color under each light (thesis ch. 5).

State the task as a ``PaletteProblem``, or use one of ``presets``; ``solve_palette`` returns a ``PaletteSolution``.
"""

from spectral_core.palette.live.session import LivePalette, PaletteSession
from spectral_core.palette.problem import (
    Cell,
    CellMode,
    PaletteLight,
    PaletteProblem,
    PaletteReflectance,
    SubspaceCriterion,
)
from spectral_core.palette.solution import Conflict, PaletteSolution, PaletteStatus
from spectral_core.palette.solve import solve_palette

__all__ = [
    "Cell",
    "CellMode",
    "Conflict",
    "LivePalette",
    "PaletteLight",
    "PaletteProblem",
    "PaletteReflectance",
    "PaletteSession",
    "PaletteSolution",
    "PaletteStatus",
    "SubspaceCriterion",
    "solve_palette",
]

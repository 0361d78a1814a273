# SPDX-License-Identifier: GPL-3.0-or-later
"""A fluorescent palette as an ordinary solution; its notes describe the dyes."""

from __future__ import annotations

import numpy as np

from spectral_core.palette.paint.fluorescent_design import FluorescentSolution
from spectral_core.palette.solution import REMEDIES, VISIBLE_DELTA_E, PaletteSolution, PaletteStatus
from spectral_core.spectra.spectrum import Illuminant, Reflectance

RENDERED = (
    "Apply to Scene gives materials their dyes. Spectral transport renders the dyes' light; the plan selects it for "
    "visible dyes."
)


def palette_solution(found: FluorescentSolution) -> PaletteSolution:
    """The solution of a palette with dyes; reflectances are those without the dyes' light."""
    notes = []
    for surface in found.surfaces:
        used = [(dye, amount) for dye, amount in zip(surface.dyes, surface.amounts, strict=True) if amount > 1e-4]
        if used:
            words = ", ".join(f"{amount:.2f} of {dye.name}" for dye, amount in used)
            notes.append(
                f"{surface.name} holds {words}; it returns at most {100 * surface.returned_share().max():.0f} %."
            )
    if notes:
        notes.append(RENDERED)
    worst = max(float(np.nanmax(found.delta_e_2000, initial=0.0)), found.worst_pair_delta_e_2000)
    status = PaletteStatus.SOLVED if worst <= VISIBLE_DELTA_E else PaletteStatus.COMPROMISE
    if not found.check.passed:
        status = PaletteStatus.INACCURATE
    elif not found.trusted:
        status = PaletteStatus.EXACT_CONFLICT
    elif not found.settled:
        status = PaletteStatus.IMPROVING
    return PaletteSolution(
        problem=found.problem,
        illuminants=tuple(Illuminant(light.name, light.grid, light.values) for light in found.illuminants),
        reflectances=tuple(
            Reflectance(each.name, each.grid, each.reflectance.values.clip(0.0, 1.0)) for each in found.surfaces
        ),
        target_linear_rgb=found.target_linear_rgb,
        actual_linear_rgb=found.actual_linear_rgb,
        delta_e_2000=found.delta_e_2000,
        residuals={"worst_pair_delta_e_2000": found.worst_pair_delta_e_2000},
        kkt_residual=found.check.kkt,
        bound_violation=max(found.largest_returned_share - 1.0, 0.0),
        status=status,
        remedy=REMEDIES[status],
        rounds=found.rounds,
        engines=(),
        notes=(*found.notes, *notes),
        amounts=tuple(None for _ in found.illuminants),
    )

# SPDX-License-Identifier: GPL-3.0-or-later
"""Which requests a recipe of a lamp misses, and by how much."""

from __future__ import annotations

from spectral_core.palette.recipe.lamp import MARGIN, LampQuality, LampRecipe


def missed_requests(recipe: LampRecipe, quality: LampQuality) -> list[str]:
    """The requested indices that the lamp misses, such as ``"Ra 79.0 is below 80"``; empty if it meets all."""
    least = [
        ("Ra", recipe.rendering_index, quality.rendering_index),
        ("Rf", recipe.fidelity, quality.fidelity),
        ("Rg", recipe.gamut, None if quality.gamut is None else quality.gamut[0]),
    ]
    missed = [
        f"{name} {found:.1f} is below {wanted:g}"
        for name, found, wanted in least
        if wanted is not None and found < wanted - MARGIN
    ]
    if quality.gamut is not None and recipe.gamut > quality.gamut[1] + MARGIN:
        missed.append(f"Rg {recipe.gamut:.1f} is above {quality.gamut[1]:g}")
    return missed

# SPDX-License-Identifier: GPL-3.0-or-later
"""Spectra of a palette's solution are stored as they are: 0 to 1 for materials, absolute for lights."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("bpy")

from blender_addon.editing.palette.solve import solve_scene
from blender_addon.translate.palette.solution import store_solution

FAINT = 1e-27
"""What a solver leaves of an exact zero."""


@pytest.fixture
def solved(blender):
    """A table with a solution: its palette, and the solution."""
    palette = blender.context.scene.spectral.palette
    palette.live = False
    blender.ops.spectral.palette_preset(preset="METAMER_PAIR")
    return palette, solve_scene(blender.context.scene)


def values_of(entry) -> np.ndarray:
    return np.array([each.value for each in entry.result.samples])


def test_a_material_that_a_solver_made_black_stays_black(solved) -> None:
    palette, solution = solved
    black = replace(solution.reflectances[0], values=np.linspace(0.0, FAINT, solution.reflectances[0].grid.size))
    store_solution(palette, replace(solution, reflectances=(black, *solution.reflectances[1:])))
    assert values_of(palette.materials[0]).max() == pytest.approx(FAINT, rel=1e-6)


def test_a_light_that_a_solver_switched_off_stays_off(blender, solved) -> None:
    palette, solution = solved
    dark = replace(solution.illuminants[0], values=FAINT * solution.illuminants[0].values)
    store_solution(palette, replace(solution, illuminants=(dark, *solution.illuminants[1:])))
    np.testing.assert_allclose(values_of(palette.lights[0]), dark.values, rtol=1e-6)
    palette.lights[0].light = blender.data.lights.new("off", "POINT")
    blender.ops.spectral.palette_apply()
    assert palette.lights[0].light.spectral.strength == pytest.approx(FAINT, rel=1e-3)

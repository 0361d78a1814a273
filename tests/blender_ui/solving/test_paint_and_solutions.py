# SPDX-License-Identifier: GPL-3.0-or-later
"""Solutions belong to the tints and dyes of a table as well: none of other paints is shown, kept or taken."""

from __future__ import annotations

import pytest

pytest.importorskip("bpy")

import bpy

from blender_addon.editing.palette import solve as palette_solve
from blender_addon.translate.spectra.stored import store_spectrum
from spectral_core.palette.paint.fluorescence import led
from spectral_core.spectra.color import display_rgb_from_linear

VIVID = (0.0, 0.45, 0.2)
"""Under a violet LED only a dye shows it."""


@pytest.fixture
def palette(blender):
    """A material under daylight and a violet LED, from 360 nm on."""
    blender.ops.wm.read_factory_settings(use_empty=True)
    found = bpy.context.scene.spectral.palette
    found.live = False
    for side in ("LIGHT", "LIGHT", "MATERIAL"):
        bpy.ops.spectral.palette_add(side=side)
    store_spectrum(found.lights[1].spectral, led(405))
    found.lights[1].intensity = 0.02
    found.grid_start, found.grid_stop, found.grid_samples = 360, 760, 41
    found.materials[0].cells[0].mode = "FIXED"
    found.materials[0].cells[1].mode = "FIXED"
    found.materials[0].cells[1].target = VIVID
    return found


def with_dye(palette, excitation_nm: float = 405.0):
    bpy.ops.spectral.palette_dye()
    dye = palette.materials[0].dyes[0]
    dye.excitation_nm, dye.emission_nm = excitation_nm, 530
    return dye


def test_a_solution_with_a_dye_is_not_that_of_the_table_without_it(palette) -> None:
    """An undo of the dye showed the colors that only the dye has, as solved."""
    with_dye(palette)
    bpy.ops.spectral.palette_solve()
    assert palette.worst_delta_e < 20
    known = palette_solve.known_solve(bpy.context.scene)
    assert known is not None
    bpy.ops.spectral.palette_dye(index=0)
    assert palette_solve.known_solve(bpy.context.scene) is None
    bpy.ops.spectral.palette_solve()
    assert palette.worst_delta_e > 30
    palette.use_tints = True
    assert palette_solve.known_solve(bpy.context.scene) is None


def test_a_solution_of_another_dye_leaves_the_table_outdated(palette) -> None:
    dye = with_dye(palette)
    solve = palette_solve.button_solve(bpy.context.scene)
    answer = solve.answer()
    dye.emission_nm = 600
    palette_solve.keep(bpy.context.scene, solve, answer)
    assert palette.is_stale


def test_alternatives_are_not_taken_beside_tints_and_dyes(palette) -> None:
    """The table then showed colors without the dye, and Apply gave the material its dye all the same."""
    palette.materials[0].cells[1].mode = "FREE"
    bpy.ops.spectral.palette_alternatives()
    assert len(palette.alternatives) > 1
    with_dye(palette)
    with pytest.raises(RuntimeError, match="do not support tints and dyes"):
        bpy.ops.spectral.palette_alternative_take(index=1)
    bpy.ops.spectral.palette_dye(index=0)
    bpy.ops.spectral.palette_alternative_take(index=1)
    assert palette.is_alternative


def test_possible_counts_the_dyes_of_a_material(palette) -> None:
    """A color that the table showed was called impossible, by ΔE 38."""
    with_dye(palette)
    bpy.ops.spectral.palette_solve()
    cell = palette.materials[0].cells[1]
    cell.target = display_rgb_from_linear(cell.actual_linear)
    palette.active_row, palette.active_column = 0, 1
    bpy.ops.spectral.palette_possible()
    assert palette.possible.reachable, palette.possible.words
    bpy.ops.spectral.palette_dye(index=0)
    bpy.ops.spectral.palette_possible()
    assert not palette.possible.reachable

# SPDX-License-Identifier: GPL-3.0-or-later
"""Spectra that are shown before they are applied leave the picture with their row, their table, or an undo."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from blender_addon.editing.palette.picture import shown_in  # noqa: E402


@pytest.fixture
def palette(blender):
    """A solved table whose first row is the material "Mark", which shows its spectrum."""
    blender.ops.spectral.palette_preset(preset="HIDDEN_MARK")
    found = blender.context.scene.spectral.palette
    found.materials[0].material = bpy.data.materials.new("Mark")
    blender.ops.spectral.palette_solve()
    return found


def shown():
    """Names of the materials with spectra that are not applied."""
    numbers = shown_in(bpy.context.scene)
    return [each.name for each in bpy.data.materials if each.session_uid in numbers]


def test_a_material_that_is_chosen_for_a_row_shows_its_spectrum(palette) -> None:
    assert shown() == ["Mark"]
    palette.materials[0].material = bpy.data.materials.new("Other")
    assert shown() == ["Other"]
    palette.materials[0].material = None
    assert shown() == []


def test_a_cleared_table_shows_nothing(palette) -> None:
    bpy.ops.spectral.palette_clear()
    assert shown() == []
    assert palette.picture == ""


def test_a_table_that_cannot_be_solved_shows_nothing_of_the_one_before(palette) -> None:
    from blender_addon.editing.palette import solve
    from spectral_core.errors import InvalidInputError

    real = solve.palette_problem

    def refusing(table):
        if table.materials[0].name == "Paint 1":
            raise InvalidInputError("no table of this kind")
        return real(table)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(solve, "palette_problem", refusing)
        with pytest.raises(RuntimeError, match="no table of this kind"):
            bpy.ops.spectral.palette_preset(preset="METAMER_PAIR")
    assert shown() == []


@pytest.mark.parametrize("live", [True, False])
def test_removed_rows_show_nothing(palette, live) -> None:
    palette.live = live
    while len(palette.materials) > 1:
        bpy.ops.spectral.palette_remove(side="MATERIAL", index=1)
    assert shown() == ["Mark"]
    bpy.ops.spectral.palette_remove(side="MATERIAL", index=0)
    assert shown() == []


def test_an_undo_shows_the_spectra_of_a_table_that_is_not_live(palette) -> None:
    palette.live = False
    first = shown_in(bpy.context.scene)[palette.materials[0].material.session_uid][0].values
    bpy.ops.ed.undo_push(message="before")
    palette.materials[0].cells[1].target = (0.2, 0.5, 0.9)
    bpy.ops.spectral.palette_solve()
    bpy.ops.ed.undo_push(message="solved")
    bpy.ops.spectral.palette_apply()
    bpy.ops.ed.undo_push(message="applied")
    assert shown() == []
    bpy.ops.ed.undo()
    assert shown() == ["Mark"], "it is not applied any more"
    bpy.ops.ed.undo()
    mark = bpy.data.materials["Mark"]
    np.testing.assert_allclose(shown_in(bpy.context.scene)[mark.session_uid][0].values, first, atol=1e-6)


def test_an_undo_keeps_the_words_on_how_the_solution_is_shown(palette) -> None:
    words, palette.picture = palette.picture, ""  # a step that Blender stored between an edit and its solution
    assert words.startswith("Rendered anew")
    bpy.ops.ed.undo_push(message="edited")
    palette.picture = words
    palette.show_curves = not palette.show_curves
    bpy.ops.ed.undo_push(message="else")
    bpy.ops.ed.undo()
    assert bpy.context.scene.spectral.palette.picture == words

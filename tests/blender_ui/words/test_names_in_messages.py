# SPDX-License-Identifier: GPL-3.0-or-later
"""Messages about a palette's solution name rows and columns as the table shows them, also after a new name."""

from __future__ import annotations

import pytest

bpy = pytest.importorskip("bpy")


@pytest.fixture
def palette(blender):
    """A table whose sodium light cannot show an exact green."""
    blender.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.spectral.palette_preset(preset="METAMER_PAIR")
    palette = bpy.context.scene.spectral.palette
    palette.materials[0].cells[0].target = (0.0, 1.0, 0.0)
    assert palette.status == "compromise" and len(palette.conflicts)
    return palette


def told(palette) -> str:
    return "\n".join([palette.remedy, palette.notes, palette.message, *(each.text for each in palette.conflicts)])


def test_conflicts_follow_new_names(palette) -> None:
    assert "“Paint 1” under “Sodium”" in told(palette) and "reach under “Sodium”" in told(palette)
    palette.materials[0].name, palette.lights[0].name = "Leaf", "Street"
    assert "“Leaf” under “Street”" in told(palette) and "reach under “Street”" in told(palette)
    assert "Paint 1" not in told(palette) and "Sodium" not in told(palette)
    assert not palette.is_stale  # a name changes no solution


def test_notes_follow_new_names(palette) -> None:
    palette.notes = "light 'Sodium' is black\nmaterial 'Paint 1' is black\nlight 'Paint 1' is none"
    palette.materials[0].name, palette.lights[0].name = "It's", "Street"
    assert palette.notes == "light 'Street' is black\nmaterial \"It's\" is black\nlight 'Paint 1' is none"


def test_an_undo_of_a_new_name_brings_back_a_solution_under_the_old_one(palette) -> None:
    def present():
        return bpy.context.scene.spectral.palette

    bpy.ops.ed.undo_push(message="before")
    palette.lights[0].name, palette.materials[0].name = "Street", "Leaf"
    bpy.ops.ed.undo_push(message="renamed")
    palette.materials[1].cells[1].target = (0.2, 0.3, 0.4)
    palette.materials[1].cells[1].target = (0.5, 0.5, 0.5)
    present().is_stale = True  # a step between the edit and its solution
    bpy.ops.ed.undo_push(message="edited")
    bpy.ops.ed.undo()
    bpy.ops.ed.undo()
    assert present().lights[0].name == "Sodium" and "Street" not in told(present())
    assert "“Paint 1” under “Sodium”" in told(present())
    assert [each.result.spectrum_name for each in present().lights] == [each.name for each in present().lights]


def test_a_new_name_during_the_solve_stays(palette, monkeypatch) -> None:
    from blender_addon.editing.palette import solve

    found = solve.button_solve(bpy.context.scene)
    answer = found.answer()
    palette.lights[0].name, palette.materials[0].name = "Street", "Leaf"
    assert solve.keep(bpy.context.scene, found, answer) is not None
    assert "“Leaf” under “Street”" in told(palette) and "Sodium" not in told(palette)
    assert (palette.lights[0].result.spectrum_name, palette.materials[0].result.spectrum_name) == ("Street", "Leaf")


def test_a_light_and_a_material_of_one_name_are_told_apart(palette) -> None:
    palette.materials[0].name = "Sodium"
    assert "“Sodium” under “Sodium”" in told(palette)
    palette.lights[0].name = "Street"
    assert "“Sodium” under “Street”" in told(palette)
    palette.materials[0].name = "Street"
    palette.materials[0].name = "Leaf"
    assert "“Leaf” under “Street”" in told(palette)


def test_an_error_of_the_table_follows_a_new_name(palette) -> None:
    palette.materials[1].design = "MEASURED"
    assert "material 'Paint 2' is measured but has no spectrum" in palette.message
    palette.materials[1].name = "Wall"
    assert "material 'Wall' is measured but has no spectrum" in palette.message


def test_an_answer_about_possible_colors_keeps_no_old_name(palette) -> None:
    palette.active_row, palette.active_column = 1, 1
    palette.materials[1].cells[1].target = (0.1, 0.9, 0.9)
    bpy.ops.spectral.palette_possible()
    words = palette.possible.words
    assert words
    palette.lights[0].name = palette.lights[1].name = "Lamp"
    assert not any(name in palette.possible.words for name in ("Sodium", "Daylight"))


def test_names_of_a_file_of_an_earlier_version_are_known(palette, tmp_path) -> None:
    for entry in (*palette.lights, *palette.materials):
        entry.known_as = ""
    path = str(tmp_path / "old.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    opened = bpy.context.scene.spectral.palette
    opened.materials[0].name = "Leaf"
    assert "“Leaf” under “Sodium”" in told(opened)


def test_a_name_is_never_empty_and_has_one_line(blender):
    """A cleared name left a column, a button and a look without a word, and "Targets under , Light 3"."""
    bpy.ops.spectral.palette_preset(preset="METAMER_PAIR")
    palette = bpy.context.scene.spectral.palette
    bpy.ops.spectral.look_under(kind="COLUMN", name="Sodium", side="look")
    first = palette.lights[0].name
    for cleared in ("", "  ", "\n\t"):
        palette.lights[0].name = palette.materials[0].name = cleared
        assert palette.lights[0].name == first and palette.materials[0].name == "Paint 1"
    assert bpy.context.scene.spectral.viewport.look.column == "Sodium"
    palette.materials[0].name = "Wall,\nleft\tside"
    assert palette.materials[0].name == "Wall, left side"
    palette.materials[1].name = "Wall, left\r\nside"
    assert palette.materials[1].name == "Wall, left side 2"
    palette.materials[1].name = "漢字  Ω 😀"
    assert palette.materials[1].name == "漢字  Ω 😀"

# SPDX-License-Identifier: GPL-3.0-or-later
"""Buttons act on the selected row, column or material, and each entry of an answer is stored in its own place."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("bpy")

import bpy

from blender_addon.editing.palette import possible
from blender_addon.operators.render import store_plan
from blender_addon.translate.palette import table
from blender_addon.translate.palette.from_scene import add_light
from blender_addon.translate.palette.load import require_storable
from blender_addon.translate.palette.problem import palette_problem
from blender_addon.translate.palette.solution import store_solution
from blender_addon.translate.palette.table import references
from blender_addon.translate.spectra.stored import spectrum_of, store_spectrum
from spectral_core.errors import InvalidInputError
from spectral_core.palette import presets, solve_palette
from spectral_core.render.plan.decision import Decision
from spectral_core.spectra.catalogue import illuminant
from spectral_core.spectra.color import display_rgb_from_linear
from spectral_core.spectra.spectrum import Illuminant, SpectralGrid


@pytest.fixture
def palette(blender: Any) -> Any:
    """Two lights and three materials; nothing is solved at an edit."""
    found = blender.context.scene.spectral.palette
    found.live = False
    for side in ("LIGHT", "LIGHT", "MATERIAL", "MATERIAL", "MATERIAL"):
        blender.ops.spectral.palette_add(side=side)
    return found


def test_the_selected_row_or_column_is_removed(blender: Any, palette: Any) -> None:
    for number, each in enumerate((*palette.materials, *palette.lights)):
        each.name = f"n{number}"
    palette.active_row, palette.active_column = 1, 0
    blender.ops.spectral.palette_remove(side="MATERIAL")
    assert [each.name for each in palette.materials] == ["n0", "n2"]
    blender.ops.spectral.palette_remove(side="LIGHT")
    assert [each.name for each in palette.lights] == ["n4"]


@pytest.mark.parametrize(("side", "reached"), [("LIGHT", {(0, 1), (1, 1), (2, 1)}), ("MATERIAL", {(1, 0), (1, 1)})])
def test_a_target_is_copied_along_the_row_or_column_of_the_selected_cell(blender, palette, side, reached) -> None:
    for row in palette.materials:
        for cell in row.cells:
            cell.weight = 2.0
    palette.active_row, palette.active_column = 1, 1
    palette.materials[1].cells[1].weight = 5.0
    blender.ops.spectral.palette_spread(side=side)
    found = {(i, j) for i, row in enumerate(palette.materials) for j, cell in enumerate(row.cells) if cell.weight == 5}
    assert found == reached


def referring(palette: Any) -> list[list[tuple[str, list[tuple[int, int]]]]]:
    return [[(cell.mode, references(palette, cell)) for cell in row.cells] for row in palette.materials]


def test_a_reference_is_copied_along_the_column_and_its_source_stays(blender, palette) -> None:
    palette.active_row, palette.active_column = 0, 1
    palette.materials[2].cells[1].mode = "FIXED"
    palette.materials[0].cells[1].mode = "SAME"
    blender.ops.spectral.palette_refer(row=2, column=1)
    blender.ops.spectral.palette_spread(side="LIGHT")
    assert [row[1] for row in referring(palette)] == [("SAME", [(2, 1)]), ("SAME", [(2, 1)]), ("FIXED", [])]


def test_a_reference_moves_with_the_row_or_column_of_the_copy(blender, palette) -> None:
    palette.active_row, palette.active_column = 1, 1
    palette.materials[1].cells[1].mode = "CONSTANT"
    blender.ops.spectral.palette_refer(row=1, column=0)
    blender.ops.spectral.palette_refer(row=1, column=0)
    blender.ops.spectral.palette_spread(side="LIGHT")
    assert [row[1] for row in referring(palette)] == [("CONSTANT", [(row, 0)]) for row in range(3)]
    palette.active_column = 0
    palette.materials[1].cells[0].mode = "SAME"
    blender.ops.spectral.palette_refer(row=2, column=0)
    blender.ops.spectral.palette_spread(side="MATERIAL")
    assert referring(palette)[1] == [("SAME", [(2, 0)]), ("SAME", [(2, 1)])]


@pytest.mark.parametrize("where", ["PRIMARIES", "VARIANTS"])
def test_a_lamp_is_added_to_and_removed_from_the_selected_light(blender, palette, where) -> None:
    palette.active_column = 1
    for lamp in ("FL2", "HP1"):
        blender.ops.spectral.palette_lamp_add(to=where, lamp=lamp)
    first, second = (getattr(light, where.lower()) for light in palette.lights)
    assert len(first) == 0 and [each.name for each in second] == ["FL2", "HP1"]
    np.testing.assert_allclose(spectrum_of(second[1]).values.argmax(), illuminant("HP1").values.argmax(), atol=1)
    blender.ops.spectral.palette_lamp_remove(to=where, index=0)
    assert [each.name for each in second] == ["HP1"]


def test_a_dye_is_added_to_the_selected_material(blender, palette) -> None:
    palette.active_row = 2
    blender.ops.spectral.palette_dye()
    assert [len(each.dyes) for each in palette.materials] == [0, 0, 1]


def test_a_light_of_the_scene_brings_its_spectrum(blender, palette) -> None:
    lamps = [bpy.data.lights.new(name, "POINT") for name in ("named", "stored", "plain")]
    lamps[0].spectral.source, lamps[0].spectral.catalogue_name = "CATALOGUE", "FL2"
    mine = Illuminant("mine", SpectralGrid(np.linspace(400, 700, 7)), np.linspace(0.1, 0.7, 7))
    store_spectrum(lamps[1].spectral, mine)
    for lamp in lamps:
        add_light(palette, lamp)
    named, stored, plain = list(palette.lights)[-3:]  # adding a row may move the earlier ones in memory
    assert (named.spectral.source, named.spectral.catalogue_name, named.light) == ("CATALOGUE", "FL2", lamps[0])
    np.testing.assert_allclose(spectrum_of(stored).values, mine.values, rtol=1e-6)
    assert stored.spectral.source != "CATALOGUE" and stored.name == "stored"
    np.testing.assert_allclose(spectrum_of(plain).values, spectrum_of(palette.lights[0]).values)


def test_a_palette_of_sampled_wavelengths_is_refused() -> None:
    problem = presets.metamer_pair()
    sampled = SpectralGrid(problem.grid.wavelengths_nm, interpolation="sampled")
    require_storable(problem)
    with pytest.raises(InvalidInputError, match=r"sampled.*linear between them"):
        require_storable(type(problem)(sampled, problem.lights, problem.reflectances, problem.cells))


def test_every_number_of_a_solution_is_stored(blender) -> None:
    blender.ops.spectral.palette_preset(preset="HIDDEN_MARK")
    palette = blender.context.scene.spectral.palette
    palette.live, palette.scale_lights = False, True
    cell = palette.materials[0].cells[0]
    cell.mode, cell.target, cell.weight = "FIXED", (1.0, 1.0, 1.0), 5.0
    solution = solve_palette(palette_problem(palette))
    store_solution(palette, solution)
    assert (palette.status, palette.remedy) == (str(solution.status), solution.remedy) != ("", "")
    assert palette.notes.splitlines() == [line for note in solution.notes for line in note.splitlines()]
    assert palette.worst_delta_e == pytest.approx(solution.max_delta_e_2000, rel=1e-5) != 0.0
    assert palette.light_scale == pytest.approx(solution.light_scale, rel=1e-5) != 1.0
    assert palette.milliseconds == pytest.approx(1000 * solution.timings["total"], rel=1e-3)
    for (i, j), cell in np.ndenumerate([list(row.cells) for row in palette.materials]):
        np.testing.assert_allclose(cell.actual_linear, solution.actual_linear_rgb[i, j], rtol=1e-6)
        asks = np.isfinite(solution.target_linear_rgb[i, j]).all()
        wanted = solution.target_linear_rgb[i, j] if asks else solution.actual_linear_rgb[i, j]
        np.testing.assert_allclose(cell.wanted_linear, wanted, rtol=1e-6)
        for shown, linear in ((cell.actual_display, cell.actual_linear), (cell.wanted_display, cell.wanted_linear)):
            np.testing.assert_allclose(shown, display_rgb_from_linear(np.array(linear)), atol=1e-5)
        if np.isfinite(solution.delta_e_2000[i, j]):
            assert cell.delta_e == pytest.approx(float(solution.delta_e_2000[i, j]), rel=1e-4)
    assert [entry.text for entry in palette.conflicts] == [each.text for each in solution.conflicts]
    for light, spectrum in zip(palette.lights, solution.illuminants, strict=True):
        np.testing.assert_allclose([each.value for each in light.result.samples], spectrum.values, rtol=1e-6)


def test_an_answer_on_possible_colors_keeps_each_of_its_parts(blender) -> None:
    blender.ops.spectral.palette_preset(preset="HIDDEN_MARK")
    scene = blender.context.scene
    palette = scene.spectral.palette
    palette.active_row, palette.active_column = 1, 1
    cell = palette.materials[1].cells[1]
    cell.mode, cell.target = "FIXED", (0.1, 0.8, 0.3)
    question = possible.question_of(palette)
    assert question.place == (1, 1) and question.lights == tuple(palette.lights.keys())
    assert question.uids == (palette.materials[1].uid, palette.lights[1].uid)
    np.testing.assert_allclose(display_rgb_from_linear(question.wanted), (0.1, 0.8, 0.3), atol=1e-6)
    for reachable, delta_e_2000 in ((True, 0.0), (False, 3.0)):
        color = np.array([0.2, 0.5, 1.4])
        found = SimpleNamespace(color=color, reachable=reachable, delta_e_2000=delta_e_2000)
        picture, taken = np.zeros((2, 2, 4), np.float32), 0.99 * color
        answer = possible.keep(scene, possible.Answer(question, found, taken, "the words", picture))  # type: ignore[arg-type]
        assert (answer.material_uid, answer.light_uid) == question.uids
        np.testing.assert_allclose(answer.asked, (0.1, 0.8, 0.3), atol=1e-6)
        np.testing.assert_allclose(answer.nearest, np.clip(display_rgb_from_linear(found.color), 0, 1), atol=1e-6)
        np.testing.assert_allclose(answer.nearest_linear, taken, atol=1e-6)
        assert (answer.reachable, answer.words) == (reachable, "the words")
        assert possible.picture_of(scene) is picture


def test_a_cell_without_a_target_asks_for_the_color_that_it_has(blender) -> None:
    blender.ops.spectral.palette_preset(preset="HIDDEN_MARK")
    palette = blender.context.scene.spectral.palette
    cell = palette.materials[0].cells[0]
    cell.target, cell.actual_display, cell.has_result, cell.mode = (0.1, 0.2, 0.3), (0.6, 0.5, 0.4), True, "IGNORE"
    palette.active_row = palette.active_column = 0
    np.testing.assert_allclose(possible.question_of(palette).wanted, _linear(cell.actual), atol=1e-6)
    cell.has_result = False
    np.testing.assert_allclose(possible.question_of(palette).wanted, _linear(cell.target), atol=1e-6)


def _linear(display: Any) -> Any:
    from spectral_core.spectra.color import linear_from_display_rgb

    return linear_from_display_rgb(display)


def test_every_part_of_a_decision_is_stored_for_the_panel(blender) -> None:
    settings = blender.context.scene.spectral.render
    rows = [
        Decision(name="bounces", value="4", reason="why", cost_if_left_out="ΔE 2", error=0.25, how="pilot",
                 time_share=0.125, choices=("1", "4"), overridable=True, source="artist"),
        Decision(name="transport", value="rgb", reason="else", cost_if_left_out="", error=None, how="data",
                 time_share=0.5, choices=(), overridable=False, source="plan"),
    ]  # fmt: skip
    store_plan(settings, SimpleNamespace(accepted=0.75, decisions=rows))  # type: ignore[arg-type]
    assert settings.plan_accepted == 0.75
    names = ("name", "value", "reason", "cost", "error", "how", "time_share", "choices", "is_overridable", "is_artists")
    assert [tuple(getattr(line, name) for name in names) for line in settings.plan] == [
        ("bounces", "4", "why", "ΔE 2", 0.25, "pilot", 0.125, "1|4", True, True),
        ("transport", "rgb", "else", "", -1.0, "data", 0.5, "", False, False),
    ]


def test_a_look_is_chosen_and_taken_back_on_each_side(blender) -> None:
    settings = blender.context.scene.spectral.viewport
    for side in ("look", "other"):
        look = getattr(settings, side)
        for kind, name in (("LAMP", "HP1"), ("GROUP", "keys"), ("COLUMN", "day")):
            blender.ops.spectral.look_under(kind=kind, name=name, side=side)
            assert (look.kind, getattr(look, kind.lower())) == (kind, name)
        blender.ops.spectral.look_under(kind="COLUMN", name="night", side=side)
        assert (look.kind, look.column) == ("COLUMN", "night")
        blender.ops.spectral.look_under(kind="COLUMN", name="night", side=side)
        assert look.kind == "SCENE"  # the same button again
        blender.ops.spectral.look_under(kind="COLUMN", name="night", side=side)
        blender.ops.spectral.look_under(kind="SCENE", side=side)
        assert look.kind == "SCENE"


def test_a_split_view_takes_two_lights_of_the_palette_or_a_sodium_lamp(blender, palette) -> None:
    settings, names = blender.context.scene.spectral.viewport, [light.name for light in palette.lights]
    blender.ops.spectral.look_split()
    sides = settings.look, settings.other
    assert settings.is_split
    assert [(each.kind, each.column) for each in sides] == [("COLUMN", name) for name in names]
    blender.ops.spectral.look_split()
    assert not settings.is_split
    sides[0].kind = sides[1].kind = "SCENE"
    blender.ops.spectral.palette_remove(side="LIGHT")
    blender.ops.spectral.look_split()
    assert [each.kind for each in sides] == ["COLUMN", "LAMP"] and sides[1].lamp == "HP1"
    blender.ops.spectral.look_split()
    sides[0].kind, sides[1].kind = "GROUP", "SCENE"
    blender.ops.spectral.look_split()
    assert [each.kind for each in sides] == ["GROUP", "SCENE"]  # a choice of the artist's is kept


def test_the_selection_stays_in_the_table_and_moves_only_if_it_must(palette: Any) -> None:
    palette.active_row, palette.active_column = 1, 0
    table.remove_material(palette, 2)
    assert (palette.active_row, palette.active_column) == (1, 0)
    table.remove_material(palette, 0)
    assert (palette.active_row, palette.active_column) == (0, 0)
    palette.active_column = 1
    table.remove_material(palette, 0)
    assert (palette.active_row, palette.active_column) == (0, 1)
    assert table.active_cell(palette) is None
    table.remove_light(palette, 0)
    assert palette.active_column == 0

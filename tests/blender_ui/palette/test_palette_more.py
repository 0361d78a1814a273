# SPDX-License-Identifier: GPL-3.0-or-later
"""Alternatives, tints and fluorescent dyes through the palette's own operators."""

from __future__ import annotations

import json
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("bpy")

from blender_addon.editing.palette.live import LIVE
from blender_addon.translate.spectra.stored import spectrum_of
from spectral_core.spectra.observer import linear_rgb_from_product


@pytest.fixture
def palette(blender):
    blender.ops.spectral.palette_preset(preset="HIDDEN_MARK")
    return blender.context.scene.spectral.palette


def shown(palette, name="actual_linear"):
    return np.array([[tuple(getattr(cell, name)) for cell in material.cells] for material in palette.materials])


def test_alternatives_are_found_selected_and_found_again_with_a_locked_material(blender, palette) -> None:
    before = shown(palette)
    palette.alternative_count = 3
    blender.ops.spectral.palette_alternatives()
    assert len(palette.alternatives) == 3
    assert palette.alternatives[1].apart > 3
    assert np.array(json.loads(palette.alternatives[1].colors)).shape[2] == 3
    blender.ops.spectral.palette_alternative_take(index=1)
    np.testing.assert_allclose(shown(palette), before, atol=1e-4)  # every cell of this table has a request
    kept = spectrum_of(palette.materials[0], "result").values
    stored = json.loads(palette.alternatives[1].spectra)[str(palette.materials[0].uid)]
    np.testing.assert_allclose(kept, stored["values"], atol=1e-5)
    palette.materials[0].locked = True
    blender.ops.spectral.palette_alternatives(seed=2)
    for answer in palette.alternatives:
        stored = json.loads(answer.spectra)[str(palette.materials[0].uid)]
        np.testing.assert_allclose(stored["values"], kept, atol=1e-5)
    with pytest.raises(RuntimeError, match="there is no alternative 9"):
        blender.ops.spectral.palette_alternative_take(index=9)


def spectra_of(palette):
    entries = [*palette.lights, *palette.materials]
    return [np.array(spectrum_of(entry, "result").values) for entry in entries]


def recomputed(palette):
    """Colors of the table by its stored spectra."""
    lights = [spectrum_of(light, "result") for light in palette.lights]
    surfaces = [spectrum_of(material, "result") for material in palette.materials]
    return np.array(
        [[linear_rgb_from_product(light, each.grid) @ each.values for light in lights] for each in surfaces]
    )


def test_an_alternative_brings_its_own_lights_colors_and_errors(blender, palette) -> None:
    """The search starts anew: its designed lights are not those of a palette that was edited live."""
    blender.ops.spectral.palette_preset(preset="SPLIT_LIGHT")
    cells = palette.materials[0].cells
    cells[0].mode = "FREE"
    for material in palette.materials[1:]:
        material.cells[0].mode = "SAME"  # as the first
    for green in (0.5, 0.4):
        cells[1].target = (0.3, green, 0.6)
    palette.alternative_count = 3
    blender.ops.spectral.palette_alternatives()
    for index in range(len(palette.alternatives)):
        blender.ops.spectral.palette_alternative_take(index=index)
        stored = json.loads(palette.alternatives[index].spectra)
        for entry, values in zip([*palette.lights, *palette.materials], spectra_of(palette), strict=True):
            np.testing.assert_allclose(values, stored[str(entry.uid)]["values"], atol=1e-5)
        np.testing.assert_allclose(shown(palette), recomputed(palette), atol=2e-5)
        same = [material.cells[0] for material in palette.materials[1:]]
        for cell in same:
            np.testing.assert_allclose(cell.wanted_linear, cells[0].actual_linear, atol=1e-4)
            assert cell.delta_e < 0.1


def test_an_alternative_of_dim_lights_keeps_their_spectra(blender, palette) -> None:
    """A designed light of a thousandth of the usual power has samples of 1e-5 per nm; they were rounded to 1e-6.

    The given light has the new brightness, too, without a solve in between.
    """
    blender.ops.spectral.palette_preset(preset="SPLIT_LIGHT")
    palette.live = False
    palette.brightness = 0.01
    for material in palette.materials:
        for cell in material.cells:
            cell.target = np.array(cell.target) / 40
    palette.alternative_count = 2
    blender.ops.spectral.palette_alternatives()
    blender.ops.spectral.palette_alternative_take(index=0)
    np.testing.assert_allclose(shown(palette), recomputed(palette), atol=1e-7)


def test_an_alternative_of_another_table_is_refused(blender, palette) -> None:
    blender.ops.spectral.palette_alternatives()
    palette.materials[0].name = "Renamed"
    blender.ops.spectral.palette_alternative_take(index=1)  # a name changes no answer
    before = spectra_of(palette)
    palette.materials[0].cells[1].target = (0.1, 0.9, 0.2)
    blender.ops.spectral.palette_solve()
    after = spectra_of(palette)
    assert max(np.abs(a - b).max() for a, b in zip(before, after, strict=True)) > 1e-3
    with pytest.raises(RuntimeError, match="the table has changed since this alternative was found"):
        blender.ops.spectral.palette_alternative_take(index=0)
    for a, b in zip(after, spectra_of(palette), strict=True):
        np.testing.assert_array_equal(a, b)


def test_a_taken_alternative_stays_when_something_else_is_undone(blender, palette) -> None:
    blender.ops.spectral.palette_alternatives()
    blender.ops.spectral.palette_alternative_take(index=1)
    taken = spectra_of(palette)
    blender.ops.ed.undo_push(message="taken")
    blender.context.scene.frame_start = 17
    blender.ops.ed.undo_push(message="else")
    blender.ops.ed.undo()
    undone = blender.context.scene.spectral.palette
    LIVE.flush(blender.context.scene)
    for a, b in zip(taken, spectra_of(undone), strict=True):
        np.testing.assert_allclose(a, b, atol=1e-6)


def test_tints_match_if_requested(blender, palette) -> None:
    from blender_addon.translate.palette.problem import palette_problem
    from spectral_core.palette import solve_palette
    from spectral_core.palette.paint.mixtures import tint_differences

    plain = solve_palette(palette_problem(palette))
    palette.use_tints, palette.tint_weight = True, 1.0
    assert palette.is_stale
    blender.ops.spectral.palette_solve()
    assert palette.status
    assert not palette.message
    spectra = [spectrum_of(material, "result").values for material in palette.materials]
    apart = [np.abs(spectra[0] - spectra[1]).max(), np.abs(plain.reflectances[0].values - spectra[0]).max()]
    assert min(apart) > 1e-3  # the spectra differ from those without tints, and from each other
    assert float(tint_differences(plain, [(0, 1)], base=0.9, levels=(0.5,)).max()) > 1


def test_a_dye_is_designed(blender) -> None:
    blender.ops.spectral.palette_preset(preset="METAMER_PAIR")
    palette = blender.context.scene.spectral.palette
    palette.active_row = 0
    blender.ops.spectral.palette_dye()
    dye = palette.materials[0].dyes[0]
    dye.excitation_nm, dye.emission_nm = 380, 530
    with pytest.raises(RuntimeError, match="begin at 360 nm"):
        blender.ops.spectral.palette_solve()
    palette.grid_start, palette.grid_stop, palette.grid_samples = 360, 720, 37
    palette.lights[0].design = palette.lights[1].design = "MEASURED"
    blender.ops.spectral.palette_solve()
    assert palette.status
    assert dye.amount >= 0
    if dye.amount > 1e-4:
        assert "Apply to Scene gives materials their dyes" in palette.notes
    palette.use_tints = True
    with pytest.raises(RuntimeError, match="not designed together"):
        blender.ops.spectral.palette_solve()
    palette.use_tints = False
    blender.ops.spectral.palette_dye(index=0)
    assert not len(palette.materials[0].dyes)
    with pytest.raises(RuntimeError, match="there is no dye 3"):
        blender.ops.spectral.palette_dye(index=3)


def test_tints_and_dyes_are_designed_with_the_settings_of_the_table(palette, monkeypatch) -> None:
    from blender_addon.translate.palette.paint import solver_of
    from blender_addon.translate.palette.problem import palette_problem
    from spectral_core.palette.paint import fluorescent_design, fluorescent_report, tints

    asked = {}
    monkeypatch.setattr(tints, "solve_with_tints", lambda _, criterion, **_warm: asked.update(weight=criterion.weight))
    palette.use_tints, palette.tint_weight = True, 3.5
    solver_of(palette).solve(palette_problem(palette), None)
    assert asked["weight"] == pytest.approx(3.5)

    def designed(_problem, dyes, start):
        asked.update(dyes=dyes, start=start)
        return SimpleNamespace(surfaces={0: SimpleNamespace(amounts=[0.25])})

    monkeypatch.setattr(fluorescent_design, "solve_fluorescent", designed)
    monkeypatch.setattr(fluorescent_report, "palette_solution", lambda found: found)
    palette.use_tints = False
    dye = palette.materials[0].dyes.add()
    dye.excitation_nm, dye.emission_nm = 431, 562
    solver = solver_of(palette)
    solver.solve(palette_problem(palette), None)
    solver.store(palette)
    assert [each.name for each in asked["dyes"][0]] == ["dye 431 to 562 nm"]
    assert dye.amount == pytest.approx(0.25)


@pytest.mark.parametrize("absorbed", [305.0, 310.0, 345.0, 405.0])
def test_a_dye_can_be_designed_after_the_remedy_of_the_message(blender, palette, absorbed) -> None:
    palette.live, palette.grid_start = False, 480.0
    palette.active_row = 0
    blender.ops.spectral.palette_dye()
    dye = palette.materials[0].dyes[0]
    dye.excitation_nm = absorbed
    with pytest.raises(RuntimeError, match="a dye absorbs light around") as raised:
        blender.ops.spectral.palette_solve()
    words = str(raised.value)
    if "give the dye" in words:
        dye.excitation_nm = float(words.rpartition("give the dye ")[2].partition(" nm")[0])
    palette.grid_start = float(words.rpartition("begin at ")[2].partition(" nm")[0])
    blender.ops.spectral.palette_solve()
    assert not palette.message
    assert palette.status


def test_a_range_with_exchanged_ends_names_its_cell(blender, palette) -> None:
    cell = palette.materials[0].cells[1]
    cell.mode, cell.use_box = "FREE", True
    cell.box_low, cell.box_high = (0.9, 0.9, 0.9), (0.1, 0.1, 0.1)
    assert palette.message.startswith("'Mark' under 'Sodium': the color box runs from")

# SPDX-License-Identifier: GPL-3.0-or-later
"""Solving in Blender: presets, live edits of every property, apply, undo, and messages on failure."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("bpy")

from blender_addon.operators.palette.solve import PRESETS
from blender_addon.translate.palette.problem import palette_problem
from blender_addon.translate.palette.table import places, references
from blender_addon.translate.spectra.stored import spectrum_of, strength_of
from spectral_core.palette import presets, solve_palette
from spectral_core.spectra.color import delta_e_2000, lab_from_linear_rgb, linear_rgb_from_xyz
from spectral_core.spectra.observer import normalized, xyz_of


@pytest.fixture
def palette(blender):
    """The hidden mark, solved."""
    blender.ops.spectral.palette_preset(preset="HIDDEN_MARK")
    return blender.context.scene.spectral.palette


def actual(palette) -> np.ndarray:
    return np.array([[tuple(cell.actual_linear) for cell in material.cells] for material in palette.materials])


@pytest.mark.parametrize("preset", [name for name, *_ in PRESETS])
def test_every_preset_in_the_table_is_the_problem_of_the_library(blender, preset):
    blender.ops.spectral.palette_preset(preset=preset)
    palette = blender.context.scene.spectral.palette
    wanted, stored = getattr(presets, preset.lower())(), palette_problem(palette)
    assert all(len(light.name) < 10 for light in stored.lights)
    assert [light.free for light in stored.lights] == [light.free for light in wanted.lights]
    np.testing.assert_allclose(stored.grid.wavelengths_nm, wanted.grid.wavelengths_nm, rtol=1e-6)
    for mine, theirs in zip(stored.lights, wanted.lights, strict=True):
        np.testing.assert_allclose(mine.spectrum.values, theirs.spectrum.values, rtol=2e-6, atol=1e-8)
    for stored_row, wanted_row in zip(stored.cells, wanted.cells, strict=True):
        for mine, theirs in zip(stored_row, wanted_row, strict=True):
            assert (mine.mode, mine.others, mine.exact) == (theirs.mode, theirs.others, theirs.exact)
            assert mine.weight == pytest.approx(theirs.weight, rel=1e-6)
            if theirs.target is not None:
                np.testing.assert_allclose(mine.target, theirs.target, atol=1e-6)
            if theirs.box is not None:
                np.testing.assert_allclose(mine.box, theirs.box, atol=1e-6)
    # The lights of the preset smoke must look white and converge slowly: the time budget may end before.
    assert palette.status in (("solved", "still_improving") if preset == "XRAY_SMOKE" else ("solved",))
    assert palette.worst_delta_e < 3
    assert palette.message == ""
    assert all(cell.has_result for _, cell in places(palette))


def test_the_table_shows_the_solution_of_the_library(palette):
    direct = solve_palette(palette_problem(palette))
    np.testing.assert_allclose(actual(palette), direct.actual_linear_rgb, atol=2e-6)
    for (row, column), cell in places(palette):
        assert cell.delta_e == pytest.approx(direct.delta_e_2000[row, column], abs=1e-4)


def test_a_stored_result_shows_the_colors_of_the_table(palette):
    """Colors from the saved spectra alone: light times reflectance, integrated again."""
    for (row, column), cell in places(palette):
        light = spectrum_of(palette.lights[column], "result")
        surface = spectrum_of(palette.materials[row], "result")
        color = linear_rgb_from_xyz(xyz_of(light, surface))
        np.testing.assert_allclose(color, tuple(cell.actual_linear), atol=2e-6)


SETTINGS = {
    "smoothness": 0.9,
    "brightness": 2.0,
    "scale_lights": True,
    "match": "perceptual",
    "rounds": 1,
    "operator": "thesis",
    "robust_weight": 3.0,
    "observers": {"cie_1931_2deg", "cie_1964_10deg"},
    "grid_start": 400.0,
    "grid_stop": 700.0,
    "grid_samples": 41,
    "allow_negative": True,
}


@pytest.mark.parametrize("name", SETTINGS)
def test_every_setting_of_the_design_reaches_the_problem_and_solves(palette, name):
    before = palette_problem(palette)
    setattr(palette, name, SETTINGS[name])
    after = palette_problem(palette)
    fields = {
        "brightness": lambda p: float(xyz_of(p.lights[0].spectrum)[1]),
        "operator": lambda p: p.smoothness_operator,
        "grid_start": lambda p: p.grid.wavelengths_nm[0],
        "grid_stop": lambda p: p.grid.wavelengths_nm[-1],
        "grid_samples": lambda p: p.grid.size,
        "allow_negative": lambda p: p.light_bounds[0] < 0,
        "observers": lambda p: set(p.observers),
    }
    read = fields.get(name, lambda p: getattr(p, name))
    assert read(after) == (pytest.approx(SETTINGS[name]) if isinstance(SETTINGS[name], float) else SETTINGS[name])
    assert read(before) != read(after)
    assert palette.message == ""
    assert not palette.is_stale


@pytest.mark.parametrize("mode", ["FIXED", "FREE", "SAME", "CONSTANT", "BLACK", "IGNORE"])
def test_every_mode_solves_live(palette, mode):
    cell = palette.materials[1].cells[1]
    cell.mode = mode
    assert palette.message == ""
    assert cell.has_result
    if mode == "SAME":
        assert references(palette, cell) == [(0, 1)]
        np.testing.assert_allclose(actual(palette)[1, 1], actual(palette)[0, 1], atol=0.05)
    assert (cell.delta_e >= 0) == (mode not in ("FREE", "IGNORE"))


def test_weight_exact_and_box_reach_the_problem(palette):
    cell = palette.materials[1].cells[1]
    cell.weight, cell.exact = 7.0, True
    assert (palette_problem(palette).cells[1][1].weight, palette_problem(palette).cells[1][1].exact) == (7.0, True)
    cell.weight = 1e12
    assert cell.weight == 1000.0  # the limit of the property, which its tooltip states
    cell.mode, cell.use_box = "FREE", True
    cell.box_low, cell.box_high = (0.1, 0.2, 0.3), (0.5, 0.6, 0.7)
    low, high = palette_problem(palette).cells[1][1].box
    assert np.all(low < high)
    assert np.all(actual(palette)[1, 1] >= low - 1e-5)
    assert np.all(actual(palette)[1, 1] <= high + 1e-5)


def test_a_box_with_swapped_ends_is_reported(palette):
    cell = palette.materials[1].cells[1]
    cell.mode, cell.use_box = "FREE", True
    cell.box_low, cell.box_high = (0.9, 0.9, 0.9), (0.1, 0.1, 0.1)
    assert "swap its ends" in palette.message
    assert palette.is_stale


def test_measured_designed_mixed_and_white_lights(blender, palette):
    light = palette.lights[1]
    light.design = "DESIGNED"
    assert palette_problem(palette).lights[1].free
    light.use_primaries = True
    assert "its list of lamps is empty" in palette.message
    palette.live = False
    blender.ops.spectral.palette_select(column=1)
    for lamp in ("FL2", "HP1", "A", "FL11"):
        blender.ops.spectral.palette_lamp_add(to="PRIMARIES", lamp=lamp)
    palette.live = True  # solves the pending edits
    assert palette.message == ""
    assert sum(lamp.amount for lamp in light.primaries) > 0
    light.use_primaries = False
    light.looks_white = light.keeps_luminance = True
    light.intensity = 1.5
    problem = palette_problem(palette)
    assert problem.lights[1].luminance == pytest.approx(1.5 * palette.brightness)
    designed = xyz_of(spectrum_of(light, "result"))
    np.testing.assert_allclose(designed / designed.sum(), np.array(light.white_xyz) / sum(light.white_xyz), atol=2e-3)
    light.design = "MEASURED"
    blender.ops.spectral.palette_lamp_add(to="VARIANTS", lamp="FL2")
    assert [variant.name for variant in palette_problem(palette).lights[1].variants] == ["FL2"]


def test_a_measured_material_is_unchanged(palette):
    material = palette.materials[1]
    material.design = "MEASURED"
    assert "'Ground' is measured but has no spectrum" in palette.message
    material.spectral.source = "CATALOGUE"
    material.spectral.catalogue_name = "dark skin"
    assert palette.message == ""
    np.testing.assert_allclose(spectrum_of(material, "result").values, spectrum_of(material).values)


def test_apply_is_one_undo_step_and_sets_spectra_and_brightness(blender, palette):
    lamp = blender.data.lights.new("street", "POINT")
    world = blender.data.worlds.new("day")
    paint = blender.data.materials.new("paint")
    for block in (lamp, world, paint):
        block.use_fake_user = True
    palette.lights[1].light, palette.lights[0].world, palette.materials[0].material = lamp, world, paint
    palette.brightness = 2.0
    blender.ops.ed.undo_push(message="before")
    blender.ops.spectral.palette_apply(create=True)
    blender.ops.ed.undo_push(message="after")
    np.testing.assert_array_equal(spectrum_of(paint).values, spectrum_of(palette.materials[0], "result").values)
    assert strength_of(lamp) == pytest.approx(1.0, rel=1e-6)
    exposed = 2.0**blender.context.scene.view_settings.exposure
    assert spectrum_of(world) is not None
    assert palette.materials[1].material.spectral.source == "DESIGNED"
    color = linear_rgb_from_xyz(exposed * strength_of(lamp) * xyz_of(normalized(spectrum_of(lamp)), spectrum_of(paint)))
    wanted = tuple(palette.materials[0].cells[1].actual_linear)
    assert delta_e_2000(lab_from_linear_rgb(color), lab_from_linear_rgb(wanted)) < 1e-3
    blender.ops.ed.undo()
    assert blender.data.materials["paint"].spectral.source == "NONE"
    assert blender.data.lights["street"].spectral.source == "NONE"


def test_apply_refuses_unsolved_and_unphysical_palettes(blender, palette):
    with pytest.raises(RuntimeError, match="no row or column names a material or light"):
        blender.ops.spectral.palette_apply()
    palette.allow_negative = True
    with pytest.raises(RuntimeError, match="unphysical spectra cannot be applied"):
        blender.ops.spectral.palette_apply()
    palette.allow_negative = palette.live = False
    palette.smoothness = 0.5
    with pytest.raises(RuntimeError, match="has changed since it was solved"):
        blender.ops.spectral.palette_apply()
    blender.ops.spectral.palette_clear()
    with pytest.raises(RuntimeError, match="not solved yet"):
        blender.ops.spectral.palette_apply()
    with pytest.raises(RuntimeError, match="the table is empty"):
        blender.ops.spectral.palette_solve()


def test_an_impossible_target_gets_a_status_and_a_remedy(blender, palette):
    palette.materials[0].cells[0].target = (0.0, 0.0, 1.0)  # exact
    palette.materials[1].cells[0].target = (1.0, 0.0, 0.0)
    palette.materials[0].cells[1].target = (0.0, 1.0, 0.0)  # green under sodium
    assert palette.status != "solved"
    assert palette.remedy
    assert palette.materials[0].cells[1].is_missed
    missed = (0, 1)
    blender.ops.spectral.palette_relieve(row=missed[0], column=missed[1])
    assert palette.materials[0].cells[1].mode == "IGNORE"


def test_results_are_saved_with_the_file(blender, palette, tmp_path):
    before, file = actual(palette), str(tmp_path / "palette.blend")
    blender.ops.wm.save_as_mainfile(filepath=file)
    blender.ops.wm.open_mainfile(filepath=file)
    loaded = blender.context.scene.spectral.palette
    np.testing.assert_array_equal(actual(loaded), before)
    assert loaded.status == "solved"
    loaded.smoothness = 0.3  # live editing continues in the loaded file
    assert not loaded.is_stale


def test_settings_of_the_display_do_not_solve(palette):
    palette.live = False
    palette.show_curves = True
    assert not palette.is_stale


def test_swatches_show_actual_colors_and_cannot_be_edited(palette):
    cell = palette.materials[0].cells[1]
    shown = tuple(cell.actual)
    cell.actual = (1.0, 1.0, 1.0)
    assert tuple(cell.actual) == shown
    assert all(0 <= channel <= 1 for channel in shown)


def test_solve_continues_a_solution_that_the_time_interrupted(blender, palette, monkeypatch):
    """The panel says "solve to continue"; Solve had started anew, and ended at the same point."""
    import spectral_core.palette

    starts = []

    def solve(problem, *, warm=None):
        starts.append(warm)
        return solve_palette(problem, warm=warm)

    monkeypatch.setattr(spectral_core.palette, "solve_palette", solve)
    blender.ops.spectral.palette_solve()
    palette.status = "still_improving"
    blender.ops.spectral.palette_solve()
    palette.status, palette.is_stale = "still_improving", True
    blender.ops.spectral.palette_solve()
    assert [start is None for start in starts] == [True, False, True]
    np.testing.assert_allclose(starts[1].actual_linear_rgb, actual(palette), atol=2e-6)

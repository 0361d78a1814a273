# SPDX-License-Identifier: GPL-3.0-or-later
"""Recipes through the panel: a lamp, paints for a palette's material, the user's files, and missing input."""

from __future__ import annotations

import argparse
import json
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("bpy")
pytest.importorskip("colour")

from blender_addon.editing.recipe import give
from blender_addon.translate.spectra.stored import spectrum_of
from spectral_core.cli.recipe import add_arguments
from spectral_core.errors import InvalidInputError
from spectral_core.palette.recipe.lamp import LampQuality
from spectral_core.palette.recipe.white import LAMP_GRID, cct_and_duv, color_rendering_index, xyz_from_spd
from spectral_core.palette.texture.lights import led
from spectral_core.spectra.catalogue import reflectance
from spectral_core.spectra.files import write_spectra
from spectral_core.spectra.spectrum import Reflectance, SpectralGrid


@pytest.fixture
def recipe(blender):
    return blender.context.scene.spectral.recipe


def test_panel_and_command_request_what_the_library_does(recipe) -> None:
    quality, parser = LampQuality(), argparse.ArgumentParser()
    add_arguments(parser)
    assert recipe.cri == quality.rendering_index == parser.parse_args(["lamp", "channels.csv"]).cri
    assert recipe.use_cri
    assert (recipe.use_fidelity, recipe.use_gamut) == (quality.fidelity is not None, quality.gamut is not None)


def test_a_lamp_has_the_requested_white_and_is_assigned_to_the_selected_light(blender, recipe) -> None:
    recipe.kind, recipe.cct, recipe.duv, recipe.cri, recipe.most = "LAMP", 3500, 0.001, 85, 4
    recipe.use_fidelity, recipe.fidelity = True, 80
    recipe.use_gamut, recipe.gamut_low, recipe.gamut_high = True, 90, 112
    blender.ops.spectral.recipe_find()
    assert recipe.met
    assert "K, Duv +0.001" in recipe.text
    lamp = blender.data.objects.new("lamp", blender.data.lights.new("lamp", "POINT"))
    blender.context.scene.collection.objects.link(lamp)
    blender.context.view_layer.objects.active = lamp
    blender.ops.spectral.recipe_give()
    spd = spectrum_of(lamp.data).at(LAMP_GRID.wavelengths_nm)
    kelvin, duv = cct_and_duv(xyz_from_spd() @ spd)
    assert kelvin == pytest.approx(3500, rel=0.003)
    assert duv == pytest.approx(0.001, abs=3e-4)
    assert color_rendering_index(spd) > 84.5


def test_paints_for_a_named_surface_and_for_a_material_of_the_palette(blender, recipe) -> None:
    recipe.kind, recipe.wanted, recipe.surface, recipe.grams, recipe.most = "PAINTS", "NAMED", "foliage", 50, 2
    blender.ops.spectral.recipe_find()
    grams = [float(line.split()[-2]) for line in recipe.text.splitlines() if line.endswith(" g")]
    assert sum(grams) == pytest.approx(50, abs=0.1)
    assert "under D65: ΔE2000" in recipe.text
    assert "metamerism index" in recipe.text
    assert json.loads(recipe.spectrum)["nm"] == reflectance("foliage").grid.wavelengths_nm.tolist()  # not 400 to 700
    recipe.wanted = "PALETTE"
    blender.ops.spectral.palette_preset(preset="HIDDEN_MARK")
    blender.ops.spectral.recipe_find()
    assert "Sodium" in recipe.text or "under HP1" in recipe.text
    with pytest.raises(RuntimeError, match="select an object with a material"):
        blender.context.view_layer.objects.active = None
        blender.ops.spectral.recipe_give()


def test_what_is_wanted_is_the_named_surface_or_the_selected_material(blender, recipe, monkeypatch) -> None:
    from blender_addon.editing import recipe as editing
    from blender_addon.translate.spectra.stored import store_spectrum
    from spectral_core.spectra.catalogue import reflectance

    asked = []
    found = SimpleNamespace(text=lambda *_: "", reflectance=None, met=True)
    monkeypatch.setattr(editing, "material_recipe", lambda _, wanted, *__, **___: asked.append(wanted) or found)
    recipe.kind, recipe.wanted, recipe.surface = "PAINTS", "NAMED", "orange"
    editing.search(blender.context.scene)()
    assert asked[-1].name == "orange"
    palette = blender.context.scene.spectral.palette
    palette.live = False
    for _ in range(3):
        blender.ops.spectral.palette_add(side="MATERIAL")
    for row, name in zip(palette.materials, ("red", "foliage", "blue"), strict=True):
        store_spectrum(row.result, reflectance(name))
    recipe.wanted = "PALETTE"
    for row, name in ((2, "blue"), (1, "foliage")):
        palette.active_row = row
        editing.search(blender.context.scene)()
        values, grid = asked[-1].values, asked[-1].grid
        np.testing.assert_allclose(values, reflectance(name).at(grid.wavelengths_nm), atol=1e-5)
    recipe.library, recipe.filepath = "FILE", "/nowhere.csv"
    with pytest.raises(InvalidInputError, match=r"^there is no file /nowhere\.csv; choose one"):
        editing.search(blender.context.scene)()
    recipe.kind, recipe.library = "FILTERS", "BUILTIN"
    with pytest.raises(InvalidInputError, match="^filters differ from maker to maker"):
        editing.search(blender.context.scene)()


def test_channels_from_a_file_and_missing_inks(blender, recipe, tmp_path) -> None:
    write_spectra(tmp_path / "mine.csv", [led(450, 20), led(530, 30), led(620, 20)])
    recipe.kind, recipe.library, recipe.filepath = "LAMP", "FILE", str(tmp_path / "mine.csv")
    recipe.use_cri = recipe.use_fidelity = recipe.use_gamut = False
    blender.ops.spectral.recipe_find()
    assert len([line for line in recipe.text.splitlines() if line.endswith("%")]) == 3
    recipe.filepath = "/nowhere.csv"
    with pytest.raises(RuntimeError, match=r"there is no file /nowhere\.csv; choose one"):
        blender.ops.spectral.recipe_find()
    recipe.kind, recipe.library, recipe.dot_gain = "INKS", "BUILTIN", 1.8
    with pytest.raises(RuntimeError, match="differ from maker to maker"):
        blender.ops.spectral.recipe_find()
    assert np.isfinite(recipe.dot_gain)


def test_inks_of_different_ranges_are_mixed_over_the_range_that_all_have(blender, recipe, tmp_path) -> None:
    narrow = SpectralGrid.uniform(430, 660, 10)
    cut = Reflectance("cyan", narrow, reflectance("cyan").at(narrow.wavelengths_nm))
    write_spectra(tmp_path / "inks.csv", [reflectance("magenta"), cut])
    recipe.kind, recipe.filepath, recipe.wanted, recipe.surface = "INKS", str(tmp_path / "inks.csv"), "NAMED", "purple"
    blender.ops.spectral.recipe_find()
    assert recipe.text.splitlines()[-1].startswith("The recipe has 430 to 660 nm, the range that all spectra have")


def test_a_recipe_without_anything_to_copy_is_reported(blender, recipe) -> None:
    with pytest.raises(RuntimeError, match="there is no recipe yet"):
        blender.ops.spectral.recipe_copy()


def test_a_chip_is_no_recipe_of_itself_and_an_old_recipe_is_removed(blender, recipe) -> None:
    recipe.kind, recipe.wanted, recipe.surface, recipe.most = "PAINTS", "NAMED", "foliage", 3
    blender.ops.spectral.recipe_find()
    assert "foliage" not in recipe.text
    assert recipe.found_kind == "PAINTS"
    recipe.kind = "INKS"
    with pytest.raises(InvalidInputError, match="there is no recipe yet"):
        give(blender.context.scene, blender.data.materials.new("paper"))
    with pytest.raises(RuntimeError, match="differ from maker to maker"):
        blender.ops.spectral.recipe_find()
    assert not recipe.text


def test_an_error_of_the_core_is_reported_and_changes_nothing(blender, recipe, tmp_path) -> None:
    recipe.kind, recipe.most = "LAMP", 2
    with pytest.raises(RuntimeError, match="a white takes three channels or more; Most Channels is 2"):
        blender.ops.spectral.recipe_find()
    recipe.kind, recipe.wanted, recipe.surface, recipe.most = "PAINTS", "NAMED", "foliage", 12
    with pytest.raises(RuntimeError, match="Most Parts is 12; a recipe has 1 to 8, lower it"):
        blender.ops.spectral.recipe_find()
    percent = [Reflectance(name, LAMP_GRID, np.full(LAMP_GRID.size, value)) for name, value in (("a", 0.2), ("b", 0.9))]
    write_spectra(tmp_path / "percent.csv", percent)
    words = (tmp_path / "percent.csv").read_text("utf-8").replace("0.2", "20").replace("0.9", "90")
    (tmp_path / "percent.csv").write_text(words, "utf-8")
    recipe.kind, recipe.library, recipe.filepath = "PAINTS", "FILE", str(tmp_path / "percent.csv")
    recipe.wanted, recipe.surface, recipe.most = "NAMED", "foliage", 4
    with pytest.raises(RuntimeError, match="expected 0 to 1"):
        blender.ops.spectral.recipe_find()

# SPDX-License-Identifier: GPL-3.0-or-later
"""Files through Blender's operators: palettes, spectra of every format, swatches, and spectra read from files."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("bpy")

from blender_addon.translate.palette import table
from blender_addon.translate.palette.problem import palette_problem
from blender_addon.translate.palette.table import places
from blender_addon.translate.spectra.stored import spectrum_of
from spectral_core.palette.files import read_swatches
from spectral_core.spectra.catalogue import illuminant, reflectance
from spectral_core.spectra.color import display_rgb_from_linear
from spectral_core.spectra.files import read_spectra, write_spectra


@pytest.fixture
def palette(blender):
    """Split light, solved."""
    blender.ops.spectral.palette_preset(preset="SPLIT_LIGHT")
    return blender.context.scene.spectral.palette


@pytest.mark.parametrize("ending", ["toml", "json"])
def test_a_palette_is_exported_and_imported(blender, palette, tmp_path, ending):
    file = str(tmp_path / f"split.{ending}")
    before = palette_problem(palette)
    blender.ops.spectral.palette_export(filepath=file)
    blender.ops.spectral.palette_clear()
    blender.ops.spectral.palette_import(filepath=file)
    after = palette_problem(palette)
    assert [light.name for light in after.lights] == [light.name for light in before.lights]
    for mine, theirs in zip(after.lights, before.lights, strict=True):
        np.testing.assert_allclose(mine.spectrum.values, theirs.spectrum.values, rtol=1e-5, atol=1e-7)
    for mine, theirs in zip(sum(after.cells, ()), sum(before.cells, ()), strict=True):
        assert (mine.mode, mine.exact, mine.others) == (theirs.mode, theirs.exact, theirs.others)
        np.testing.assert_allclose(mine.target, theirs.target, atol=1e-6)
    assert palette.status == "solved"


def test_what_a_file_cannot_hold_is_named(blender, palette, tmp_path, capfd):
    """Dyes and tints were lost in the file without a word."""
    files = {"palette_export": str(tmp_path / "dyed.toml"), "spectra_export": str(tmp_path / "dyed")}
    for name, path in files.items():
        getattr(blender.ops.spectral, name)(filepath=path)
    assert "cannot hold" not in capfd.readouterr().out
    palette.live = False
    palette.grid_start = 380.0
    palette.use_tints = True
    blender.ops.spectral.palette_export(filepath=files["palette_export"])
    assert "palette files cannot hold Match as Tints;" in capfd.readouterr().out
    palette.use_tints = False
    palette.materials[2].dyes.add()
    for name, path in files.items():
        getattr(blender.ops.spectral, name)(filepath=path)
        assert "cannot hold the fluorescent dyes of Paint 3;" in capfd.readouterr().out


def test_a_file_that_is_no_palette_leaves_the_table_unchanged(blender, palette, tmp_path):
    file = tmp_path / "wrong.toml"
    file.write_text("lights = 3\n")
    with pytest.raises(RuntimeError, match=r"wrong\.toml"):
        blender.ops.spectral.palette_import(filepath=str(file))
    assert len(palette.lights) == 3
    with pytest.raises(RuntimeError, match="nowhere"):
        blender.ops.spectral.palette_import(filepath=str(tmp_path / "nowhere.toml"))


@pytest.mark.parametrize("file_format", ["csv", "spdx", "spd"])
def test_spectra_are_written(blender, palette, tmp_path, file_format):
    blender.ops.spectral.spectra_export(filepath=str(tmp_path / "split"), file_format=file_format)
    files = sorted(tmp_path.glob(f"*.{file_format}"))
    count = len(palette.lights) + len(palette.materials)
    assert len(files) == (1 if file_format == "csv" else count)
    spectra = [spectrum for file in files for spectrum in read_spectra(file)]
    found = {spectrum.name: spectrum for spectrum in spectra}
    assert len(found) == count
    for entry in (*palette.lights, *palette.materials):
        np.testing.assert_allclose(found[entry.name].values, spectrum_of(entry, "result").values, rtol=1e-9)


def test_spectra_have_the_new_name_of_a_light_or_material(blender, palette, tmp_path):
    """A rename needs no new solve; the files and the spectra in them had the names of the last one."""
    palette.lights[1].name, palette.materials[2].name = "Straßenlampe", "Loden 漢"
    blender.ops.spectral.spectra_export(filepath=str(tmp_path / "set"), file_format="spd")
    spectra = [spectrum for file in tmp_path.iterdir() for spectrum in read_spectra(file)]
    assert {each.name for each in spectra} == {each.name for each in (*palette.lights, *palette.materials)}
    assert "Straßenlampe" in {each.name for each in spectra}
    palette.materials[2].material = blender.data.materials.new("cloth")
    blender.ops.spectral.palette_apply()
    assert spectrum_of(palette.materials[2].material).name == "Loden 漢"


def test_names_that_are_equal_as_file_names_get_a_file_each(blender, palette, tmp_path):
    for entry, name in zip(palette.materials, ("a/b", "a b", "A_b", "", "Lamp"), strict=True):
        entry.name = name
    palette.lights[0].name = "lamp"
    blender.ops.spectral.spectra_export(filepath=str(tmp_path / "set.v2"), file_format="spd")
    files = sorted(tmp_path.iterdir())
    assert len({file.name.casefold() for file in files}) == len(palette.lights) + len(palette.materials)
    assert all(file.name.startswith("set.v2_") for file in files)
    blender.ops.spectral.spectra_export(filepath=str(tmp_path / "all.csv"), file_format="csv")
    assert (tmp_path / "all.csv").exists()


def test_an_edit_that_waits_for_its_solve_is_solved_before_a_file_is_written(blender, palette, tmp_path):
    before = np.array(palette.materials[0].cells[1].actual_linear)
    with table.paused():
        palette.materials[0].cells[1].target = (0.2, 0.5, 0.9)
        palette.is_stale = True
    file = tmp_path / "now.ase"
    blender.ops.spectral.swatches_export(filepath=str(file))
    assert not palette.is_stale
    assert np.abs(np.array(palette.materials[0].cells[1].actual_linear) - before).max() > 0.05


@pytest.mark.parametrize("ending", ["ase", "gpl"])
def test_swatches_are_the_actual_colors(blender, palette, tmp_path, ending):
    file = tmp_path / f"split.{ending}"
    blender.ops.spectral.swatches_export(filepath=str(file))
    swatches = read_swatches(file)
    shown = [(palette.materials[row].name, cell) for (row, _), cell in places(palette)]
    assert len(swatches) == len(shown) == 15
    for swatch in swatches:
        match = [cell for material, cell in shown if material in swatch.name]
        written = display_rgb_from_linear(swatch.linear_rgb)
        assert min(np.abs(written - np.array(cell.actual)).max() for cell in match) < 1 / 255


def test_nothing_is_written_before_the_first_solve(blender, tmp_path):
    for operator in (blender.ops.spectral.spectra_export, blender.ops.spectral.swatches_export):
        with pytest.raises(RuntimeError, match="not solved yet"):
            operator(filepath=str(tmp_path / "nothing.ase"))
    with pytest.raises(RuntimeError, match="the table is empty"):
        blender.ops.spectral.palette_export(filepath=str(tmp_path / "nothing.toml"))
    assert not list(tmp_path.iterdir())


def test_a_light_from_a_file_with_several(blender, tmp_path):
    file = tmp_path / "lamps.csv"
    write_spectra(file, [illuminant("A"), illuminant("HP1")])
    light = blender.data.lights.new("key", "POINT")
    light.spectral.source = "FILE"
    assert "no file is chosen" in light.spectral.message
    light.spectral.filepath = str(file)
    assert "holds 2 spectra; choose one: A, HP1" in light.spectral.message
    light.spectral.file_entry = "HP1"
    np.testing.assert_allclose(spectrum_of(light).values, illuminant("HP1").values, rtol=1e-6)
    file.unlink()
    blender.ops.object.light_add(type="POINT")
    blender.context.object.data = light
    with pytest.raises(RuntimeError, match="there is no file"):
        blender.ops.spectral.spectrum_reload(carrier="LIGHT")
    np.testing.assert_allclose(spectrum_of(light).values, illuminant("HP1").values, rtol=1e-6)  # the values are kept


@pytest.mark.parametrize("ending", ["spd", "spdx", "csv"])
def test_a_material_from_a_file_of_one(blender, tmp_path, ending):
    file = tmp_path / f"skin.{ending}"
    write_spectra(file, [reflectance("light skin")])
    material = blender.data.materials.new("skin")
    material.spectral.source = "FILE"
    material.spectral.filepath = str(file)
    assert material.spectral.message == ""
    np.testing.assert_allclose(spectrum_of(material).values, reflectance("light skin").values, rtol=1e-6)


def test_a_designed_spectrum_is_taken_from_the_palette(blender, palette):
    blender.ops.mesh.primitive_cube_add()
    material = blender.data.materials.new("wall")
    blender.context.object.data.materials.append(material)
    with pytest.raises(RuntimeError, match="the palette has no reflectance named 'nobody'; it has: Paint 1"):
        blender.ops.spectral.spectrum_from_palette(carrier="MATERIAL", entry="nobody")
    blender.ops.spectral.spectrum_from_palette(carrier="MATERIAL", entry="Paint 2")
    wanted = spectrum_of(palette.materials[1], "result")
    np.testing.assert_array_equal(spectrum_of(material).values, wanted.values)
    with pytest.raises(RuntimeError, match="there is no active light"):
        blender.ops.spectral.spectrum_from_palette(carrier="LIGHT", entry="D65")


def test_worlds_and_nodes_take_designed_spectra_too(blender, palette):
    scene = blender.context.scene
    scene.world = blender.data.worlds.new("sky")
    blender.ops.spectral.spectrum_from_palette(carrier="WORLD", entry="Light 2")
    np.testing.assert_array_equal(spectrum_of(scene.world).values, spectrum_of(palette.lights[1], "result").values)
    blender.ops.mesh.primitive_cube_add()
    material = blender.data.materials.new("wall")
    blender.context.object.data.materials.append(material)
    node = material.node_tree.nodes["Principled BSDF"]
    material.node_tree.nodes.active = node
    blender.ops.spectral.spectrum_from_palette(carrier="NODE", entry="Paint 3")
    np.testing.assert_array_equal(spectrum_of(node).values, spectrum_of(palette.materials[2], "result").values)
    assert spectrum_of(material) is None

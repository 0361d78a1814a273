# SPDX-License-Identifier: GPL-3.0-or-later
"""Volumes in Blender: import, transfer functions on the data-block, translation, sequences, refusals."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from spectral_core.volume.documents.transfer_file import read_transfer  # noqa: E402

EXAMPLES = Path(__file__).parents[2] / "examples" / "transfer"


@pytest.fixture(autouse=True)
def _openvdb():
    from spectral_core.volume.files.formats.openvdb_format import find_openvdb

    if find_openvdb() is None:
        pytest.skip("no OpenVDB module here")


def imported(path, **options):
    assert bpy.ops.spectral.volume_import(filepath=str(path), **options) == {"FINISHED"}
    return bpy.context.object


def translated():
    from blender_addon.translate.scene import translate_scene

    return translate_scene(bpy.context.evaluated_depsgraph_get())


def test_an_imported_file_is_a_volume_object_with_the_same_voxels(blender, ramp, tmp_path):
    path, values = ramp
    thing = imported(path, size=0.0)
    data = thing.data
    assert thing.type == "VOLUME"
    assert data.filepath.startswith("//volumes/ramp_")
    assert data.grids.load()
    assert list(data.grids.keys()) == ["density"]
    assert list(data["spectral_range"]) == [-100.0, 300.0]
    assert "6 × 5 × 4 voxels of int16, -100 to 300" in data.spectral.facts
    volume = translated().volumes[0]
    assert volume.data.dtype == np.int16
    assert np.array_equal(volume.data, values)
    assert np.array_equal(volume.world_from_index, [[1, 0, 0, 7], [0, 1, 0, 0], [0, 0, 2, -3], [0, 0, 0, 1]])
    assert (volume.rule, volume.quality) == ("auto", 50.0)


def test_size_and_position_follow_the_cursor(blender, ramp):
    from spectral_core.volume.field import ScalarVolume

    blender.context.scene.cursor.location = (1, 2, 3)
    thing = imported(ramp[0], size=2.0)
    volume = translated().volumes[0]
    corners = ScalarVolume("v", volume.data, volume.world_from_index).corners_world
    assert corners.mean(axis=0) == pytest.approx([1, 2, 3], abs=1e-5)
    assert np.ptp(corners, axis=0).max() == pytest.approx(2.0, rel=1e-6)
    # Blender's box of the grid begins at the same point, half a voxel before the first center, and ends at a whole leaf
    thing.data.grids.load()
    blender.context.view_layer.update()
    lowest = np.array(thing.matrix_world) @ [*thing.bound_box[0], 1.0]
    assert lowest[:3] == pytest.approx(corners.min(axis=0), abs=1e-5)


@pytest.mark.parametrize("name", ["wide", "narrow", "opaque", "xray", "edges"])
def test_the_renderer_gets_the_presets_of_the_core(blender, ramp, name):
    from spectral_core.volume.field import ScalarVolume
    from spectral_core.volume.presets import preset

    imported(ramp[0], size=3.0, preset="wide")
    assert bpy.ops.spectral.transfer_preset(preset=name) == {"FINISHED"}
    volume = translated().volumes[0]
    expected = preset(name, ScalarVolume("v", volume.data, volume.world_from_index))
    assert volume.transfer.names == expected.names
    for got, made in zip(volume.transfer.materials, expected.materials, strict=True):
        places = np.linspace(-150, 350, 501)
        for curve in ("extinction", "emission"):
            at = [
                np.interp(places, m.values, getattr(m, curve)) if getattr(m, curve) is not None else 0 * places
                for m in (got, made)
            ]
            # Blender stores 32-bit floats, and curve points to 1e-6 of the range
            assert np.abs(at[0] - at[1]).max() < 2e-3 * max(at[1].max(), 1e-9)
        assert got.color == pytest.approx(made.color, abs=1e-6)
        assert got.lit == made.lit
        if made.gradient_values is not None:
            assert got.gradient_values == pytest.approx(made.gradient_values, rel=1e-5)
            assert got.gradient_weights == pytest.approx(made.gradient_weights, abs=1e-6)


@pytest.mark.parametrize("example", sorted(EXAMPLES.glob("*.toml")), ids=lambda path: path.stem)
def test_transfer_files_are_imported_and_exported(blender, ramp, tmp_path, example):
    imported(ramp[0])
    assert bpy.ops.spectral.transfer_import(filepath=str(example)) == {"FINISHED"}
    assert bpy.ops.spectral.transfer_export(filepath=str(tmp_path / "out.toml")) == {"FINISHED"}
    given, back = read_transfer(example), read_transfer(tmp_path / "out.toml")
    assert back.transfer.names == given.transfer.names
    if given.values == "fraction":
        for old, new in zip(given.transfer.materials, back.transfer.materials, strict=True):
            assert new.values == pytest.approx(old.values, abs=1e-5)
            assert new.extinction == pytest.approx(old.extinction, rel=1e-5, abs=1e-7)
            assert (new.emission is None) == (old.emission is None)
            assert new.emission is None or new.emission == pytest.approx(old.emission, rel=1e-5)
    if given.transfer.wavelengths_nm is not None:
        wavelengths = given.transfer.wavelengths_nm
        for old, new in zip(given.transfer.materials, back.transfer.materials, strict=True):
            assert np.interp(wavelengths, back.transfer.wavelengths_nm, new.color) == pytest.approx(old.color, abs=1e-5)


def test_all_settings_are_saved_and_loaded(blender, ramp, tmp_path):
    data = imported(ramp[0], preset="edges").data
    data.spectral.rule, data.spectral.quality_db = "thesis", 42.0
    before = translated().volumes[0]
    bpy.ops.wm.save_mainfile()
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "scene.blend"))
    after = translated().volumes[0]
    assert (after.rule, after.quality) == ("thesis", 42.0)
    assert np.array_equal(after.data, before.data)
    for old, new in zip(before.transfer.materials, after.transfer.materials, strict=True):
        assert np.array_equal(old.values, new.values)
        assert np.array_equal(old.extinction, new.extinction)
        assert np.array_equal(old.gradient_values, new.gradient_values)


def test_jumps_and_round_curves(blender, ramp):
    from blender_addon.translate.volume_looks import curves as stored
    from blender_addon.translate.volume_looks import transfer as volume_transfer

    data = imported(ramp[0]).data
    stored.clear(data)
    entry = stored.add_material(data, "step")
    stored.set_curve(data, entry, "density", [0.0, 0.5, 0.5, 1.0], [0.0, 0.0, 1.0, 1.0])
    entry.density = 2.0
    material = volume_transfer.stated_transfer(data).transfer.materials[0]
    assert material.values == pytest.approx([0, 0.5, 0.5, 1], abs=1e-6)
    assert material.values[1] == material.values[2]
    assert material.extinction.tolist() == [0, 0, 2, 2]
    # emission has other knots: both curves get the union of the knots, and keep the jump
    stored.set_curve(data, entry, "emission", [0.0, 0.25, 1.0], [1.0, 0.0, 0.0])
    entry.emission = 0.5
    both = volume_transfer.stated_transfer(data).transfer.materials[0]
    assert both.values == pytest.approx([0, 0.25, 0.5, 0.5, 1], abs=1e-6)
    assert both.extinction.tolist() == [0, 0, 0, 2, 2]
    assert both.emission == pytest.approx([0.5, 0, 0, 0, 0])
    # rounded curves are sampled finely
    for point in stored.curve_node(data, entry, "density").mapping.curves[0].points:
        point.handle_type = "AUTO"
    assert len(volume_transfer.stated_transfer(data).transfer.materials[0].values) > 100


def test_one_spectrum_makes_the_whole_function_spectral(blender, ramp):
    from spectral_core.spectra import catalogue
    from spectral_core.volume.mitsuba_integrator.illumination import display_matrix

    data = imported(ramp[0], preset="wide").data
    spectral = data.spectral.materials[1].spectral
    spectral.source = "CATALOGUE"
    spectral.catalogue_name = "orange"
    transfer = translated().volumes[0].transfer
    grid = transfer.wavelengths_nm
    assert transfer.colors.shape == (3, len(grid))
    assert transfer.colors[1] == pytest.approx(catalogue.reflectance("orange").at(grid), abs=1e-6)
    # the others are the smoothest reflectances of their colors
    assert display_matrix(transfer)[0] == pytest.approx(np.array(data.spectral.materials[0].color), abs=1e-3)


def test_swatches_follow_the_lights_of_the_scene(blender, ramp):
    from blender_addon.panels.volume import scene_light, swatch_of

    entry = imported(ramp[0]).data.spectral.materials[0]
    entry.color = (0.5, 0.5, 0.5)
    gray = swatch_of(entry, scene_light(bpy.context.scene))
    assert np.ptp(gray) < 2e-3
    lamp = bpy.data.lights.new("Lamp", "POINT")
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("Lamp", lamp))
    lamp.spectral.source = "CATALOGUE"
    lamp.spectral.catalogue_name = "HP1"
    orange = swatch_of(entry, scene_light(bpy.context.scene))
    assert orange[0] > orange[1] + 0.2 > orange[2] + 0.4
    entry.lit = False
    assert swatch_of(entry, scene_light(bpy.context.scene)) == pytest.approx(gray, abs=1e-3)


def test_materials_are_added_and_removed(blender, ramp):
    data = imported(ramp[0], preset="narrow").data
    data.spectral.enabled = False
    assert bpy.ops.spectral.volume_material_add() == {"FINISHED"}
    assert data.spectral.enabled
    assert bpy.ops.spectral.volume_material_add() == {"FINISHED"}
    assert bpy.ops.spectral.volume_material_add() == {"FINISHED"}
    for selected, then in ((4, 3), (0, 0)):
        data.spectral.active = selected
        if selected:  # the selected one is removed, and the one before it is selected
            assert bpy.ops.spectral.volume_material_remove() == {"FINISHED"}
        assert data.spectral.active == then
    assert [m.name for m in data.spectral.materials] == ["outer", "inner", "Material", "Material.001"]
    data.spectral.active = 0
    assert bpy.ops.spectral.volume_material_remove() == {"FINISHED"}
    assert [m.name for m in data.spectral.materials] == ["inner", "Material", "Material.001"]
    assert len(data.spectral.curves.nodes) == 3
    assert bpy.ops.spectral.volume_curve_add(which="gradient") == {"FINISHED"}
    assert len(data.spectral.curves.nodes) == 4
    for _ in range(3):
        bpy.ops.spectral.volume_material_remove()
    with pytest.raises(RuntimeError, match="the volume has no material; add one first"):
        bpy.ops.spectral.volume_material_remove()
    scene = translated()
    assert scene.volumes == ()
    assert any("has no material" in note.message for note in scene.notes)


def test_a_sequence_shows_the_file_of_each_frame(blender, tmp_path):
    for number in (10, 11, 13):
        np.save(tmp_path / f"flow_{number}.npy", np.full((3, 3, 3), number, np.float32) + np.arange(3))
    data = imported(tmp_path / "flow_11.npy", sequence=True, size=0.0).data
    assert (data.is_sequence, data.frame_duration) == (True, 3)
    assert list(data["spectral_range"]) == [10.0, 15.0]
    seen = []
    for frame in (1, 2, 3):
        bpy.context.scene.frame_set(frame)
        seen.append(float(translated().volumes[0].data.min()))
    assert seen == [10.0, 11.0, 13.0]


def test_a_volume_shows_the_chosen_grid_of_its_file(blender, ramp, tmp_path):
    from spectral_core.volume.files.formats.openvdb_format import find_openvdb

    openvdb, data = find_openvdb(), imported(ramp[0]).data
    path = bpy.path.abspath(data.filepath)
    first = openvdb.read(path, data.spectral.grid)
    second = openvdb.FloatGrid(0.0)
    second.copyFromArray(np.full((6, 5, 4), 7.0, np.float32))
    second.name, second.transform = "temperature", first.transform
    openvdb.write(str(tmp_path / "two.vdb"), grids=[first, second])
    before = translated().volumes[0].data
    data.filepath = str(tmp_path / "two.vdb")
    assert np.array_equal(translated().volumes[0].data, before)
    data.spectral.grid = "temperature"
    data.update_tag()
    assert (translated().volumes[0].data == 7.0).all()


def test_a_volume_without_a_transfer_function_is_rendered_by_its_material(blender, ramp):
    made = imported(ramp[0])
    made.data.spectral.enabled = False
    scene = translated()
    assert scene.volumes == () and not scene.notes
    box = next(item for item in scene.instances if item.shown_as == made.name)
    medium = next(item.medium for item in scene.materials if item.name == box.materials[0])
    assert medium.grid.scattering is medium.grid.absorption and medium.grid.scattering.max() == 1


def test_a_missing_file_is_reported(blender, ramp, tmp_path):
    data = imported(ramp[0]).data
    Path(bpy.path.abspath(data.filepath)).unlink()
    scene = translated()
    assert scene.volumes == ()
    assert any("cannot be opened" in note.message for note in scene.notes)


@pytest.mark.parametrize(
    ("content", "options", "message"),
    [
        (b"NRRD0004\ntype: uint8\n", {}, "lacks dimension"),
        (b"nonsense", {}, "does not begin as one does"),
        (b"12345678", {"raw": True, "raw_shape": (2, 2, 2), "raw_type": "uint16"}, "has 8 bytes"),
        (b"12345678", {"raw": True, "raw_shape": (2, 2, 2), "sequence": True}, "is no frame of a sequence"),
    ],
)
def test_refused_files_leave_no_data_behind(blender, tmp_path, content, options, message):
    (tmp_path / "odd.nrrd").write_bytes(content)
    with pytest.raises(RuntimeError, match=message):
        bpy.ops.spectral.volume_import(filepath=str(tmp_path / "odd.nrrd"), **options)
    assert len(bpy.data.volumes) == 0
    assert len(bpy.data.node_groups) == 0


def test_raw_numbers_are_imported_in_the_stated_layout(blender, tmp_path):
    values = np.arange(24, dtype=">u2").reshape(2, 3, 4)
    (tmp_path / "a.raw").write_bytes(b"head" + values.tobytes(order="F"))
    options = {"raw": True, "raw_shape": (2, 3, 4), "raw_type": "uint16", "raw_big_endian": True, "raw_offset": 4}
    imported(tmp_path / "a.raw", **options)
    assert np.array_equal(translated().volumes[0].data, values)


def test_the_same_name_from_another_folder_is_another_file(blender, tmp_path):
    for folder, value in (("a", 1.0), ("b", 2.0)):
        (tmp_path / folder).mkdir()
        np.save(tmp_path / folder / "v.npy", np.full((2, 2, 2), value))
        imported(tmp_path / folder / "v.npy")
    assert sorted(float(volume.data.max()) for volume in translated().volumes) == [1.0, 2.0]

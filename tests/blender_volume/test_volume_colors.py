# SPDX-License-Identifier: GPL-3.0-or-later
"""Volumes in Blender: colors from the palette, types of lighting, edges."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from spectral_core.scene import Rays  # noqa: E402
from tests.blender_volume.test_volume_objects import _openvdb, imported, translated  # noqa: E402, F401


def test_the_palette_colors_a_volume(blender, ramp):
    data = imported(ramp[0], preset="wide").data
    bpy.ops.spectral.palette_preset(preset="HIDDEN_MARK")
    name = bpy.context.scene.spectral.palette.materials[0].name
    assert bpy.ops.spectral.volume_color_from_palette(entry=name) == {"FINISHED"}
    assert data.spectral.materials[0].spectral.source == "DESIGNED"
    assert translated().volumes[0].transfer.wavelengths_nm is not None
    with pytest.raises(RuntimeError, match="the palette has no material named 'nothing'"):
        bpy.ops.spectral.volume_color_from_palette(entry="nothing")


def test_lighting_and_edges_reach_the_renderer(blender, ramp):
    """The type of lighting, and a material that shows edges only."""
    imported(ramp[0], size=3.0, preset="wide")
    settings = blender.context.object.data.spectral
    entry = settings.materials[0]
    entry.use_gradient, entry.gradient = True, 0.25
    for lighting in ("even", "scene", "shadows"):
        settings.lighting = lighting
        volume = translated().volumes[0]
        assert volume.lighting == lighting
        assert volume.transfer.materials[0].gradient_values.max() > 0


def test_a_volume_follows_the_visibility_of_its_object(blender, ramp):
    thing = imported(ramp[0], preset="wide")
    thing.data.spectral.lighting = "shadows"
    assert translated().volumes[0].hidden_from == Rays.NONE
    thing.visible_camera = thing.visible_shadow = False
    scene = translated()
    assert scene.volumes[0].hidden_from == Rays.CAMERA | Rays.SHADOW
    assert not [note for note in scene.notes if note.subject == thing.name and "hidden" in note.message]
    thing.visible_glossy = False
    assert translated().volumes[0].hidden_from == Rays.CAMERA | Rays.SHADOW | Rays.GLOSSY


@pytest.mark.parametrize("collection", ["receiver_collection", "blocker_collection"])
def test_linking_that_a_volume_does_not_follow_is_named(blender, ramp, collection):
    thing = imported(ramp[0], preset="wide")
    lamp = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "POINT"))
    bpy.context.collection.objects.link(lamp)
    chosen = bpy.data.collections.new("Linked")
    chosen.objects.link(thing)
    setattr(lamp.light_linking, collection, chosen)
    assert not any("Linking" in note.message for note in translated().notes)
    chosen.collection_objects[0].light_linking.link_state = "EXCLUDE"
    assert [note.subject for note in translated().notes if "Light Linking" in note.message] == [thing.name]


def test_weights_at_one_slope_are_stored(blender, ramp):
    from blender_addon.translate.volume_looks import transfer as looks
    from spectral_core.volume.documents.transfer_document import TransferDocument
    from spectral_core.volume.transfer import Material, TransferFunction

    assert bpy.ops.spectral.volume_import(filepath=str(ramp[0])) == {"FINISHED"}
    data = bpy.context.object.data
    for slopes, weights in (([0.0], [1.0]), ([0.0, 0.0], [0.0, 1.0]), ([0.0, 1e-8], [0.0, 1.0])):
        steep = {"gradient_values": slopes, "gradient_weights": weights}
        stated = TransferFunction((Material("m", [0, 1], [0, 1], [1, 1, 1], **steep),))
        looks.store_transfer(data, TransferDocument(stated, "fraction", "voxel"))
        again = looks.stated_transfer(data).transfer.materials[0]
        assert np.allclose(again.weight(np.array([0.5, 1.0])), 1.0)
        assert data.spectral.materials[0].gradient > 0


@pytest.mark.parametrize("mark", [1e20, -9999.0])
def test_fill_values_leave_a_transfer_function_its_shape(blender, tmp_path, mark):
    """The curve of the range to 1e20 had all its points at 0: the peak was lost, and the volume empty."""
    from blender_addon.translate.volume_looks.transfer import stated_transfer

    data = np.linspace(0.0, 4.0, 600, dtype=np.float32).reshape(10, 10, 6)
    data[0] = mark
    np.save(tmp_path / "filled.npy", data)
    bpy.ops.spectral.volume_import(filepath=str(tmp_path / "filled.npy"), preset="narrow")
    for material in stated_transfer(bpy.context.object.data).transfer.materials:
        assert np.diff(material.values).min() > 0.005
        assert material.extinction.max() > 0.5


def test_a_peak_too_narrow_for_a_curve_is_refused(blender, ramp):
    from blender_addon.translate.volume_looks.transfer import stated_transfer, store_transfer
    from spectral_core.errors import InvalidInputError
    from spectral_core.volume.documents.transfer_document import TransferDocument
    from spectral_core.volume.transfer import Material, TransferFunction

    bpy.ops.spectral.volume_import(filepath=str(ramp[0]), preset="wide")
    data = bpy.context.object.data
    before = stated_transfer(data).transfer.names
    peak = Material("thin", [0.4, 0.4 + 4e-7, 0.4 + 8e-7], [0, 1, 0], [1, 1, 1])
    with pytest.raises(InvalidInputError, match="'thin' has a peak between 0.4 and 0.4000008"):
        store_transfer(data, TransferDocument(TransferFunction((peak,)), "fraction", "voxel"))
    edge = replace(peak, name="edge", values=[0.0, 0.5, 1.0], gradient_values=[0.0, 0.5, 0.5 + 4e-7, 0.5 + 8e-7, 1.0],
                   gradient_weights=[0, 0, 1, 0, 0])  # fmt: skip
    with pytest.raises(InvalidInputError, match="'edge' has a peak between 0.5 and 0.5000008"):
        store_transfer(data, TransferDocument(TransferFunction((edge,)), "fraction", "voxel"))
    assert stated_transfer(data).transfer.names == before  # the old function is kept
    jump = Material("jump", [0.4, 0.4, 0.4], [0, 1, 0.5], [1, 1, 1])
    store_transfer(data, TransferDocument(TransferFunction((jump,)), "fraction", "voxel"))
    assert stated_transfer(data).transfer.materials[0].extinction.tolist() == [0, 1, 0.5]


@pytest.mark.parametrize("name", ["color", "density", "emission", "gradient"])
def test_a_number_of_a_material_that_is_nan_leaves_the_volume_out_with_its_name(blender, ramp, name):
    """A script may store NaN; a NaN emission was taken for none."""
    thing = imported(ramp[0], preset="xray")
    entry = thing.data.spectral.materials[0]
    entry.use_gradient = name == "gradient"
    assert len(translated().volumes) == 1
    setattr(entry, name, (float("nan"), 0.5, 0.5) if name == "color" else float("nan"))
    scene = translated()
    assert not scene.volumes
    told = [note.message for note in scene.notes if note.subject == thing.name]
    assert any("nan" in text and repr(entry.name) in text and "left out" in text for text in told), told

# SPDX-License-Identifier: GPL-3.0-or-later
"""Volumes in Blender: colors from the palette, types of lighting, edges."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

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


def test_visibility_that_a_volume_does_not_follow_is_named(blender, ramp):
    thing = imported(ramp[0], preset="wide")
    assert not any("Ray Visibility" in note.message for note in translated().notes)
    thing.visible_glossy = False
    assert [note.subject for note in translated().notes if "Ray Visibility" in note.message] == [thing.name]


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

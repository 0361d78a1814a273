# SPDX-License-Identifier: GPL-3.0-or-later
"""Volumes in Blender: colors from the palette, types of lighting, edges."""

from __future__ import annotations

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

# SPDX-License-Identifier: GPL-3.0-or-later
"""Dragging a target changes a Rendered viewport before Apply; Apply sets the colors for EEVEE."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from spectral_core.spectra.spectrum import Reflectance  # noqa: E402
from tests.blender_viewport.edits.test_viewport_edits import shader, updated, whole  # noqa: E402


@pytest.fixture
def palette(stage):
    """A palette designs the ball's material for its color in daylight."""
    palette = stage.scene.spectral.palette
    bpy.ops.spectral.palette_preset(preset="HIDDEN_MARK")
    palette.materials[0].material = stage.material
    palette.lights[0].light = bpy.data.lights["Lamp"]
    updated(stage)
    return palette


def main_color(scene, material):
    return next(each.surface.base_color for each in scene.materials if each.name == material.name)


def known(stage):
    return next(iter(stage.link.scenes.values()))


def drag(color):
    cell = bpy.context.scene.spectral.palette.materials[0].cells[0]
    cell.mode = "FIXED"
    cell.target = color


def test_a_dragged_color_is_visible_in_the_view_before_apply(stage, palette):
    updated(stage, lambda _stage: drag((0.2, 0.5, 0.3)))
    first = main_color(known(stage), stage.material)
    assert isinstance(first, Reflectance)
    assert not isinstance(main_color(whole(stage), stage.material), Reflectance)  # the file changes only with Apply
    assert palette.picture.startswith("Rendered anew")
    updated(stage, lambda _stage: drag((0.5, 0.3, 0.2)))
    second = main_color(known(stage), stage.material)
    assert np.abs(second.values - first.values).max() > 0.01
    updated(stage, lambda _stage: bpy.ops.spectral.palette_apply())
    applied = main_color(whole(stage), stage.material)
    np.testing.assert_allclose(applied.values, second.values, atol=1e-6)
    assert palette.picture == ""


def test_the_view_shows_the_file_if_show_in_viewport_is_off(stage, palette):
    updated(stage, lambda _stage: drag((0.2, 0.5, 0.3)))
    updated(stage, lambda _stage: setattr(palette, "in_viewport", False))
    assert not isinstance(main_color(known(stage), stage.material), Reflectance)


@pytest.mark.parametrize("wanted", [True, False])
def test_apply_sets_the_colors_of_solid_mode_and_eevee(stage, palette, wanted):
    base = shader(stage.material)["Base Color"]
    before = tuple(base.default_value)
    drag((0.2, 0.5, 0.3))
    palette.apply_colors = wanted
    bpy.ops.spectral.palette_apply()
    if not wanted:
        assert tuple(base.default_value) == before
        return
    assert palette.lights[0].name == "Daylight"
    # the first light of the preset is daylight, so the color under it is the color in daylight
    cell = palette.materials[0].cells[0]
    shown = np.array(cell.actual_linear) / palette.brightness
    ratio = np.array(base.default_value[:3]) / shown
    np.testing.assert_allclose(ratio, ratio.mean(), rtol=0.02)
    assert tuple(stage.material.diffuse_color) == tuple(base.default_value)


def test_apply_keeps_a_color_that_comes_from_nodes(stage, palette):
    tree, base = stage.material.node_tree, shader(stage.material)["Base Color"]
    tree.links.new(tree.nodes.new("ShaderNodeTexNoise").outputs[1], base)
    before = tuple(base.default_value)
    drag((0.2, 0.5, 0.3))
    bpy.ops.spectral.palette_apply()
    assert base.is_linked
    assert tuple(base.default_value) == before

# SPDX-License-Identifier: GPL-3.0-or-later
"""Notes on settings of view layers that have an effect only beside another setting."""

from __future__ import annotations

import pytest

bpy = pytest.importorskip("bpy")


@pytest.fixture
def scene(blender):
    """A scene with a camera that looks along -z."""
    scene = bpy.context.scene
    scene.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(scene.camera)
    return scene


@pytest.mark.parametrize("is_on", [False, True])
@pytest.mark.parametrize("of_layer", [False, True])
def test_freestyle_is_named_where_blender_draws_its_lines(scene, is_on, of_layer) -> None:
    """In Blender 5 the switch of a layer is on by default, and that of the scene is off."""
    from blender_addon.translate.scene import translate_scene

    bpy.context.view_layer.use_freestyle, scene.render.use_freestyle = of_layer, is_on
    notes = [note.message for note in translate_scene(bpy.context.evaluated_depsgraph_get()).notes]
    assert sum("Freestyle" in each for each in notes) == (is_on and of_layer)

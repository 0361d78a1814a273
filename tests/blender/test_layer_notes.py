# SPDX-License-Identifier: GPL-3.0-or-later
"""Notes on settings of view layers that have an effect only beside another setting."""

from __future__ import annotations

import pytest

bpy = pytest.importorskip("bpy")


@pytest.mark.parametrize("is_on", [False, True])
def test_freestyle_of_a_layer_is_named_only_if_the_scene_uses_it(blender, monkeypatch, is_on) -> None:
    """Its declared default is off in Blender 4.3, where new scenes have it on."""
    from blender_addon.translate import ledger
    from blender_addon.translate.scene import translate_scene

    scene, layer = bpy.context.scene, bpy.context.view_layer
    scene.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(scene.camera)
    usual = ledger.at_default
    monkeypatch.setattr(
        ledger,
        "at_default",
        lambda item, name: usual(item, name) if name != "use_freestyle" else not item.use_freestyle,
    )
    layer.use_freestyle, scene.render.use_freestyle = True, is_on
    notes = [note.message for note in translate_scene(bpy.context.evaluated_depsgraph_get()).notes]
    assert any("Freestyle" in each for each in notes) is is_on

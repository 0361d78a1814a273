# SPDX-License-Identifier: GPL-3.0-or-later
"""Windows that show a linked scene, or have a linked collection active: nothing is written in vain, or fails."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

CHANGES = [
    ("recipe_find", {}, "recipe"), ("texture_design", {}, "texture"), ("texture_wanted_color", {}, "texture"),
    ("board_learn", {"target": 'bpy.data.worlds["Own"].spectral.strength'}, "mixing board"),
    ("board_unbind", {}, "mixing board"), ("board_order", {}, "mixing board"), ("board_disorder", {}, "mixing board"),
    ("dial_play", {"selector": (0.5, 0.0)}, "light dial"), ("dial_reset", {}, "light dial"),
    ("dial_apply", {}, "light dial"), ("dial_bake", {}, "objects"),
    ("volume_import", {"filepath": "/x.npy"}, "objects"),
    ("sweep_add", {"target": 'bpy.data.worlds["Own"].spectral.strength'}, "sweep"), ("sweep_remove", {}, "sweep"),
]  # fmt: skip


@pytest.fixture
def linked_scene(blender, tmp_path):
    """A scene with bulbs and a recipe, linked from another file and shown in the window."""
    blender.ops.wm.read_factory_settings(use_empty=True)
    master = bpy.context.scene
    master.name = "Master"
    for name in ("Key", "Fill"):
        master.spectral.dial.bulbs.add().name = name
    master.spectral.recipe.text = "an earlier recipe"
    bpy.data.libraries.write(str(tmp_path / "master.blend"), {master})
    blender.ops.wm.read_factory_settings(use_empty=True)
    bpy.data.worlds.new("Own")
    with bpy.data.libraries.load(str(tmp_path / "master.blend"), link=True) as (_, wanted):
        wanted.scenes = ["Master"]
    bpy.context.window.scene = wanted.scenes[0]
    return wanted.scenes[0]


def written(scene) -> str:
    """What these operators write into a scene."""
    own = scene.spectral
    return repr((
        own.recipe.text, own.texture.status, len(own.texture.wanted_colors), len(own.board.bindings),
        len(own.board.orders), tuple(own.dial.selector), own.dial.intensity, len(own.sweep.parameters),
        len(scene.objects),
    ))  # fmt: skip


@pytest.mark.parametrize(("name", "options", "what"), CHANGES, ids=[name for name, *_ in CHANGES])
def test_a_linked_scene_is_not_changed(linked_scene, name, options, what) -> None:
    before = written(linked_scene)
    with pytest.raises(RuntimeError, match=rf"scene 'Master' is linked from master\.blend.*changes of its {what}"):
        getattr(bpy.ops.spectral, name)(**options)
    assert written(linked_scene) == before


def test_a_volume_beside_an_active_linked_collection_goes_to_the_scene(blender, tmp_path) -> None:
    blender.ops.wm.read_factory_settings(use_empty=True)
    bpy.data.libraries.write(str(tmp_path / "set.blend"), {bpy.data.collections.new("Set")})
    blender.ops.wm.read_factory_settings(use_empty=True)
    with bpy.data.libraries.load(str(tmp_path / "set.blend"), link=True) as (_, wanted):
        wanted.collections = ["Set"]
    scene, layer = bpy.context.scene, bpy.context.view_layer
    scene.collection.children.link(wanted.collections[0])
    layer.active_layer_collection = layer.layer_collection.children[0]
    assert bpy.context.collection.library is not None
    np.save(tmp_path / "cloud.npy", np.linspace(0, 1, 64, dtype=np.float32).reshape(4, 4, 4))
    assert bpy.ops.spectral.volume_import(filepath=str(tmp_path / "cloud.npy")) == {"FINISHED"}
    assert [each.type for each in scene.collection.objects] == ["VOLUME"]
    assert layer.objects.active == scene.collection.objects[0]

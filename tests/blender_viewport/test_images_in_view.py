# SPDX-License-Identifier: GPL-3.0-or-later
"""Images whose files another program has changed: a view shows what F12 shows, and reads an image no more than that."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from tests.blender_viewport.test_viewport_edits import shader, updated, whole  # noqa: E402


def write(path, value):
    made = bpy.data.images.new("Written", 2, 2)
    made.pixels.foreach_set(np.full(16, value, np.float32))
    made.filepath_raw, made.file_format = str(path), "PNG"
    made.save()
    bpy.data.images.remove(made)


@pytest.fixture
def pictured(stage, tmp_path):
    """The scene with one image file on a material and in the world, and its view."""
    write(tmp_path / "picture.png", 0.2)
    stage.path, stage.image = tmp_path / "picture.png", bpy.data.images.load(str(tmp_path / "picture.png"))
    world = bpy.context.scene.world = bpy.data.worlds.new("World")
    if world.node_tree is None:  # before Blender 5
        world.use_nodes = True
    for tree, kind, socket in (
        (stage.material.node_tree, "ShaderNodeTexImage", shader(stage.material)["Base Color"]),
        (world.node_tree, "ShaderNodeTexEnvironment", world.node_tree.nodes["Background"].inputs["Color"]),
    ):
        node = tree.nodes.new(kind)
        node.image = stage.image
        tree.links.new(node.outputs["Color"], socket)
    updated(stage)
    return stage


def pixels(scene):
    """Pixels of the environment, and of the material's image."""
    material = next(each for each in scene.materials if each.name == "Paint")
    steps = material.surface.base_color.program.instructions
    return scene.world.color.pixels, next(step.data.pixels for step in steps if step.data is not None)


def test_an_image_that_a_script_reloads_is_shown(pictured):
    """Blender reports the materials that use it, and not the image."""
    before = pixels(next(iter(pictured.link.scenes.values())))
    for value in (0.8, 0.5):
        write(pictured.path, value)
        updated(pictured, lambda stage: stage.image.reload())
        shown, true = pixels(next(iter(pictured.link.scenes.values()))), pixels(whole(pictured))
        for old, own, other in zip(before, shown, true, strict=True):
            np.testing.assert_array_equal(own, other)
            assert not np.array_equal(old, own)
        before = shown


def test_other_edits_read_no_image_again(pictured, monkeypatch):
    from blender_addon.translate.shading import images

    read, usual = [], images._read
    monkeypatch.setattr(images, "_read", lambda *given: read.append(given[1].name) or usual(*given))
    rough = shader(pictured.material)["Roughness"]
    for value in (0.1, 0.9):
        updated(pictured, lambda _stage, value=value: setattr(rough, "default_value", value))
    assert read == []
    updated(pictured, lambda stage: stage.image.reload())
    assert "picture.png" in read

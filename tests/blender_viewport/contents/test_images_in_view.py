# SPDX-License-Identifier: GPL-3.0-or-later
"""Images whose files another program has changed: a view shows what F12 shows, and reads an image no more than that."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from tests.blender_viewport.edits.test_viewport_edits import shader, updated, whole  # noqa: E402


def write(path, value):
    made = bpy.data.images.new("Written", 2, 2)
    made.pixels.foreach_set(np.full(16, value, np.float32))
    made.filepath_raw, made.file_format = str(path), "PNG"
    made.save()
    bpy.data.images.remove(made)


@pytest.fixture
def pictured(coarse, tmp_path):
    """The scene with one image file on a material and in the world, and its view."""
    stage = coarse
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


def undo_of_a_move():
    bpy.ops.ed.undo_push(message="before")
    bpy.data.objects["Ball"].location.x += 1
    bpy.ops.ed.undo_push(message="moved")
    bpy.ops.ed.undo()


def stroke(value):
    """A stroke of a brush on the image, which Blender reports."""
    image = bpy.data.images["picture.png"]
    image.pixels.foreach_set(np.full(16, value, np.float32))
    image.update()
    image.update_tag()


def test_what_changes_no_image_reads_none_again(pictured, monkeypatch):
    """Frames, undos, and strokes on other images: an image of 4096 × 4096 pixels takes half a second or more."""
    from blender_addon.translate.shading import images

    other = bpy.data.images.new("other", 2, 2)
    node = pictured.material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = other
    pictured.material.node_tree.links.new(node.outputs["Color"], shader(pictured.material)["Roughness"])
    updated(pictured)
    updated(pictured, lambda _stage: undo_of_a_move())  # Blender has loaded the file before: it is read once more
    read, usual = [], images._read
    monkeypatch.setattr(images, "_read", lambda *given: read.append(given[1].name) or usual(*given))
    for edit in (lambda: bpy.context.scene.frame_set(7), undo_of_a_move, undo_of_a_move):
        updated(pictured, lambda _stage, edit=edit: edit())
    assert read == []

    def edit(_stage):
        bpy.data.images["other"].generated_color = (1, 0, 0, 1)

    updated(pictured, edit)
    assert set(read) == {"other"}


def test_an_image_is_that_of_f12_after_strokes_saves_and_undos(pictured):
    def saved():
        bpy.data.images["picture.png"].save()

    def written_and_undone():
        write(pictured.path, 0.35)
        bpy.data.images["picture.png"].reload()
        undo_of_a_move()

    steps = (
        lambda: stroke(0.6), undo_of_a_move, lambda: stroke(0.3), saved, undo_of_a_move, written_and_undone,
        lambda: bpy.data.images["picture.png"].pack(), lambda: stroke(0.9), undo_of_a_move,
        lambda: bpy.data.images["picture.png"].reload(), undo_of_a_move,
        lambda: setattr(bpy.data.images["picture.png"].colorspace_settings, "name", "Non-Color"), undo_of_a_move,
    )  # fmt: skip
    for number, step in enumerate(steps):
        updated(pictured, lambda _stage, step=step: step())
        shown, true = pixels(next(iter(pictured.link.scenes.values()))), pixels(whole(pictured))
        for own, other in zip(shown, true, strict=True):
            np.testing.assert_array_equal(own, other, err_msg=f"step {number}")

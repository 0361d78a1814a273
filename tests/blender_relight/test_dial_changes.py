# SPDX-License-Identifier: GPL-3.0-or-later
"""The dial notices a scene that is no longer the recorded one, shows over the camera, counts lights first."""

from __future__ import annotations

import bpy
import pytest


def test_a_recorded_scene_is_as_recorded(dial, stage):
    assert bpy.ops.spectral.dial_check() == {"FINISHED"}
    assert dial.changes == ""
    dial.selector = (0.3, 0.2)  # turning the dial changes nothing of the scene
    bpy.ops.spectral.dial_check()
    assert dial.changes == ""


@pytest.mark.parametrize("edit", ["moved", "dimmed", "painted", "added", "removed", "resized"])
def test_an_edit_is_named_on_the_dial(dial, stage, edit):
    if edit == "moved":
        bpy.data.objects["Key"].location.x += 1.0
    elif edit == "dimmed":
        bpy.data.lights["Fill"].energy *= 2
    elif edit == "painted":
        tree = bpy.data.materials["Floor"].node_tree
        next(node for node in tree.nodes if node.type == "BSDF_DIFFUSE").inputs["Color"].default_value = (1, 0, 0, 1)
    elif edit == "added":
        stage.collection.objects.link(bpy.data.objects.new("New", bpy.data.lights.new("New", "POINT")))
    elif edit == "removed":
        bpy.data.objects.remove(bpy.data.objects["Ball"])
    else:
        stage.render.resolution_x = 20
    bpy.ops.spectral.dial_check()
    told = {
        "moved": "light 'Key' was changed",
        "dimmed": "light 'Fill' was changed",
        "painted": "material 'Floor' was changed",
        "added": "light 'New' was added",
        "removed": "object 'Ball' was removed",
        "resized": "the size of the picture was changed",
    }
    assert told[edit] in dial.changes
    bpy.ops.spectral.dial_record()
    assert dial.changes == ""


def test_applying_the_dial_is_no_change_but_an_edit_before_it_still_is(dial, stage):
    dial.selector = (0.4, 0.1)
    bpy.ops.spectral.dial_apply()
    bpy.ops.spectral.dial_check()
    assert dial.changes == ""
    bpy.data.objects["Fill"].location.x += 1.0
    bpy.ops.spectral.dial_apply(restore=True)
    bpy.ops.spectral.dial_check()
    assert "light 'Fill' was changed" in dial.changes
    assert "Key" not in dial.changes


def test_a_change_survives_saving(dial, stage):
    bpy.data.objects["Key"].location.x += 1.0
    bpy.ops.wm.save_mainfile()
    bpy.ops.wm.open_mainfile(filepath=bpy.data.filepath)
    bpy.ops.spectral.dial_check()
    assert "light 'Key' was changed" in bpy.context.scene.spectral.dial.changes


def test_the_picture_stands_over_the_camera_view(dial, stage):
    camera = stage.camera.data
    bpy.ops.spectral.dial_show()
    shown = [each.image.name for each in camera.background_images]
    assert shown == ["Light Dial"]
    assert camera.show_background_images
    assert camera.background_images[0].display_depth == "FRONT"
    bpy.ops.spectral.dial_show()
    assert len(camera.background_images) == 1
    dial.over_camera = False
    assert len(camera.background_images) == 0


def test_too_many_lights_are_refused_before_anything_is_rendered(stage):
    from blender_addon import jobs

    for number in range(70):
        stage.collection.objects.link(bpy.data.objects.new(f"L{number}", bpy.data.lights.new("L", "POINT")))
    jobs.records.clear()
    with pytest.raises(RuntimeError, match=r"74 light groups, and a dial has up to 64 lights"):
        bpy.ops.spectral.dial_record()
    assert not [entry for entry in jobs.records if entry.status == "done"]
    assert len(stage.spectral.dial.bulbs) == 0


def test_saving_the_transport_elsewhere(dial, stage, tmp_path):
    assert bpy.ops.spectral.dial_keep(filepath=str(tmp_path / "kept.exr")) == {"FINISHED"}
    assert (tmp_path / "kept.exr").is_file()
    with pytest.raises(RuntimeError, match="no file is chosen"):
        bpy.ops.spectral.dial_keep()

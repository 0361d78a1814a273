# SPDX-License-Identifier: GPL-3.0-or-later
"""The dial reports changes since the recording, is drawn over the camera view, and counts lights before recording."""

from __future__ import annotations

import bpy
import numpy as np
import pytest


def test_a_recorded_scene_is_as_recorded(dial, stage):
    assert bpy.ops.spectral.dial_check() == {"FINISHED"}
    assert dial.changes == ""
    dial.selector = (0.3, 0.2)  # moving the dial does not change the scene
    bpy.ops.spectral.dial_check()
    assert dial.changes == ""


@pytest.mark.usefixtures("without_rays")
@pytest.mark.parametrize("edit", ["moved", "dimmed", "painted", "added", "removed", "resized"])
def test_an_edit_is_reported_on_the_dial(dial, stage, edit):
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


@pytest.mark.usefixtures("without_rays")
def test_applying_the_dial_is_no_change_and_an_earlier_edit_is_reported(dial, stage):
    dial.selector = (0.4, 0.1)
    bpy.ops.spectral.dial_apply()
    bpy.ops.spectral.dial_check()
    assert dial.changes == ""
    bpy.data.objects["Fill"].location.x += 1.0
    bpy.ops.spectral.dial_apply(restore=True)
    bpy.ops.spectral.dial_check()
    assert "light 'Fill' was changed" in dial.changes
    assert "Key" not in dial.changes


@pytest.mark.usefixtures("without_rays")
def test_a_change_survives_saving(dial, stage):
    bpy.data.objects["Key"].location.x += 1.0
    bpy.ops.wm.save_mainfile()
    bpy.ops.wm.open_mainfile(filepath=bpy.data.filepath)
    bpy.ops.spectral.dial_check()
    assert "light 'Key' was changed" in bpy.context.scene.spectral.dial.changes


def test_the_picture_is_drawn_over_the_camera_view(dial, stage):
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


@pytest.mark.parametrize("hide", ["eye", "monitor", "layer"])
def test_hiding_in_the_viewport_alone_is_no_change(dial, stage, hide):
    """A lamp or an object that is hidden in the viewport alone does not change the rendered picture."""
    for name in ("Key", "Ball"):
        thing = bpy.data.objects[name]
        if hide == "eye":
            thing.hide_set(True)
        elif hide == "monitor":
            thing.hide_viewport = True
        else:
            own = bpy.data.collections.new(f"of {name}")
            stage.collection.children.link(own)
            own.objects.link(thing)
            stage.collection.objects.unlink(thing)
            bpy.context.view_layer.layer_collection.children[own.name].hide_viewport = True
    bpy.ops.spectral.dial_check()
    assert dial.changes == ""
    bpy.data.lights["Fill"].energy *= 2
    bpy.ops.spectral.dial_check()
    assert dial.changes == "light 'Fill' was changed"


def test_a_lamp_that_is_disabled_in_renders_is_not_recorded(stage):
    pytest.importorskip("mitsuba")
    spare = bpy.data.objects.new("Spare", bpy.data.lights.new("Spare", "POINT"))
    stage.collection.objects.link(spare)
    spare.hide_render = True
    bpy.ops.spectral.dial_record()
    dial = stage.spectral.dial
    assert "Spare" not in [bulb.name for bulb in dial.bulbs]
    for edit in ("moved", "hidden", "shown"):
        if edit == "moved":
            spare.location.x += 1
        else:
            spare.hide_set(edit == "hidden")
        bpy.ops.spectral.dial_check()
        assert dial.changes == ""
    spare.hide_render = False
    bpy.ops.spectral.dial_check()
    assert dial.changes == "light 'Spare' was added"


@pytest.mark.usefixtures("without_rays")
def test_a_lamp_that_was_hidden_in_the_viewport_while_recording_is_no_addition(stage):
    pytest.importorskip("mitsuba")
    bpy.data.objects["Key"].hide_set(True)
    bpy.ops.spectral.dial_record()
    dial = stage.spectral.dial
    assert "Key" in [bulb.name for bulb in dial.bulbs]
    bpy.data.objects["Key"].hide_set(False)
    bpy.ops.spectral.dial_check()
    assert dial.changes == ""


def test_only_the_changed_light_is_rendered_again(dial, stage, picture, monkeypatch):
    from blender_addon import jobs

    asked, render = [], jobs.render
    monkeypatch.setattr(jobs, "render", lambda *args, **how: asked.append(how["groups"]) or render(*args, **how))
    bpy.data.objects["Key"].location.x += 1.0
    assert bpy.ops.spectral.dial_record(only_changed=True) == {"FINISHED"}
    assert dial.changes == ""
    shown = picture()
    bpy.ops.spectral.dial_record()
    np.testing.assert_allclose(picture().mean(axis=(0, 1)), shown.mean(axis=(0, 1)), rtol=0.02)
    bpy.data.objects["Ball"].location.x += 1.0  # its shadow is in the light of the other groups
    bpy.ops.spectral.dial_record(only_changed=True)
    bpy.ops.spectral.dial_record(only_changed=True)
    assert asked == [("Key",), True, True]

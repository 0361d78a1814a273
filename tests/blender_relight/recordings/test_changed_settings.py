# SPDX-License-Identifier: GPL-3.0-or-later
"""The dial reports changed settings of renders, and what objects show in renders only, whatever the viewport shows."""

from __future__ import annotations

from dataclasses import replace

import bpy
import numpy as np
import pytest


def _of_f12():
    """The scene that F12 renders, without what only affects noise."""
    from blender_addon import jobs
    from spectral_core.errors import RenderCancelled

    scenes = []

    def catch(scene):
        scenes.append(scene)
        raise RenderCancelled("only the scene was requested")

    with jobs.request(jobs.RenderRequest(translated=catch)):
        bpy.ops.render.render()
    return replace(scenes[0], notes=())


def _hair(scene):
    ball = bpy.data.objects["Ball"]
    ball.modifiers.new("Hair", "PARTICLE_SYSTEM")
    hair = ball.particle_systems[0].settings
    hair.type, hair.count, hair.hair_length = "HAIR", 5, 0.3


def _subdivided(scene):
    modifier = bpy.data.objects["Ball"].modifiers.new("Fine", "SUBSURF")
    modifier.levels, modifier.render_levels = 0, 1


def _only_in_renders(scene):
    modifier = bpy.data.objects["Ball"].modifiers.new("Twist", "SIMPLE_DEFORM")
    modifier.show_viewport = False


def _moved_border(scene):
    scene.render.border_min_x, scene.render.border_max_x = 0.5, 1.0  # of the same size


def _blurred(scene):
    ball = bpy.data.objects["Ball"]
    scene.render.use_motion_blur = True
    for frame, height in ((0, 0.2), (1, 0.6), (2, 1.0)):  # at frame 1 it is where it was recorded
        ball.location.z = height
        ball.keyframe_insert("location", frame=frame)
    for curve in ball.animation_data.action.layers[0].strips[0].channelbags[0].fcurves:
        for point in curve.keyframe_points:
            point.interpolation = "LINEAR"
    scene.frame_set(1)


EDITS = {
    "bounces": (lambda scene: setattr(scene.cycles, "diffuse_bounces", 0), "a limit of light paths was changed"),
    "clamping": (lambda scene: setattr(scene.cycles, "sample_clamp_direct", 0.5), "a limit of light paths was changed"),
    "film exposure": (lambda scene: setattr(scene.cycles, "film_exposure", 3.0), "the film was changed"),
    "filter": (lambda scene: setattr(scene.cycles, "filter_width", 5.0), "the film was changed"),
    "transparent": (lambda scene: setattr(scene.render, "film_transparent", True), "the film was changed"),
    "pixel aspect": (lambda scene: setattr(scene.render, "pixel_aspect_x", 2.0), "the film was changed"),
    "border": (_moved_border, "the film was changed"),
    "transport": (lambda scene: setattr(scene.spectral.render, "transport", "SPECTRAL"), "the render plan was changed"),
    "hair": (_hair, "the rendered form of object 'Ball' was changed"),
    "subdivision": (_subdivided, "the rendered form of object 'Ball' was changed"),
    "modifier": (_only_in_renders, "the rendered form of object 'Ball' was changed"),
    "motion": (_blurred, "the motion blur was changed"),
}


@pytest.mark.usefixtures("without_rays")
@pytest.mark.parametrize("edit", EDITS)
def test_a_setting_that_changes_the_picture_is_reported(dial, stage, edit):
    from spectral_core.scene import scene_hash

    if edit == "border":
        stage.render.use_border = stage.render.use_crop_to_border = True
        stage.render.border_min_x, stage.render.border_max_x = 0.0, 0.5
        bpy.ops.spectral.dial_record()
    change, told = EDITS[edit]
    before = scene_hash(_of_f12())
    change(stage)
    bpy.context.view_layer.update()
    assert scene_hash(_of_f12()) != before
    bpy.ops.spectral.dial_check()
    assert told in dial.changes
    bpy.ops.spectral.dial_record()
    bpy.ops.spectral.dial_check()
    assert dial.changes == ""


@pytest.mark.usefixtures("without_rays")
def test_settings_of_noise_are_no_change(dial, stage):
    stage.spectral.render.samples, stage.spectral.render.seed = 5, 7
    stage.spectral.render.denoise = True
    stage.view_layers[0].use_pass_z = True
    bpy.ops.spectral.dial_check()
    assert dial.changes == ""


@pytest.mark.usefixtures("without_rays")
def test_the_rendered_form_of_an_object_is_the_same_in_the_next_session(stage):
    _hair(stage)
    _subdivided(stage)
    bpy.ops.spectral.dial_record()
    bpy.ops.wm.save_mainfile()
    bpy.ops.wm.open_mainfile(filepath=bpy.data.filepath)
    bpy.ops.spectral.dial_check()
    dial = bpy.context.scene.spectral.dial
    assert dial.changes == ""
    bpy.data.particles[0].hair_length = 0.6
    bpy.ops.spectral.dial_check()
    assert dial.changes == "the rendered form of object 'Ball' was changed"


@pytest.mark.usefixtures("without_rays")
def test_a_recording_of_an_earlier_version_has_no_settings(dial, stage):
    import json

    parts = json.loads(dial.recorded_parts)
    earlier = ("the camera", "the size", "the world", "the view layer", "light ", "mesh ", "material ", "object ")
    dial.recorded_parts = json.dumps({name: parts[name] for name in parts if name.startswith(earlier)})
    stage.cycles.diffuse_bounces = 0
    bpy.ops.spectral.dial_check()
    assert dial.changes == ""


@pytest.mark.parametrize("storage", ["DIAL", "EXACT"])
def test_the_picture_has_the_exposure_and_adaptation_of_the_look_as_a_render_has(stage, picture, storage, tmp_path):
    stage.render.resolution_x, stage.render.resolution_y, stage.spectral.render.samples = 6, 4, 256
    stage.cycles.sample_clamp_indirect = 0
    look = stage.spectral.viewport.look
    look.kind, look.lamp, look.exposure, look.adapts = "LAMP", "A", 1.0, True
    stage.spectral.dial.storage = storage
    bpy.ops.spectral.dial_record()
    stage.render.image_settings.file_format, stage.render.image_settings.color_depth = "OPEN_EXR", "32"
    for exposure in (1.0, -2.0):  # of the look, after the recording
        look.exposure = exposure
        bpy.ops.spectral.dial_show()
        stage.render.filepath = str(tmp_path / "f12.exr")
        bpy.ops.render.render(write_still=True)
        image = bpy.data.images.load(stage.render.filepath, check_existing=False)
        rendered = np.empty(image.size[0] * image.size[1] * 4, np.float32)
        image.pixels.foreach_get(rendered)
        rendered = rendered.reshape(image.size[1], image.size[0], 4)[..., :3].mean(axis=(0, 1))
        assert picture()[..., :3].mean(axis=(0, 1)) == pytest.approx(rendered, rel=0.04)
    bpy.ops.spectral.dial_check()
    assert stage.spectral.dial.changes == ""
    look.lamp = "D50"
    bpy.ops.spectral.dial_check()
    assert stage.spectral.dial.changes == "the look was changed"


def test_an_update_of_the_scene_is_compared_only_where_its_settings_have_changed(stage):
    from types import SimpleNamespace

    from blender_addon.editing.dial import changes

    updated = SimpleNamespace(view_layer=stage.view_layers[0], updates=[SimpleNamespace(id=stage)])
    changes._has_new_settings(stage, updated)  # the first update of a session
    stage.spectral.dial.selector = (0.3, 0.2)
    assert not changes._has_new_settings(stage, updated)
    stage.cycles.diffuse_bounces = 0
    assert changes._has_new_settings(stage, updated)
    assert not changes._has_new_settings(stage, updated)
    stage.render.use_border = stage.render.use_crop_to_border = True
    stage.render.border_min_x = stage.render.border_max_x = 0.5  # an empty border, which is no error here
    assert changes._has_new_settings(stage, updated)
    other = SimpleNamespace(view_layer=stage.view_layers[0], updates=[SimpleNamespace(id=bpy.data.lights["Key"])])
    assert not changes._has_new_settings(stage, other)

# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of a render that keyframes or drivers change: options of a command line replace them, motion blur takes
those of the frame.
"""

from __future__ import annotations

import argparse

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from blender_addon.commands import _blend  # noqa: E402
from tests.blender.engine.test_motion import fly, moments, places  # noqa: E402, F401

SAMPLES, SEED = "spectral.render.samples", "spectral.render.seed"


def opened(*words: str):
    """The scene of the saved file, opened with options, in frame 3."""
    parser = argparse.ArgumentParser()
    _blend.add_scene_arguments(parser)
    scene = _blend.open_scene(parser.parse_args([bpy.data.filepath, *words]))
    scene.frame_set(3)
    return scene


@pytest.mark.parametrize("how", ["keyframes", "strip", "driver"])
def test_options_count_beside_what_the_file_animates(build, tmp_path, how) -> None:
    """A driven seed, and keyframes of the samples, took the places of the given numbers when the frame was set."""
    build.camera()
    scene = bpy.context.scene
    for path in (SAMPLES, SEED):
        if how == "driver":
            scene.driver_add(path).driver.expression = "frame + 20"
        else:
            scene.keyframe_insert(path, frame=1)
    if how == "strip":
        animation = scene.animation_data
        animation.nla_tracks.new().strips.new("strip", 1, animation.action)
        animation.action = None
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    plain = opened()
    samples, seed = plain.path_resolve(SAMPLES), plain.path_resolve(SEED)
    given = opened("--samples", "9")
    assert (given.path_resolve(SAMPLES), given.path_resolve(SEED)) == (9, seed)
    given = opened("--seed", "4")
    assert (given.path_resolve(SAMPLES), given.path_resolve(SEED)) == (samples, 4)


def test_motion_blur_takes_the_shutter_of_the_frame(build, moments) -> None:  # noqa: F811
    """It was read anew at the instants, which have other values: the object was sharp, in another place."""
    fly(build.plane())
    render = bpy.context.scene.render
    for frame, shutter in ((0, 0.2), (1, 1.0)):
        render.motion_blur_shutter = shutter
        render.keyframe_insert("motion_blur_shutter", frame=frame)
    scene = moments()
    count = len(scene.moments)
    assert np.allclose(places(scene, "Plane"), 0.5 + (np.arange(count) + 0.5) / count, atol=0.02)

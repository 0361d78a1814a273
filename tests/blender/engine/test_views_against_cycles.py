# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders of several views: each view has its own camera, as in Cycles."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")
pytest.importorskip("mitsuba", reason="needs Mitsuba: pip install 'spectral-scene[render]'")

from tests.blender import cycles  # noqa: E402

SUFFIXES = ("_near", "_far", "_middle")


def _cameras(build):
    """Three cameras that differ in all that a camera has."""
    scene = bpy.context.scene
    for suffix, x in zip(SUFFIXES, (-0.5, 0.6, 0.0), strict=True):
        camera = build.camera((x, -0.4, 5.0 + x), lens=50 + 40 * x, shift_x=0.1 * x, shift_y=0.2 * x)
        camera.name = f"Camera{suffix}"
    scene.camera = bpy.data.objects["Camera_near"]
    scene.render.use_multiview, scene.render.views_format = True, "MULTIVIEW"
    views = scene.render.views
    for name, suffix in zip(("left", "right", "third"), SUFFIXES, strict=True):
        view = views.get(name) or views.new(name)
        view.camera_suffix = view.file_suffix = suffix


def _pictures(folder, engine, suffixes=SUFFIXES):
    """Linear pixels (height, width, 3) by the suffix of the view."""
    scene = bpy.context.scene
    scene.render.engine, scene.render.filepath = engine, str(folder / f"{engine}.exr")
    bpy.ops.render.render(write_still=True)
    found = {}
    for suffix in suffixes:
        image = bpy.data.images.load(str(folder / f"{engine}{suffix}.exr"), check_existing=False)
        found[suffix] = np.array(image.pixels[:]).reshape(image.size[1], image.size[0], 4)[..., :3]
    return found


def test_each_view_has_the_lens_and_the_shift_of_its_own_camera(build, tmp_path):
    build.plane(size=1.5, material=build.material(shader="ShaderNodeEmission"))
    _cameras(build)
    cycles.settings(samples=64, size=24)
    bpy.context.scene.spectral.render.samples = 64
    theirs, ours = _pictures(tmp_path, "CYCLES"), _pictures(tmp_path, "SPECTRAL")
    for suffix in SUFFIXES:
        assert np.abs(ours[suffix] - theirs[suffix]).mean() < 0.01, suffix
    assert np.abs(theirs["_near"] - theirs["_far"]).mean() > 0.1


def test_both_eyes_of_a_mirrored_camera_are_mirrored(build, tmp_path):
    build.plane(size=1.0, material=build.material(shader="ShaderNodeEmission")).location = (0.3, 0.2, 0.0)
    camera = build.camera((0, 0, 5))
    camera.scale, camera.data.stereo.interocular_distance = (-1, 1, 1), 0.4
    cycles.settings(samples=64, size=24)
    render = bpy.context.scene.render
    render.use_multiview, bpy.context.scene.spectral.render.samples = True, 64
    theirs, ours = (_pictures(tmp_path, engine, ("_L", "_R")) for engine in ("CYCLES", "SPECTRAL"))
    for eye in "_L", "_R":
        assert np.abs(ours[eye] - theirs[eye]).mean() < 0.01, eye
    assert np.abs(theirs["_L"] - theirs["_R"]).mean() > 0.03

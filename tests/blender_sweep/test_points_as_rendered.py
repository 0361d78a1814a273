# SPDX-License-Identifier: GPL-3.0-or-later
"""Points of a sweep are the pictures that F12 renders, where the viewport shows something else."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("bpy", reason="needs the Python module bpy: pip install 'spectral-scene[blender]'")
pytest.importorskip("OpenEXR")

import bpy

from blender_addon.editing.sweep.node import blend_node
from spectral_core.errors import RenderError
from spectral_core.explore.features.picture_files import read_linear
from spectral_core.explore.sweep.parameters import Parameter, Space
from tests.blender_sweep.test_sweep_in_blender import scene  # noqa: F401 - a fixture

BALL, RENDER = 'bpy.data.objects["Ball"]', 'bpy.data.scenes["Scene"].render'
LOOK = 'bpy.data.scenes["Scene"].spectral.viewport.look'
SETTINGS: dict[str, tuple[str, dict[str, Any], Any, Any]] = {
    "hidden": (f"{BALL}.hide_render", {"kind": "choice", "choices": ("off", "on")}, "off", "on"),
    "levels": (f'{BALL}.modifiers["Sub"].render_levels', {"low": 0, "high": 3, "kind": "integer"}, 2, 3),
    "blur": (f"{RENDER}.use_motion_blur", {"kind": "choice", "choices": ("off", "on")}, "on", "off"),
    "shutter": (f"{RENDER}.motion_blur_shutter", {"low": 0.1, "high": 0.9}, 0.5, 0.9),
    "exposure": (f"{LOOK}.exposure", {"low": -1.0, "high": 2.0}, 0.5, 1.5),
    "lamp": (f"{LOOK}.kind", {"kind": "choice", "choices": ("SCENE", "LAMP")}, "SCENE", "LAMP"),
    "frame": ('bpy.data.scenes["Scene"].frame_current', {"low": 1, "high": 9, "kind": "integer"}, 5, 9),
}
"""Path of each setting, its values, the one in the file and another one."""


@pytest.fixture
def moving(scene: Any, tmp_path: Path) -> Path:  # noqa: F811
    """The scene with a moving ball of few faces, and a block that only the viewport hides."""
    stage = bpy.context.scene
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=1, radius=0.8, location=(-1.5, 0, 0.8))
    ball = bpy.context.object
    ball.name = "Ball"
    subdivided = ball.modifiers.new("Sub", "SUBSURF")
    subdivided.levels, subdivided.render_levels = 0, 2
    ball.keyframe_insert("location", frame=1)
    ball.location.x = 1.5
    ball.keyframe_insert("location", frame=9)
    bpy.ops.mesh.primitive_cube_add(size=0.8, location=(0, -1.2, 0.4))
    bpy.context.object.hide_viewport = True
    stage.frame_set(5)
    stage.render.use_motion_blur = True
    look = stage.spectral.viewport.look
    look.exposure, look.lamp, look.adapts = 0.5, "HP1", True
    stage.spectral.render.samples = 8  # of few moments
    stage.render.image_settings.file_format = "OPEN_EXR"
    stage.render.image_settings.color_depth = "32"
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    return tmp_path


def rendered(folder: Path, set_value: Any) -> np.ndarray:
    """The picture of F12 from the file, after a change of it."""
    bpy.ops.wm.open_mainfile(filepath=str(folder / "scene.blend"))
    stage = bpy.context.scene
    set_value()
    stage.frame_set(stage.frame_current)
    stage.render.filepath = str(folder / "f12.exr")
    bpy.ops.render.render(write_still=True)
    return read_linear(folder / "f12.exr")


def test_points_are_the_pictures_of_f12(moving: Path) -> None:
    """Sweeps read the scene of the viewport: what only renders hide or subdivide, and motion blur, had no effect.

    Nor had the exposure and the adaptation of the panel Look Under, with which F12 shows the picture.
    """
    space = Space(tuple(Parameter(name, path=path, **kind) for name, (path, kind, *_) in SETTINGS.items()))
    saved = {name: value for name, (*_, value, _) in SETTINGS.items()}
    points = {"": saved, **{name: {**saved, name: other} for name, (*_, other) in SETTINGS.items()}}
    node, seed = blend_node({"blend": "scene.blend"}, space, moving), bpy.context.scene.spectral.render.seed
    found = {name: node(values, seed).pictures[""][..., :3] for name, values in points.items()}
    as_saved = rendered(moving, lambda: None)
    np.testing.assert_allclose(found[""], as_saved, rtol=1e-5, atol=1e-6)
    for name, (path, *_, other) in SETTINGS.items():
        value = {"on": True, "off": False}.get(other, other)
        expected = rendered(moving, lambda path=path, value=value: exec(f"{path} = {value!r}", {"bpy": bpy}))
        np.testing.assert_allclose(found[name], expected, rtol=1e-5, atol=1e-6, err_msg=name)
        assert np.abs(expected - as_saved).max() > 0.01, name


def test_a_point_without_a_camera_fails_with_blenders_reason(moving: Path) -> None:
    bpy.context.scene.camera = None
    bpy.ops.wm.save_as_mainfile(filepath=str(moving / "scene.blend"))
    frame = Parameter("frame", 1, 9, kind="integer", path=SETTINGS["frame"][0])
    with pytest.raises(RenderError, match="camera"):
        blend_node({"blend": "scene.blend"}, Space((frame,)), moving)

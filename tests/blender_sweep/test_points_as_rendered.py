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

BALL = 'bpy.data.objects["Ball"]'
SETTINGS = {
    "hidden": (f"{BALL}.hide_render", ("off", "on"), "on"),
    "levels": (f'{BALL}.modifiers["Sub"].render_levels', (0, 3), 3),
    "blur": ('bpy.data.scenes["Scene"].render.use_motion_blur', ("off", "on"), "on"),
    "shutter": ('bpy.data.scenes["Scene"].render.motion_blur_shutter', (0.1, 0.9), 0.9),
    "frame": ('bpy.data.scenes["Scene"].frame_current', (1, 9), 9),
}


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


@pytest.mark.parametrize("name", SETTINGS)
def test_a_point_is_the_picture_of_f12(moving: Path, name: str) -> None:
    """Sweeps read the scene of the viewport: what only renders hide or subdivide, and motion blur, had no effect."""
    path, values, chosen = SETTINGS[name]
    kind: dict[str, Any] = {"kind": "choice", "choices": values} if isinstance(chosen, str) else {
        "low": values[0], "high": values[1], "kind": "integer" if isinstance(chosen, int) else "real"}  # fmt: skip
    node = blend_node({"blend": "scene.blend"}, Space((Parameter(name, path=path, **kind),)), moving)
    expected = rendered(moving, lambda: exec(f"{path} = {True if chosen == 'on' else chosen!r}", {"bpy": bpy}))
    as_saved = rendered(moving, lambda: None)
    point = node({name: chosen}, bpy.context.scene.spectral.render.seed).pictures[""][..., :3]
    np.testing.assert_allclose(point, expected, rtol=1e-5, atol=1e-6)
    if name != "blur":  # the file has it
        assert np.abs(expected - as_saved).max() > 0.01


def test_a_point_without_a_camera_fails_with_blenders_reason(moving: Path) -> None:
    bpy.context.scene.camera = None
    bpy.ops.wm.save_as_mainfile(filepath=str(moving / "scene.blend"))
    frame = Parameter("frame", 1, 9, kind="integer", path=SETTINGS["frame"][0])
    with pytest.raises(RenderError, match="camera"):
        blend_node({"blend": "scene.blend"}, Space((frame,)), moving)

# SPDX-License-Identifier: GPL-3.0-or-later
"""Motion blur of volumes: of their objects, and grids of velocities, by which Cycles blurs them."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from mathutils import Matrix  # noqa: E402

from blender_addon import compat  # noqa: E402
from spectral_core.volume.files.formats.openvdb_format import find_openvdb  # noqa: E402


def translated():
    from blender_addon.translate.scene import translate_scene

    return translate_scene(bpy.context.evaluated_depsgraph_get())


@pytest.mark.skipif(find_openvdb() is None, reason="no OpenVDB module here")
def test_a_grid_of_velocities_is_named_where_the_motion_would_be_blurred(blender, ramp, tmp_path):
    openvdb = find_openvdb()
    bpy.ops.spectral.volume_import(filepath=str(ramp[0]))
    data = bpy.context.object.data
    first = openvdb.read(bpy.path.abspath(data.filepath), data.spectral.grid)
    second = openvdb.Vec3SGrid((0.0, 0.0, 0.0))
    second.copyFromArray(np.full((6, 5, 4, 3), 2.0, np.float32))
    second.name, second.transform = "velocity", first.transform
    openvdb.write(str(tmp_path / "moving.vdb"), grids=[first, second])
    data.filepath = str(tmp_path / "moving.vdb")

    def is_named():
        return any("its grid 'velocity' gives no motion blur" in note.message for note in translated().notes)

    assert not is_named()
    bpy.context.scene.render.use_motion_blur = True
    assert is_named()
    data.velocity_scale = 0.0
    assert not is_named()


def in_motion(position="CENTER"):
    """The scene with its moments; the shutter is open for a whole frame, in frame 1."""
    from blender_addon.translate.camera.motion import with_motion
    from blender_addon.translate.scene import translate_scene

    scene = bpy.context.scene
    scene.render.use_motion_blur, scene.render.motion_blur_shutter = True, 1.0
    scene.render.motion_blur_position = position
    scene.frame_set(1)
    depsgraph = bpy.context.evaluated_depsgraph_get()
    plain = translate_scene(depsgraph, is_moving=True)
    return with_motion(plain, depsgraph, None, lambda frame, part: scene.frame_set(frame, subframe=part))


@pytest.fixture
def volume(blender, ramp):
    """A volume object that turns about z by 0.8 radians per frame and moves along x by one unit, from frame 0 on."""
    bpy.ops.spectral.volume_import(filepath=str(ramp[0]))
    thing = bpy.context.object
    for frame in (0, 2):
        thing.location, thing.rotation_euler = (frame, 3.0, 0.0), (0.0, 0.0, 0.8 * frame)
        for name in ("location", "rotation_euler"):
            thing.keyframe_insert(name, frame=frame)
    for curve in compat.curves_of(thing.animation_data)[0]:
        for point in curve.keyframe_points:
            point.interpolation = "LINEAR"
    return thing


def placed(time):
    """Object to world at a frame."""
    return np.array(Matrix.Translation((time, 3, 0)) @ Matrix.Rotation(0.8 * time, 4, "Z"))


@pytest.mark.parametrize(("position", "first"), [("START", 1.0), ("CENTER", 0.5), ("END", 0.0)])
def test_a_moving_volume_is_blurred(volume, position, first):
    """It was sharp, and where it is in the frame whatever the position of the shutter, without a note."""
    scene = in_motion(position)
    (still,) = scene.volumes
    own = np.linalg.inv(placed(1.0)) @ still.world_from_index
    assert len(scene.moments) == 32
    for number, moment in enumerate(scene.moments):
        (shown,) = scene.at(moment).volumes
        time = first + (number + 0.5) / 32
        np.testing.assert_allclose(shown.world_from_index, placed(time) @ own, atol=0.02)
        assert shown.data is still.data and shown.transfer is still.transfer


def test_a_volume_without_motion_blur_stands_in_the_middle_of_the_time(volume):
    volume.cycles.use_motion_blur = False
    frame = translated().volumes[0].world_from_index
    scene = in_motion("START")
    assert scene.moments == ()
    expected = placed(1.5) @ np.linalg.inv(placed(1.0)) @ frame
    np.testing.assert_allclose(scene.volumes[0].world_from_index, expected, atol=1e-5)

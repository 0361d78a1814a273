# SPDX-License-Identifier: GPL-3.0-or-later
"""Grids of velocities, by which Cycles blurs a moving volume."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

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

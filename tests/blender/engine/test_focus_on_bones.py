# SPDX-License-Identifier: GPL-3.0-or-later
"""A camera that focuses on a bone: the distance is that along the view to the head of the posed bone."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")


@pytest.mark.parametrize(("bone", "distance"), [("tip", 4.0), ("", 7.0), ("gone", 7.0)])
def test_a_camera_focuses_on_a_bone(build, translate, bone, distance):
    build.plane()
    data = bpy.data.armatures.new("Rig")
    rig = bpy.data.objects.new("Rig", data)
    rig.location = (0.0, 0.0, 1.0)
    bpy.context.scene.collection.objects.link(rig)
    bpy.context.view_layer.objects.active = rig
    bpy.ops.object.mode_set(mode="EDIT")
    made = data.edit_bones.new("tip")
    made.head, made.tail = (1.0, 0.0, 2.0), (1.0, 0.0, 3.0)
    bpy.ops.object.mode_set(mode="OBJECT")
    rig.pose.bones["tip"].location = (0.0, 1.0, 0.0)  # along the bone, upward
    camera = build.camera((0, 0, 8))
    dof = camera.data.dof
    dof.use_dof, dof.focus_object, dof.focus_subtarget, dof.aperture_fstop = True, rig, bone, 0.5
    bpy.context.view_layer.update()
    scene = translate()
    np.testing.assert_allclose(scene.camera.focus_distance, distance, rtol=1e-6)
    assert not any("bone" in note.message for note in scene.notes)

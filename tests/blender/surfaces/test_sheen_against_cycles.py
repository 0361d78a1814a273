# SPDX-License-Identifier: GPL-3.0-or-later
"""Sheen seen along its horizon, and about normals that lean away from the viewer, against Cycles."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from tests.blender import cycles  # noqa: E402

TILT = 1.2
"""Angle of the plane to the viewer, in radians."""


@pytest.fixture
def plane(build, tmp_path):
    """``plane(material, tilt, lean)``: what a tilted plane shows of a sun without size; its normal leans further."""

    def made(material, tilt, lean=0.0):
        bpy.ops.mesh.primitive_plane_add(size=200.0)
        bpy.context.object.rotation_euler = (0.0, tilt, 0.0)
        bpy.context.object.data.materials.append(material)
        tree = material.node_tree
        normal = tree.nodes.new("ShaderNodeCombineXYZ")
        normal.inputs["X"].default_value, normal.inputs["Z"].default_value = np.sin(tilt + lean), np.cos(tilt + lean)
        if lean:
            tree.links.new(normal.outputs[0], tree.nodes["shader"].inputs["Normal"])
        light = bpy.data.lights.new("Sun", "SUN")
        light.energy, light.angle = 3.0, 0.0
        sun = bpy.data.objects.new("Sun", light)
        sun.rotation_euler = (0.0, 0.7, 0.0)
        bpy.context.scene.collection.objects.link(sun)
        camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
        camera.data.type, camera.data.ortho_scale, camera.location = "ORTHO", 1.0, (0.0, 0.0, 50.0)
        bpy.context.scene.collection.objects.link(camera)
        bpy.context.scene.camera = camera
        bpy.context.scene.world = None
        cycles.settings(samples=4, size=4)
        theirs, (ours, notes) = cycles.cycles(tmp_path), cycles.ours(4)
        assert notes == []
        return theirs.mean(), ours.mean()

    return made


@pytest.mark.parametrize("roughness", [0.2, 0.5, 1.0])
@pytest.mark.parametrize("tilt", [1.2, 1.53, 1.55])
def test_sheen_along_its_horizon(build, plane, tilt, roughness):
    material = build.material(shader="ShaderNodeBsdfSheen", Roughness=roughness)
    theirs, ours = plane(material, tilt)
    assert ours == pytest.approx(theirs, rel=0.02, abs=1e-4)


@pytest.mark.parametrize("lean", [0.2, 0.5, 0.7])
@pytest.mark.parametrize("kind", ["MICROFIBER", "ASHIKHMIN", "Principled"])
def test_normals_that_lean_away_from_the_viewer(build, plane, kind, lean):
    if kind == "Principled":
        material = build.material(shader="ShaderNodeBsdfPrincipled", **{"Sheen Weight": 1.0, "Specular IOR Level": 0.0})
    else:
        material = build.material(shader="ShaderNodeBsdfSheen", Roughness=0.5)
        material.node_tree.nodes["shader"].distribution = kind
    theirs, ours = plane(material, TILT, lean)
    assert ours == pytest.approx(theirs, rel=0.02, abs=1e-4)

# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes a thousand units from the origin, and of a few millimeters, against Cycles."""

from __future__ import annotations

import numpy as np
import pytest

from ..cycles import cycles, ours, settings

bpy = pytest.importorskip("bpy")


def _cube(build, name, size, location, material):
    half = size / 2
    corners = [(x, y, z) for x in (-half, half) for y in (-half, half) for z in (-half, half)]
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    made = build.mesh(name, corners, faces, material)
    made.location = location
    return made


def _striped(build, place, size):
    """Checks of a quarter of a unit by the Geometry node's Position, darkened by Ambient Occlusion."""
    from blender_addon import compat

    made = build.material("Striped")
    tree = compat.use_nodes(made)
    nodes = {name: tree.nodes.new(f"ShaderNode{name}") for name in ("NewGeometry", "TexChecker", "AmbientOcclusion")}
    away = tree.nodes.new("ShaderNodeVectorMath")
    away.operation, away.inputs[1].default_value = "SUBTRACT", place
    nodes["TexChecker"].inputs["Scale"].default_value = 4.0 / size
    nodes["TexChecker"].inputs["Color2"].default_value = (0.3, 0.5, 0.7, 1)
    nodes["AmbientOcclusion"].inputs["Distance"].default_value = 0.6 * size
    tree.links.new(nodes["NewGeometry"].outputs["Position"], away.inputs[0])
    tree.links.new(away.outputs[0], nodes["TexChecker"].inputs["Vector"])
    tree.links.new(nodes["TexChecker"].outputs["Color"], nodes["AmbientOcclusion"].inputs["Color"])
    tree.links.new(nodes["AmbientOcclusion"].outputs["Color"], tree.nodes["shader"].inputs["Color"])
    return made


@pytest.mark.parametrize(
    ("place", "size"), [((1000.0, -2000.0, 300.0), 1.0), ((30000.0, 0.0, 0.0), 1.0), ((0.0, 0.0, 0.0), 0.002)]
)
def test_contact_shadows_and_textures_are_those_of_cycles(build, tmp_path, place, size):
    settings(samples=256, size=24)
    bpy.context.scene.cycles.max_bounces = 4
    floor = build.plane(
        size=6 * size, material=_striped(build, (place[0] + 0.03 * size, place[1], place[2] + 0.1), size)
    )
    floor.location = place
    _cube(build, "Block", size, (place[0], place[1], place[2] + 0.5 * size), build.material(Color=(0.7, 0.4, 0.2, 1)))
    build.light("AREA", 60 * size**2, (place[0] + size, place[1] - size, place[2] + 3 * size), size=0.8 * size)
    camera = build.camera((place[0] - 1.5 * size, place[1] - 4 * size, place[2] + 3 * size), clip_start=0.1 * size)
    camera.rotation_euler = (0.95, 0, -0.35)
    bpy.context.view_layer.update()
    expected = cycles(tmp_path).astype(np.float64)
    found, notes = ours(samples=256)
    assert not any("32-bit" in note for note in notes)
    blocks = [picture.reshape(6, 4, 6, 4, 3).mean((1, 3)) for picture in (expected, found)]
    assert expected.mean() > 0.05
    np.testing.assert_allclose(blocks[1], blocks[0], rtol=0.06, atol=0.02 * expected.mean())

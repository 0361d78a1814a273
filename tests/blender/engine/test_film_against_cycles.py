# SPDX-License-Identifier: GPL-3.0-or-later
"""The pixel filter: edges are as soft as in Cycles, pixel by pixel."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("bpy")
pytest.importorskip("mitsuba", reason="needs Mitsuba: pip install 'spectral-scene[render]'")


@pytest.mark.parametrize(
    ("kind", "size"),
    [("BLACKMAN_HARRIS", 1.5), ("BLACKMAN_HARRIS", 0.6), ("GAUSSIAN", 1.5), ("GAUSSIAN", 2.5), ("BOX", 3)],
)
def test_edges_are_as_soft_as_in_cycles(build, tmp_path, kind, size):
    import bpy

    from tests.blender import cycles

    camera = build.camera()
    camera.location, camera.rotation_euler = (0.0, 0.0, 5.0), (0.0, 0.0, 0.0)
    data = bpy.data.meshes.new("Slanted")
    data.from_pydata([(-0.9, -0.7, 0), (0.8, -0.9, 0), (0.9, 0.6, 0), (-0.6, 0.9, 0)], [], [(0, 1, 2, 3)])
    material = bpy.data.materials.new("White light")
    from blender_addon import compat

    tree = compat.use_nodes(material)
    emission = tree.nodes.new("ShaderNodeEmission")
    output = next(node for node in tree.nodes if node.type == "OUTPUT_MATERIAL")
    tree.links.new(emission.outputs[0], output.inputs["Surface"])
    data.materials.append(material)
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("Slanted", data))
    cycles.settings(samples=256, size=20)
    bpy.context.scene.cycles.pixel_filter_type = kind
    bpy.context.scene.cycles.filter_width = size
    theirs, (mine, _) = cycles.cycles(tmp_path), cycles.ours(samples=256)
    edge = (theirs[..., 1] > 0.02) & (theirs[..., 1] < 0.98)
    assert edge.sum() > 15
    # Noise of 256 samples is below 0.01; a filter of half the width is off by 0.1.
    assert np.sqrt(np.mean((mine - theirs)[edge] ** 2)) < 0.02


def test_a_filter_size_of_cycles_that_is_not_the_default_is_used(build):
    import bpy

    from blender_addon.translate.camera import pixel_filter_of

    scene = bpy.context.scene
    scene.render.filter_size = 0.7
    assert pixel_filter_of(scene) == {"filter_kind": "blackman_harris", "filter_width": pytest.approx(1.4)}
    scene.cycles.filter_width = 2.0
    assert pixel_filter_of(scene) == {"filter_kind": "blackman_harris", "filter_width": pytest.approx(4.0)}

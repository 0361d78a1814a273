# SPDX-License-Identifier: GPL-3.0-or-later
"""Holdouts that are added to other shaders: a hole for the camera, the other shader for other rays, as in Cycles."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from spectral_core.scene import Holdout, MixSurface  # noqa: E402
from tests.blender import cycles  # noqa: E402


def _added(build, first, second="Holdout", **inputs):
    """A material that is the sum of two shaders."""
    material = build.material(shader=f"ShaderNode{first}", **inputs)
    tree = material.node_tree
    sum_, hole = tree.nodes.new("ShaderNodeAddShader"), tree.nodes.new(f"ShaderNode{second}")
    output = next(node for node in tree.nodes if node.type == "OUTPUT_MATERIAL")
    for socket, shader in zip(sum_.inputs, (tree.nodes["shader"], hole), strict=True):
        tree.links.new(shader.outputs[0], socket)
    tree.links.new(sum_.outputs[0], output.inputs["Surface"])
    return material


CASES = {
    "clear": ("BsdfTransparent", {}),
    "clear in part": ("BsdfPrincipled", {"Alpha": 0.5}),
    "glow": ("Emission", {}),
}


def test_a_sum_with_a_whole_holdout_is_a_hole(build, tmp_path):
    """Behind the hole nothing shows, and its alpha is 0; what is clear showed the things behind, at an alpha of -1."""
    cycles.settings(4, 12)
    scene = bpy.context.scene
    for number, (shader, inputs) in enumerate(CASES.values()):
        build.plane(shader, size=0.6, material=_added(build, shader, **inputs)).location = (number - 1.0, 0.0, 0.5)
    build.plane("Behind", size=4, material=build.material("Lit", shader="ShaderNodeEmission"))
    data = build.camera((0, 0, 5)).data
    data.type, data.ortho_scale = "ORTHO", 3.0
    scene.cycles.pixel_filter_type, scene.cycles.filter_width = "GAUSSIAN", 0.01
    expected = cycles.cycles(tmp_path)
    found, notes = cycles.ours(4)
    assert notes == [] and (expected[6, [2, 6, 10]] == 0).all() and (expected[1] > 0.9).all()
    np.testing.assert_allclose(found, expected, atol=1e-4)


def test_only_whole_holdouts_in_sums_end_a_path(surface, build):
    found, _ = surface(_added(build, "BsdfDiffuse"))
    assert isinstance(found, MixSurface) and isinstance(found.second, Holdout)
    for first, second in (("BsdfDiffuse", "BsdfTransparent"), ("Holdout", "Holdout")):
        assert not isinstance(surface(_added(build, first, second))[0], MixSurface)

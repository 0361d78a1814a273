# SPDX-License-Identifier: GPL-3.0-or-later
"""Cameras with settings that are rare: parents that shear them, and ends of their clipping that are close."""

from __future__ import annotations

import numpy as np
import pytest

from spectral_core.errors import InvalidInputError

bpy = pytest.importorskip("bpy")


@pytest.mark.parametrize(
    ("scale", "turn", "tells"),
    [((1, 1, 1.2), (0, 0, 0), True), ((1.5, 1, 1), (0, 0.2, 0.3), True), ((1.3, 1.3, 1.3), (0.4, 0, 0.3), False),
     ((-1, -1, -1), (0.4, 0, 0), False), ((1, 1, 1), (0.4, 0.5, 0.3), False)],
)  # fmt: skip
def test_a_camera_under_a_stretched_parent_has_a_note(build, translate, scale, turn, tells):
    build.plane()
    camera = build.camera()
    camera.rotation_euler = (1.1, 0.0, 0.3)
    rig = bpy.data.objects.new("Rig", None)
    bpy.context.scene.collection.objects.link(rig)
    rig.scale, rig.rotation_euler, camera.parent = scale, turn, rig
    told = [note.subject for note in translate().notes if "shear" in note.message]
    assert told == ([camera.name] if tells else [])


@pytest.mark.parametrize(
    ("scale", "tells"),
    [((0, 0, 0), True), ((0, 1, 1), True), ((1, 1, 0), True), ((1, -1, 1), False), ((1e-3, 1e-3, 1e-3), False)],
)  # fmt: skip
def test_a_camera_of_scale_0_has_a_note(build, translate, scale, tells):
    build.plane()
    camera = build.camera()
    camera.rotation_euler, camera.scale = (1.1, 0.0, 0.3), scale
    told = [note.subject for note in translate().notes if "scale is 0" in note.message]
    assert told == ([camera.name] if tells else [])


def test_a_camera_may_clip_close_to_its_start_and_focus_before_it(build, translate):
    lens = build.camera().data
    lens.clip_start, lens.clip_end, lens.dof.use_dof, lens.dof.focus_distance = 5.0, 6.0, True, 3.0
    camera = translate().camera
    assert (camera.near, camera.far, camera.focus_distance) == pytest.approx((5.0, 6.0, 3.0))
    lens.clip_end = 4.0
    camera = translate().camera
    assert camera.near < camera.far == pytest.approx(5.0, rel=1e-5)


def test_an_orthographic_scale_of_0_is_refused_with_what_to_do(build, translate):
    """It does not count for a perspective camera, whose file may keep any number."""
    build.plane()
    lens = build.camera().data
    lens.type, lens.ortho_scale = "ORTHO", -2.0
    with pytest.raises(
        InvalidInputError, match="Orthographic Scale of the camera 'Camera' is 0 .*expected a number above 0"
    ):
        translate()
    lens.type = "PERSP"
    assert translate().camera.kind == "perspective"


@pytest.mark.parametrize("kind", ["EQUIRECTANGULAR", "MIRRORBALL"])
def test_nodes_know_the_space_of_a_panorama(build, tmp_path, kind):
    """It was that of a perspective camera, and the depth had no sign: colors were off by more than their size."""
    from tests.blender import cycles

    material = build.material(shader="ShaderNodeEmission")
    tree = material.node_tree
    added = tree.nodes.new("ShaderNodeVectorMath")
    tree.links.new(tree.nodes.new("ShaderNodeTexCoord").outputs["Camera"], added.inputs[0])
    tree.links.new(tree.nodes.new("ShaderNodeCameraData").outputs["View Z Depth"], added.inputs[1])
    tree.links.new(added.outputs[0], tree.nodes["shader"].inputs["Color"])
    build.plane(size=9.0, material=material).location.z = 0.5
    camera = build.camera((0.3, 0.2, 2.0))
    camera.rotation_euler, camera.data.type = (0.4, 0.2, 0), "PANO"
    owner = camera.data if hasattr(camera.data, "panorama_type") else camera.data.cycles
    owner.panorama_type = kind
    cycles.settings(16, 24)
    theirs, (ours, notes) = cycles.cycles(tmp_path), cycles.ours(16)
    assert np.abs(ours - theirs).mean() < 0.08 * np.abs(theirs).mean()  # edges
    assert not notes

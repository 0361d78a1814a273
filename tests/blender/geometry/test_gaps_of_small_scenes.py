# SPDX-License-Identifier: GPL-3.0-or-later
"""Notes on faces that coincide, in scenes of millimeters and far from the origin."""

from __future__ import annotations

import pytest

bpy = pytest.importorskip("bpy")


@pytest.mark.parametrize(("scale", "away"), [(1e-3, 0.0), (1e-5, 0.0), (1.0, 3000.0)])
def test_a_gap_counts_by_the_size_of_small_and_far_scenes(build, translate, scale, away):
    """A gap of 5 % of the glass had the note that its faces coincide with those below it."""
    build.plane(name="Ground", size=10.0 * scale).location.x = away
    build.camera((away, 0.0, 12.0 * scale), clip_start=1e-6)
    bpy.ops.mesh.primitive_cube_add()
    cube = bpy.context.object
    cube.scale = (scale,) * 3
    cube.data.materials.append(build.material(shader="ShaderNodeBsdfGlass"))
    for gap, tells in ((0.1, False), (0.0, True)):
        cube.location = (away + 0.25 * scale, 0.2 * scale, (1.0 + gap) * scale)
        assert ("coincide with faces of 'Ground'" in " ".join(note.message for note in translate().notes)) is tells

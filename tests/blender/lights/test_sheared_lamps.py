# SPDX-License-Identifier: GPL-3.0-or-later
"""Spots under stretched parents: the light at a point is that of the spot's own space, as in Cycles."""

from __future__ import annotations

import numpy as np
import pytest

from ..cycles import ours, settings

bpy = pytest.importorskip("bpy")

SIZE, WIDTH, FINER = 24, 8.0, 8
POWER, ALBEDO = 1000.0, 0.8
CONE, BLEND = 1.0, 0.8


def _spot(build, scale, turn):
    """A floor that a camera above sees, and a spot below a stretched parent; the spot's matrix."""
    settings(size=SIZE)
    scene = bpy.context.scene
    scene.cycles.max_bounces, scene.cycles.pixel_filter_type, scene.cycles.filter_width = 0, "BOX", 1.0
    build.plane(size=40.0, material=build.material(Color=(ALBEDO, ALBEDO, ALBEDO, 1)))
    build.camera((0, 0, 30), type="ORTHO", ortho_scale=WIDTH)
    lamp = build.light("SPOT", POWER, (0, 0, 0), spot_size=CONE, spot_blend=BLEND, shadow_soft_size=0.0)
    rig = bpy.data.objects.new("Rig", None)
    scene.collection.objects.link(rig)
    rig.location, rig.scale, rig.rotation_euler = (0.3, -0.2, 3), scale, (0.1, 0.2, 0.3)
    lamp.parent, lamp.rotation_euler = rig, turn
    bpy.context.view_layer.update()
    return np.array(lamp.matrix_world)


def _expected(matrix):
    """Radiance of the floor: the cone is that of the direction in the space of the spot."""
    middle = (np.arange(SIZE * FINER) + 0.5) / (SIZE * FINER) * WIDTH - WIDTH / 2
    x, y = np.meshgrid(middle, middle)
    way = np.stack([x - matrix[0, 3], y - matrix[1, 3], np.full_like(x, -matrix[2, 3])], axis=-1)
    distance = np.linalg.norm(way, axis=-1)
    own = way @ np.linalg.inv(matrix[:3, :3]).T
    cosine, edge = -own[..., 2] / np.linalg.norm(own, axis=-1), np.cos(CONE / 2)
    step = np.clip((cosine - edge) / ((1 - edge) * BLEND), 0, 1)
    irradiance = POWER / (4 * np.pi) * step**2 * (3 - 2 * step) * matrix[2, 3] / distance**3
    return (irradiance * ALBEDO / np.pi).reshape(SIZE, FINER, SIZE, FINER).mean((1, 3))


@pytest.mark.parametrize(
    ("scale", "turn"),
    [((1, 1, 1), (0.3, 0.2, 0)), ((1, 1, 1.6), (0.6, 0.3, 0.2)), ((1.6, 0.8, 1), (0.4, 0.5, 1.0)),
     ((1, -1.3, 0.8), (-0.4, 0.4, 2.0))],
)  # fmt: skip
def test_a_spot_under_a_stretched_parent_has_the_cone_of_its_own_space(build, scale, turn):
    expected = _expected(_spot(build, scale, turn))
    found, _ = ours()
    assert expected.max() > 0.5 and (expected == 0).any()
    np.testing.assert_allclose(found[..., 0], expected, rtol=0.02, atol=0.005 * expected.max())


@pytest.mark.parametrize(("cone", "is_told"), [(0.5, False), (2.2, True)])
def test_a_cone_that_cycles_cuts_off_has_a_note(build, translate, cone, is_told):
    _spot(build, (2, 1, 1), (0, 0.6, 0))
    bpy.data.lights[0].spot_size = cone
    told = [note.message for note in translate().notes if "shear" in note.message]
    assert bool(told) == is_told, told

# SPDX-License-Identifier: GPL-3.0-or-later
"""Radii of hair curves, by attributes of any domain and type, or by none.

The expected radii were measured in pictures of Cycles (Blender 4.3, 5.0 and 5.2): the width of strands that emit light.
"""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

IN_CYCLES = {
    "none": (None, None, None, (), 0.005),
    "points": ("FLOAT", "POINT", "value", [0.1], 0.1),
    "curves": ("FLOAT", "CURVE", "value", [0.1], 0.1),
    "vector": ("FLOAT_VECTOR", "POINT", "vector", [0.3, 0.0, 0.0], 0.1),
    "pair": ("FLOAT2", "POINT", "vector", [0.2, 0.0], 0.1),
    "color": ("FLOAT_COLOR", "POINT", "color", [0.3, 0.0, 0.0, 1.0], 0.0638),
    "bytes of curves": ("BYTE_COLOR", "CURVE", "color", [1.0, 0.0, 0.0, 0.0], 0.2126),
    "whole": ("INT", "POINT", "value", [1], 1.0),
    "rotation": ("QUATERNION", "POINT", "value", [0.5, 0.5, 0.5, 0.5], 0.005),
}


def _hair(build, kind, domain, field, value):
    curves = bpy.data.hair_curves.new("Hair")
    curves.add_curves([4, 3])
    points = np.array([[0, 0, z] for z in range(4)] + [[9, 0, z] for z in range(3)], np.float32)
    curves.attributes["position"].data.foreach_set("vector", points.ravel())
    made = None if kind is None else curves.attributes.new("radius", kind, domain)
    if made is not None:
        values = np.tile(np.array(value, np.int32 if kind == "INT" else np.float32), len(made.data))
        made.data.foreach_set(field, values)
    build.object("Hair", curves)
    return kind is None or made is not None


def _mean_radius(positions, at):
    """Radius of the circle with the mean width of a tube's cross-section: its perimeter over 2π."""
    ring = positions[np.abs(positions[:, 2] - at) < 1e-6].astype(float)
    angle = np.arctan2(*(ring - ring.mean(axis=0))[:, 1::-1].T)
    around = ring[np.argsort(angle)]
    return float(np.linalg.norm(around - np.roll(around, 1, axis=0), axis=1).sum() / (2 * np.pi))


@pytest.mark.parametrize("name", IN_CYCLES)
def test_strands_are_as_thick_as_in_cycles(build, translate, name):
    *attribute, expected = IN_CYCLES[name]
    if not _hair(build, *attribute):
        pytest.skip("this Blender stores radii as numbers of points alone")
    scene = translate()
    (mesh,) = scene.meshes
    for x, end in ((0, 3), (9, 2)):
        strand = mesh.positions[np.abs(mesh.positions[:, 0] - x) < 4]
        assert [_mean_radius(strand, z) for z in (0, 1, end)] == pytest.approx([expected] * 3, rel=0.005)
    assert all("open at their ends" in note.message for note in scene.notes)


def test_infinite_radii_of_curves_leave_out_their_strands(build, translate):
    if not _hair(build, "FLOAT", "CURVE", "value", [0.1]):
        pytest.skip("this Blender stores radii as numbers of points alone")
    bpy.data.hair_curves["Hair"].attributes["radius"].data[1].value = float("inf")
    scene = translate()
    assert scene.meshes[0].positions[:, 0].max() < 1
    assert any("3 of its points" in note.message for note in scene.notes)


@pytest.mark.parametrize(
    ("radii", "tells"), [([0.1] * 7, True), ([0.1, 0.1, 0.1, 0.0, 0.1, 0.1, 0.0], False), ([0.01] * 7, False)]
)
def test_wide_ends_of_strands_get_a_note(build, translate, radii, tells):
    """The ends of tubes are open; Cycles closes them."""
    assert _hair(build, "FLOAT", "POINT", "value", [0.1])
    attribute = bpy.data.hair_curves["Hair"].attributes["radius"]
    attribute.data.foreach_set("value", np.array(radii, np.float32))
    assert any("open at their ends" in note.message for note in translate().notes) is tells

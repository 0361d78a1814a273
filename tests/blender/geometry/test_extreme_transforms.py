# SPDX-License-Identifier: GPL-3.0-or-later
"""Lamps of scale 0 or of a tiny one, lenses of a tiny angle, and hair with points that are nowhere."""

from __future__ import annotations

import math

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")


@pytest.mark.parametrize(
    ("kind", "scale", "emits"),
    [("SUN", (0, 0, 0), False), ("SUN", (2, 3, 0), False), ("SUN", (0, 0, 1), True), ("AREA", (1, 1, 0), False),
     ("SPOT", (0, 0, 0), False), ("SPOT", (1, 1, 0), True), ("POINT", (0, 0, 0), True)],
)  # fmt: skip
def test_a_lamp_without_a_direction_emits_nothing_as_in_cycles(build, translate, kind, scale, emits):
    build.light(kind).scale = scale
    scene = translate()
    assert bool(scene.lights) == emits
    assert any("without a direction" in note.message for note in scene.notes) != emits


def test_a_lamp_of_tiny_scale_keeps_its_direction(build, translate):
    lamp = build.light("SUN")
    lamp.rotation_euler = (0.7, 0.2, 0.4)
    full = translate().lights[0].world_from_light
    lamp.scale = (1e-13, 1e-13, 1e-13)
    np.testing.assert_allclose(translate().lights[0].world_from_light, full, atol=1e-6)


@pytest.mark.parametrize(("lens", "sensor"), [(5000, 1.5), (2e5, 36)])
def test_a_long_lens_keeps_its_angle(build, translate, lens, sensor):
    build.camera().data.lens = lens
    bpy.context.scene.camera.data.sensor_width = sensor
    expected = 2 * math.atan(sensor / (2 * lens))
    assert translate().camera.field_of_view_rad == pytest.approx(expected, rel=1e-5)


@pytest.mark.parametrize("bad", [math.nan, math.inf])
@pytest.mark.parametrize(("where", "name"), [("position", "vector"), ("radius", "value")])
def test_points_of_hair_that_are_not_finite_are_noted(build, translate, where, name, bad):
    """They and the parts around them were left out without a word; another strand is whole."""
    curves = bpy.data.hair_curves.new("Curves")
    curves.add_curves([3, 3])
    points = np.array([[x, 0, z] for x in (0, 5) for z in range(3)], np.float32)
    curves.attributes["position"].data.foreach_set("vector", points.ravel())
    radii = curves.attributes.get("radius") or curves.attributes.new("radius", "FLOAT", "POINT")
    radii.data.foreach_set("value", np.full(6, 0.01, np.float32))
    curves.materials.append(build.material())
    build.object("Curves", curves)
    assert not translate().notes
    numbers = np.array(points if where == "position" else np.full(6, 0.01), np.float32)
    numbers[1] = bad
    curves.attributes[where].data.foreach_set(name, numbers.ravel())  # a single value of infinity is limited by Blender
    scene = translate()
    (note,) = scene.notes
    assert note.subject == "Curves" and note.message.startswith("1 of its points has a position or radius that is not")
    (mesh,) = scene.meshes
    shown = mesh.positions[np.unique(mesh.triangles)]
    assert np.isfinite(shown).all()
    assert np.ptp(shown[shown[:, 0] > 2.5][:, 2]) == pytest.approx(2, abs=0.05)

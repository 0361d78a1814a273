# SPDX-License-Identifier: GPL-3.0-or-later
"""Matrices of placed objects against NumPy, singular and mirroring ones too."""

from __future__ import annotations

import numpy as np
import pytest

from spectral_core.render.mitsuba_scene.geometry import Part, transformed
from spectral_core.render.plugins.paints.tables import _inverse
from spectral_core.render.plugins.placing import cofactors, crossed, is_regular


def test_cofactors_and_determinant_are_those_of_numpy(rng):
    for _ in range(50):
        matrix = rng.normal(size=(3, 3)) * 10 ** rng.uniform(-3, 3)
        found, determinant = cofactors(matrix)
        assert determinant == pytest.approx(np.linalg.det(matrix), rel=1e-9)
        np.testing.assert_allclose(found, np.linalg.inv(matrix).T * determinant, rtol=1e-7)
    flat = np.diag([2.0, 3.0, 0.0])
    np.testing.assert_array_equal(cofactors(flat)[0], np.diag([0.0, 0.0, 6.0]))
    first, second = rng.normal(size=(2, 20, 3))
    np.testing.assert_allclose(crossed(first, second), np.cross(first, second), rtol=1e-12, atol=1e-14)


def test_only_matrices_far_from_singular_skip_the_closer_look():
    assert is_regular(np.diag([1e-4, 5.0, -1e4]))
    assert not is_regular(np.diag([1.0, 1.0, 0.0])) and not is_regular(np.zeros((3, 3)))
    sheared = np.eye(3)
    sheared[0, 1] = 1e8
    assert not is_regular(sheared)


@pytest.mark.parametrize("third", [1.0, 0.0])
def test_inverse_of_a_placement(rng, third):
    matrix = np.eye(4)
    matrix[:3] = rng.normal(size=(3, 4))
    matrix[:3, 2] *= third
    np.testing.assert_allclose(_inverse(matrix), np.linalg.pinv(matrix), atol=1e-8)


def test_normals_of_a_mirrored_and_sheared_part_stay_perpendicular(rng):
    corners, mirror = rng.normal(size=(3, 3)), np.diag([-1.0, 2.0, 0.5]) + np.triu(rng.normal(size=(3, 3)), 1)
    normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    normals = np.tile(normal / np.linalg.norm(normal), (3, 1))
    matrix = np.eye(4)
    matrix[:3, :3] = mirror
    part = Part("p", corners.astype(np.float32), np.array([[0, 1, 2]], np.uint32), normals.astype(np.float32), None)
    placed = transformed(part, matrix)
    a, b, c = placed.positions[placed.triangles[0]].astype(float)
    front = np.cross(b - a, c - a)
    np.testing.assert_allclose(placed.normals[0], front / np.linalg.norm(front), atol=1e-5)

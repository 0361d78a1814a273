# SPDX-License-Identifier: GPL-3.0-or-later
"""Shading programs at the hit: numbers equal those of NumPy, spectra equal those of the library."""

from __future__ import annotations

import numpy as np
import pytest

from spectral_core.scene import Computed, Diffuse, Film, PointLight
from spectral_core.scene.shading import Builder
from spectral_core.spectra.upsample import upsampled

from .scenes import lit_plane, matrix

pytest.importorskip("mitsuba", reason="needs Mitsuba: pip install 'spectral-scene[render]'")


def noise_program(scale):
    build = Builder()
    number = build.number
    place = build.add("vector_input", (), "position", 0)
    rest = (0.0, scale, 1.0, 0.5, 2.0, 0.0, 1.0, 0.0)
    return build.program(build.add("noise_color", (place, *map(number, rest)), "FBM", True, "3D"))


def picture(program, transport):
    from spectral_core.render.still import render_scene

    light = PointLight(name="lamp", world_from_light=matrix((0, 0, 1.5)), power_w=100.0)
    surface = Diffuse(Computed(program))
    return render_scene(lit_plane(light, surface=surface, transport=transport, film=Film(6, 6, samples=64)))


def test_upsampling_at_the_hit_equals_that_of_the_palette(rng):
    from spectral_core.render.plugins.paints.upsampling import Upsampling
    from spectral_core.render.variant import activate, choose_backend

    mi = activate(choose_backend("spectral"))
    import drjit as dr

    colors = rng.random((200, 3)) * 0.98 + 0.01
    nm = np.array([420.0, 500.0, 580.0, 660.0])
    found = Upsampling(mi, dr)(tuple(mi.Float(c) for c in colors.T), mi.Spectrum(*map(float, nm)))
    np.testing.assert_allclose(np.array(found).T, upsampled(colors, nm), atol=2e-4)


def test_rgb_and_spectral_transport_agree_on_a_program():
    program = noise_program(3.0)
    rgb, spectral = (picture(program, transport).pixels[..., :3] for transport in ("rgb", "spectral"))
    assert np.isfinite(rgb).all() and rgb.std() > 0
    np.testing.assert_allclose(spectral.mean((0, 1)), rgb.mean((0, 1)), rtol=0.03)
    points = np.zeros(1)
    mean = program.evaluate(lambda name, shift: (points, points, points))[0]
    # above the center: reflectance / π · power / (4π · 4)
    np.testing.assert_allclose(rgb.mean((0, 1)), mean / np.pi * 100 / (9 * np.pi), rtol=0.1)


def test_cross_products_are_rounded_once():
    """Of parallel vectors: the rounding error of one product is left, as in Cycles."""
    from spectral_core.scene.shading.numpy_backend import NumPy
    from spectral_core.scene.shading.vectors import VECTOR_MATH

    a, b = np.float32(3.7), np.float32(1e6 / 3)
    found = VECTOR_MATH["CROSS_PRODUCT"](NumPy(np.float32), (a, a, a), (b, b, b), None, None)
    left = float(a) * float(b) - float(a * b)
    np.testing.assert_allclose(found, [left] * 3, rtol=1e-6)
    assert left != 0

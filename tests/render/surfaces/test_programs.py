# SPDX-License-Identifier: GPL-3.0-or-later
"""Shading programs at the hit: numbers equal those of NumPy, spectra equal those of the library."""

from __future__ import annotations

import math

import numpy as np
import pytest

from spectral_core.scene import Computed, Diffuse, Film, PointLight
from spectral_core.scene.shading import Builder
from spectral_core.spectra.upsample import upsampled

from ..scenes import lit_plane, matrix

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


HARD = np.array([0.0, 1.0, -1.0, 0.5, -2.0, 3.7, -3.7, 1e-6, 1e-30, 1e6, -1e6, 16777217.0, 1e30, -1e30], np.float32)


def test_remainders_are_those_of_the_c_library():
    """Of every pair of hard numbers, up to quotients of 1e60: exactly, at the hit and in NumPy."""
    from spectral_core.render.plugins.paints.remainder import exact_remainder
    from spectral_core.render.variant import activate, choose_backend
    from spectral_core.scene.shading.arithmetic import MATH
    from spectral_core.scene.shading.numpy_backend import NumPy

    mi = activate(choose_backend("rgb"))
    import drjit as dr

    a, b = (part.ravel() for part in np.meshgrid(HARD, HARD[HARD != 0]))
    truth = np.array([math.fmod(float(x), float(y)) for x, y in zip(a, b, strict=True)])
    np.testing.assert_array_equal(np.array(exact_remainder(mi, dr, mi.Float(a), mi.Float(b))), truth)
    np.testing.assert_array_equal(MATH["MODULO"](NumPy(np.float32), a, b, None), truth)
    assert MATH["MODULO"](NumPy(np.float32), np.float32(3), np.float32(0), None) == 0


def test_hard_numbers_of_math_nodes_are_cycles():
    """Values that Cycles 5.0.1 renders; each was another number here."""
    from spectral_core.scene.shading.arithmetic import MATH
    from spectral_core.scene.shading.numpy_backend import NumPy
    from spectral_core.scene.shading.vectors import VECTOR_MATH

    xp = NumPy(np.float32)
    number = xp.number
    for mode, a, b, wanted in (
        ("FLOORED_MODULO", 1e6, -3.7, -2.7128875),
        ("FLOORED_MODULO", 1e6, 1e-6, 0.0066207619),
        ("FLOORED_MODULO", 1e30, 3.7, 3.3513537e20),
        ("ARCTAN2", -0.0, -0.0, 0.0),
        ("POWER", -1.0, 1e30, 0.0),
    ):
        found = MATH[mode](xp, number([a]), number([b]), None)
        np.testing.assert_allclose(found, wanted, rtol=1e-6, err_msg=mode)
    one, other = (number([1e6]),) * 3, (number([3.7]),) * 3
    np.testing.assert_allclose(VECTOR_MATH["MODULO"](xp, one, other, None, None), 0.9871125, rtol=1e-6)
    with np.errstate(over="ignore"):
        found = VECTOR_MATH["REFLECT"](xp, other, (number([1e30]),) * 3, None, None)
    np.testing.assert_array_equal(found, other)  # a normal whose length overflows is none

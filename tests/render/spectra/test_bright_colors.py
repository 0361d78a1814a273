# SPDX-License-Identifier: GPL-3.0-or-later
"""Surfaces that reflect more than arrives, as materials of real files do; the share of light at bent normals."""

from __future__ import annotations

import numpy as np
import pytest

from spectral_core.render import render_scene
from spectral_core.scene import Computed, Diffuse, RenderSettings, World, gray
from spectral_core.scene.shading import Builder

from ..scenes import lit_plane

pytest.importorskip("mitsuba")


def _computed(value):
    """A color that a program computes, so that it is no constant of the scene."""
    builder = Builder()
    zero = builder.add("vector_math", (builder.add("vector_input", (), "position", 0), *(builder.number(0.0),) * 3),
                       "MULTIPLY")  # fmt: skip
    added = builder.add("vector_math", (zero, builder.number((value,) * 3), *(builder.number(0.0),) * 2), "ADD")
    return Computed(builder.program(added))


@pytest.mark.parametrize("transport", ["rgb", "spectral"])
@pytest.mark.parametrize("paint", [gray(1.5), _computed(1.5)], ids=["constant", "computed"])
def test_a_color_above_1_reflects_more_than_arrives(transport, paint):
    settings = RenderSettings(transport=transport, max_bounces=2)
    scene = lit_plane(surface=Diffuse(paint), world=World(color=gray(1.0)), settings=settings)
    result = render_scene(scene)
    np.testing.assert_allclose(result.pixels[..., :3].mean((0, 1)), 1.5, rtol=0.01)
    assert not [note for note in result.notes if "outside 0 to 1" in note.message]


def test_a_rough_color_above_1_reflects_no_more_than_its_share():
    """What facets reflect to each other is that of white, as in Cycles; it grew without limit, 20-fold for 5."""
    settings = RenderSettings(transport="rgb", max_bounces=2)
    scene = lit_plane(surface=Diffuse(gray(5.0), 1.0), world=World(color=gray(1.0)), settings=settings)
    np.testing.assert_allclose(render_scene(scene).pixels[..., :3].mean((0, 1)), 5.0, rtol=0.02)


def test_bent_diffuse_light_fades_as_in_cycles():
    from spectral_core.render.plugins.closures.facets.upright import softening
    from spectral_core.render.variant import activate, choose_backend

    mi = activate(choose_backend("rgb"))
    import drjit as dr

    # shares that Cycles 5.0 renders: the angle of the bent normal and of the light to the smooth one, in degrees
    cases = [(20, 85, 0.7198), (50, 60, 0.8937), (75, 30, 0.9282), (75, 85, 0.1603), (20, -60, 0.9879),
             (100, 30, 0.0), (140, 60, 0.0)]  # fmt: skip
    bent, light = np.radians([case[0] for case in cases]), np.radians([case[1] for case in cases])
    cosines = (np.cos(light), np.cos(light - bent), np.cos(bent))
    found = softening(dr, *(mi.Float(np.array(c, np.float32)) for c in cosines))
    np.testing.assert_allclose(np.array(found), [case[2] for case in cases], atol=2e-4)


@pytest.mark.parametrize("mode", ["EXPONENT", "SINH", "COSH"])
def test_exponentials_overflow_as_in_cycles_and_pictures_stay_finite(mode):
    builder = Builder()
    zero = builder.number(0.0)
    huge = builder.add("math", (builder.add("number_input", (), "huge", 0), zero, zero), mode)
    with np.errstate(over="ignore"):
        found = builder.program(huge).evaluate(lambda *_: np.array([1.0, 1e6], np.float32), np.float32)
    assert np.isfinite(found[0]) and np.isinf(found[1])
    constant = builder.add("math", (builder.number(1e6), zero, zero), mode)
    color = Computed(builder.program(builder.as_width(builder.add("math", (constant, zero, zero), "ADD"), 3)))
    pixels = render_scene(lit_plane(surface=Diffuse(color), world=World(color=gray(1.0)))).pixels
    assert np.isfinite(pixels).all()

# SPDX-License-Identifier: GPL-3.0-or-later
"""Area lights far larger than their distance to what they light, and far smaller than that."""

from __future__ import annotations

import numpy as np
import pytest

from spectral_core.render.mitsuba_scene.context import Context
from spectral_core.render.mitsuba_scene.light import light_objects
from spectral_core.render.still import render_scene
from spectral_core.render.variant import activate, choose_backend
from spectral_core.scene import AreaLight, Film
from tests.render.scenes import lit_plane, looking_down, matrix

pytest.importorskip("mitsuba", reason="needs Mitsuba: pip install 'spectral-scene[render]'")

RADIANCE = 60.0


def _tilted(angle: float) -> np.ndarray:
    """Three units above the origin, turned about x, so that the lamp's plane rises toward +y or -y."""
    placed = matrix((0, 0, 3))
    cosine, sine = np.cos(angle), np.sin(angle)
    placed[:3, :3] = [[1, 0, 0], [0, cosine, -sine], [0, sine, cosine]]
    return placed


@pytest.mark.parametrize("size", [300.0, 3e4])
def test_a_lamp_much_larger_than_its_distance_counts_once(size):
    """Rays met each of its triangles twice, and more often the larger they were: the surface was twice as bright.

    A wide plane at an angle t to the surface irradiates it by pi L (1 + cos t) / 2.
    """
    angle = 0.5
    lamp = AreaLight(
        name="wide", world_from_light=_tilted(angle), size=(size, size), power_w=np.pi * RADIANCE * size**2
    )
    pixels = render_scene(lit_plane(lamp, camera=looking_down(2.0), film=Film(8, 8, samples=256))).pixels[..., :3]
    assert pixels.mean() == pytest.approx(0.5 * RADIANCE * (1 + np.cos(angle)) / 2, rel=0.03)


@pytest.mark.parametrize("size", [1e-3, 1e-7])
def test_a_lamp_much_smaller_than_its_distance_keeps_its_power(size):
    """The smaller one had a note that it has no area, and emitted no light; it has the intensity power / pi below."""
    lamp = AreaLight(name="small", world_from_light=matrix((0, 0, 3)), size=(size, size), power_w=90.0)
    result = render_scene(lit_plane(lamp, film=Film(8, 8, samples=16)))
    assert result.notes == ()
    assert result.pixels[..., :3].mean() == pytest.approx(0.5 / np.pi * (90.0 / np.pi) / 3**2, rel=0.01)


def test_the_triangles_of_a_small_lamp_in_mitsuba_have_an_area():
    """Their corners were one point in 32 bits, so they were left out; the power is emitted from larger ones."""
    mitsuba = activate(choose_backend("rgb", None))
    lamp = AreaLight(name="small", world_from_light=matrix((2, 0, 3)), size=(1e-9, 0.5), power_w=90.0)
    context = Context(mitsuba, False, None)
    (made,) = light_objects(context, lamp, (np.zeros(3), 5.0))
    area = float(made.entry.surface_area()[0])
    radiance = float(np.ravel(mitsuba.traverse(made.emitter)["radiance.value"])[0])
    assert area > 0 and np.pi * area * radiance == pytest.approx(90.0, rel=0.1) and not context.notes

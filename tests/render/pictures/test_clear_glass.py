# SPDX-License-Identifier: GPL-3.0-or-later
"""Transparent Glass: the picture has the environment that the smooth interface reflects, not the refracted one.

Transparent surfaces cover a transparent film where they are more than light passes.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from spectral_core.scene import (
    Diffuse,
    Film,
    Glass,
    Holdout,
    Instance,
    LightPaths,
    Material,
    MixSurface,
    Transparent,
    World,
    gray,
)
from tests.render.scenes import lit_plane, matrix

pytest.importorskip("mitsuba", reason="needs Mitsuba: pip install 'spectral-scene[render]'")

REFLECTED = ((1.5 - 1) / (1.5 + 1)) ** 2
HALF_HOLDOUT = MixSurface(0.5, Diffuse(gray(0.0)), Holdout())


def shown(transport="rgb", **film):
    from spectral_core.render import render_scene

    scene = lit_plane(surface=Glass(ior=1.5), film=Film(8, 8, samples=512, **film), transport=transport)
    return render_scene(replace(scene, world=World(gray(1.0)))).pixels.mean((0, 1))


@pytest.mark.parametrize("transport", ["rgb", "spectral"])
def test_the_refracted_share_is_not_covered(transport):
    clear = shown(transport, transparent=True, transparent_glass=True)
    np.testing.assert_allclose(clear[3], REFLECTED, rtol=0.1)
    np.testing.assert_allclose(clear[:3], REFLECTED, rtol=0.1)


def test_without_transparent_glass_the_pixel_is_covered():
    np.testing.assert_allclose(shown(transparent=True), 1.0, rtol=0.01)
    np.testing.assert_allclose(shown(transparent_glass=True), 1.0, rtol=0.01)


@pytest.mark.parametrize(("surface", "is_holdout"), [(Diffuse(gray(0.5)), True), (HALF_HOLDOUT, False)])
def test_a_holdout_behind_smooth_glass_is_a_hole(surface, is_holdout):
    """As in Cycles; the plane lies within the glass, so that the refracted share meets it."""
    from spectral_core.render import render_scene

    film = Film(8, 8, samples=512, transparent=True, transparent_glass=True)
    scene = lit_plane(surface=Glass(ior=1.5), film=film, transport="rgb")
    below = Instance("below", scene.instances[0].mesh, matrix((0, 0, -1)), ("below",), is_holdout=is_holdout)
    scene = replace(
        scene,
        materials=(*scene.materials, Material("below", surface)),
        instances=(*scene.instances, below),
        world=World(gray(1.0)),
    )
    shown = render_scene(scene).pixels.mean((0, 1))
    covered = REFLECTED if is_holdout else REFLECTED + 0.5 * (1 - REFLECTED)
    np.testing.assert_allclose(shown[3], covered, rtol=0.1)
    np.testing.assert_allclose(shown[:3], REFLECTED, rtol=0.1)


@pytest.mark.parametrize(("most", "covered"), [(1, 1.0), (2, 0.75)])
def test_transparent_surfaces_beyond_the_limit_cover_the_picture(most, covered):
    """As in Cycles; the world behind them was subtracted from a picture that did not have it."""
    from spectral_core.render import render_scene

    scene = lit_plane(surface=Transparent(gray(0.5)), film=Film(8, 8, samples=4, transparent=True))
    below = Instance("below", scene.instances[0].mesh, matrix((0, 0, -1)), scene.instances[0].materials)
    limits = replace(scene.settings, light_paths=LightPaths(transparent=most))
    scene = replace(scene, instances=(*scene.instances, below), settings=limits, world=World(gray(1.0)))
    np.testing.assert_allclose(render_scene(scene).pixels.mean((0, 1)), (0, 0, 0, covered), atol=1e-4)

# SPDX-License-Identifier: GPL-3.0-or-later
"""Filter Glossy: mirrors stay sharp for the camera, and are blurred for light that was scattered before."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from spectral_core.errors import InvalidInputError
from spectral_core.render import render_scene
from spectral_core.scene import (
    Camera,
    Diffuse,
    Film,
    Glass,
    Glossy,
    Instance,
    LightPaths,
    Material,
    PointLight,
    RenderSettings,
    Scene,
    World,
    gray,
)

from ..scenes import matrix, plane, sphere_mesh

pytest.importorskip("mitsuba")


def test_alpha_follows_the_least_density_of_the_bounces_before():
    from spectral_core.render.plugins.closures.facets import microfacet
    from spectral_core.render.variant import activate, choose_backend

    mi = activate(choose_backend("rgb"))
    import drjit as dr

    si = dr.zeros(mi.SurfaceInteraction3f, 4)
    microfacet.blur(si, mi.Float(2.0), mi.Float(np.array([np.inf, 2.0, 1.0, 0.0], np.float32)))
    np.testing.assert_allclose(np.array(microfacet.least_alpha(si)), [0.0, 0.0, 0.5 * 0.5**0.5, 0.5], rtol=1e-6)


def test_a_negative_strength_is_refused():
    with pytest.raises(InvalidInputError, match="filter_glossy"):
        LightPaths(filter_glossy=-1.0)


def _scene(surface, strength):
    """A ball over a floor under a point lamp, whose caustic the floor would show."""
    lamp = PointLight(name="lamp", world_from_light=matrix((0.6, 0, 3)), power_w=60.0)
    return Scene(
        camera=Camera(world_from_camera=matrix((0, 0, 6.0)), field_of_view_rad=0.6),
        film=Film(16, 16, samples=64),
        meshes=(plane(4.0), sphere_mesh(32)),
        materials=(Material("floor", Diffuse(gray(0.7))), Material("ball", surface)),
        instances=(
            Instance("floor", "plane", np.eye(4), ("floor",)),
            Instance("ball", "sphere", matrix((0, 0, 0.8), 0.6), ("ball",)),
        ),
        lights=(lamp,),
        settings=RenderSettings(transport="rgb", max_bounces=4, light_paths=LightPaths(filter_glossy=strength)),
    )


@pytest.mark.parametrize("surface", [Glossy(gray(0.9), 0.0), Glass(gray(1.0), 0.0, 1.45)], ids=["mirror", "glass"])
def test_a_point_lamp_reaches_the_floor_by_blurred_mirrors_alone(surface):
    """No path can find a point lamp in a perfect mirror; in a blurred one the lamp can be sampled."""
    sharp, soft = (render_scene(_scene(surface, strength)).pixels[..., :3].mean() for strength in (0.0, 1.0))
    assert soft > 1.003 * sharp


def test_the_camera_sees_mirrors_sharp():
    def mirrored(strength):
        scene = _scene(Glossy(gray(1.0), 0.0), strength)
        floor = replace(scene.instances[0], materials=("ball",))
        return replace(scene, instances=(floor,), lights=(), world=World(color=gray(0.5)))

    for strength in (0.0, 1.0):
        np.testing.assert_allclose(render_scene(mirrored(strength)).pixels[..., :3], 0.5, rtol=1e-3)

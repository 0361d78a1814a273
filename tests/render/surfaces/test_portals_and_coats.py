# SPDX-License-Identifier: GPL-3.0-or-later
"""Rays that a portal sends on; coats with a normal of their own; lobes that are stretched beyond alpha 1."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from spectral_core.render import render_scene
from spectral_core.scene import (
    AddSurface,
    Color,
    Computed,
    Diffuse,
    Emission,
    Film,
    Glossy,
    Instance,
    Material,
    MixSurface,
    PointLight,
    Principled,
    RayPortal,
    World,
    gray,
)
from spectral_core.scene.shading import Builder
from tests.render.scenes import lit_plane, matrix, plane

pytest.importorskip("mitsuba", reason="needs Mitsuba: pip install 'spectral-scene[render]'")
BLACK = World(gray(0.0))


def constant(*vector: float) -> Computed:
    builder = Builder()
    return Computed(builder.program(builder.number(vector)))


def far_glow(surface, **rest):
    """The plane of a surface, and far above it an emissive one that only rays from a portal can see."""
    scene = lit_plane(surface=surface, world=BLACK, film=Film(4, 4, samples=64), **rest)
    glow = Material("glow", Emission(Color([0.2, 0.5, 0.9]), 1.0))
    item = Instance("glow", "far", matrix((0, 0, 500.0)), ("glow",))
    far = replace(plane(half=10.0), name="far")
    return replace(
        scene,
        meshes=(*scene.meshes, far),
        materials=(*scene.materials, glow),
        instances=(*scene.instances, item),
    )


@pytest.mark.parametrize("direction", [(0.0, 0.0, 1.0), None])
def test_a_portal_shows_what_lies_elsewhere(direction):
    portal = RayPortal(gray(0.5), constant(0, 0, 499.0 if direction else 501.0), direction and constant(*direction))
    pixels = render_scene(far_glow(portal)).pixels[..., :3]
    np.testing.assert_allclose(pixels.mean((0, 1)), [0.1, 0.25, 0.45], atol=1e-3)


def test_a_portal_in_a_mix_takes_its_share():
    portal = RayPortal(gray(1.0), constant(0, 0, 499.0), constant(0, 0, 1))
    mix = MixSurface(0.25, portal, Diffuse(gray(0.0)))
    found = render_scene(far_glow(mix)).pixels[..., :3].mean((0, 1))
    np.testing.assert_allclose(found, np.array([0.2, 0.5, 0.9]) * 0.75, rtol=0.05)
    other = RayPortal(gray(1.0), constant(0, 0, 499.0), constant(0, 0, -1))  # toward the black plane
    found = render_scene(far_glow(AddSurface(portal, other))).pixels[..., :3].mean((0, 1))
    assert found[2] >= 0.85  # two portals, each with its own exit


def test_without_a_position_rays_go_on_from_their_hit():
    found = render_scene(far_glow(RayPortal(gray(1.0), None, constant(0, 0, 1)))).pixels[..., :3].mean((0, 1))
    np.testing.assert_allclose(found, [0.2, 0.5, 0.9], atol=1e-3)


@pytest.mark.parametrize("transport", ["rgb", "spectral"])
def test_a_coat_reflects_about_its_own_normal(transport):
    """The coat of a black body alone reflects: about its own normal as about that of the whole."""
    lamp = PointLight(name="lamp", world_from_light=matrix((1.5, 0, 2.5)), power_w=100, radius=0.4)
    turned = np.array([np.sin(0.27), 0.0, np.cos(0.27)])
    body = Principled(gray(0.0), specular_level=0.0, roughness=0.4, coat_weight=1.0, coat_roughness=0.2)
    show = lambda surface: (  # noqa: E731
        render_scene(lit_plane(lamp, surface=surface, transport=transport, film=Film(8, 8, samples=256))).pixels[..., 1]
    )
    whole, own = show(replace(body, normal=constant(*turned))), show(replace(body, coat_normal=constant(*turned)))
    plain = show(body)
    assert own.mean() == pytest.approx(whole.mean(), rel=0.03)
    assert own.mean() > 1.5 * plain.mean()


def test_a_stretched_lobe_is_no_rougher_than_alpha_1():
    """Even light shows the energy of one bounce between facets of alpha 1 along one axis; of alpha 36 it is a tenth."""
    stretched = Glossy(gray(1.0), 0.6, anisotropy=0.99, tangent=constant(1, 0, 0))
    pixels = render_scene(lit_plane(surface=stretched, world=World(gray(1.0)), film=Film(4, 4, samples=512))).pixels
    assert pixels[..., 1].mean() == pytest.approx(0.535, abs=0.04)

# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights that are hidden from some rays or linked to some objects, and environments that take light away."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from spectral_core.render import render_scene
from spectral_core.scene import (
    Color,
    Diffuse,
    Film,
    Glossy,
    ImageTexture,
    MixSurface,
    PointLight,
    Principled,
    Rays,
    Subsurface,
    Translucent,
    World,
    gray,
)
from tests.render.scenes import lit_plane, matrix

pytest.importorskip("mitsuba")
LAMP = PointLight(name="lamp", world_from_light=matrix((0.4, 0, 2)), power_w=100)
SHINE = Glossy(gray(0.9), 0.6)


def brightness(scene):
    return render_scene(scene).pixels[..., :3].mean()


@pytest.mark.parametrize(
    ("radius", "hidden", "shown"), [(0.0, Rays.GLOSSY, Diffuse(gray(0.5))), (0.4, Rays.DIFFUSE, SHINE)]
)
def test_of_a_mixture_the_other_closures_stay_lit(radius, hidden, shown):
    """Half of each closure: a lamp that one of them does not see gives half the light of the other alone."""
    lamp = replace(LAMP, radius=radius, hidden_from=hidden)
    both = lit_plane(lamp, surface=MixSurface(0.5, Diffuse(gray(0.5)), SHINE), film=Film(8, 8, samples=512))
    alone = lit_plane(replace(lamp, hidden_from=Rays.NONE), surface=shown, film=Film(8, 8, samples=512))
    assert brightness(both) == pytest.approx(0.5 * brightness(alone), rel=0.03)


def test_light_through_paper_is_diffuse_light():
    """A sky that is hidden from diffuse rays does not shine through; one that is hidden from glossy ones does."""
    sky = World(gray(1.0))
    paper = lit_plane(world=sky, surface=Translucent(gray(0.8)))
    assert brightness(paper) == pytest.approx(0.8, rel=0.02)
    assert brightness(replace(paper, world=replace(sky, hidden_from=Rays.DIFFUSE))) < 1e-3
    assert brightness(replace(paper, world=replace(sky, hidden_from=Rays.GLOSSY))) == pytest.approx(0.8, rel=0.02)


def test_plastic_without_highlight_is_its_diffuse_part():
    """The lamp stands where the surface mirrors it; the diffuse part of the same surface is known without gloss."""
    surface = Principled(base_color=Color([0.6, 0.2, 0.1]), roughness=0.3)
    lamp = replace(LAMP, world_from_light=matrix((0, 0, 2.5)))
    with_gloss = brightness(lit_plane(lamp, surface=surface))
    without = brightness(lit_plane(replace(lamp, hidden_from=Rays.GLOSSY), surface=surface))
    gloss = brightness(lit_plane(replace(lamp, hidden_from=Rays.DIFFUSE), surface=surface))
    assert without + gloss == pytest.approx(with_gloss, rel=0.01)
    matt = brightness(lit_plane(lamp, surface=Diffuse(Color([0.6, 0.2, 0.1]))))
    assert 0.8 * matt < without < matt and gloss > 0.2 * with_gloss


@pytest.mark.parametrize(("model", "radius"), [("random_walk", 0.4), ("burley", 0.0)])
def test_light_leaves_a_surface_from_below_as_diffuse_light(model, radius):
    lamp, skin = replace(LAMP, radius=radius), Subsurface(gray(0.6), (1.0, 1.0, 1.0), 0.05, model=model)
    lit = brightness(lit_plane(lamp, surface=skin))
    assert brightness(lit_plane(replace(lamp, hidden_from=Rays.DIFFUSE), surface=skin)) < 1e-3 * lit
    others = Rays.TRANSMISSION | Rays.GLOSSY | Rays.VOLUME
    assert brightness(lit_plane(replace(lamp, hidden_from=others), surface=skin)) == pytest.approx(lit, rel=0.03)


def test_rays_of_plastic_have_the_type_of_the_part_that_scatters_them():
    """A sky that only one part of a surface sees: the two pictures add up to that of a plain sky, and the matt part is
    that of a surface without gloss.
    """
    surface = Principled(base_color=Color([0.6, 0.6, 0.6]), roughness=0.4)
    sky = World(gray(1.0))

    def under(hidden, of=surface):
        return brightness(lit_plane(world=replace(sky, hidden_from=hidden), surface=of))

    matt, gloss = under(Rays.GLOSSY), under(Rays.DIFFUSE)
    assert matt + gloss == pytest.approx(under(Rays.NONE), rel=0.01)
    assert 0.5 < matt < 0.6 and 0.02 < gloss < 0.1


@pytest.mark.parametrize("how", ["hidden", "linked"])
def test_lights_that_cannot_illuminate_a_surface_add_no_noise(how):
    """A lamp a hundred times as bright, which the plane does not see, is not drawn for it."""
    plain = lit_plane(replace(LAMP, radius=0.3), film=Film(16, 16, samples=16, filter_kind="box", filter_width=1.0))
    bright = replace(LAMP, name="bright", power_w=10_000, world_from_light=matrix((-0.4, 0, 2)), radius=0.3)
    if how == "hidden":
        bright = replace(bright, hidden_from=Rays.DIFFUSE)
        scene = replace(plain, lights=(*plain.lights, bright))
    else:
        placed = tuple(replace(item, unlit_by=("bright",)) for item in plain.instances)
        scene = replace(plain, lights=(*plain.lights, bright), instances=placed)
    alone, among = (render_scene(s).pixels[..., 0] for s in (plain, scene))
    assert among.mean() == pytest.approx(alone.mean(), rel=0.01)
    assert among.std() < 1.5 * alone.std() + 1e-6


@pytest.mark.parametrize("transport", ["rgb", "spectral"])
def test_an_environment_below_zero_takes_light_away(transport):
    """Radiance a toward +x and -b toward -x: the irradiance of a plane is π (a - b) / 2."""
    pixels = np.full((16, 32, 3), 0.6, np.float32)
    pixels[:, :8] = pixels[:, 24:] = -0.2
    scene = lit_plane(world=World(ImageTexture("sky", pixels, "linear")), transport=transport)
    assert brightness(scene) == pytest.approx(0.5 * (0.6 - 0.2) / 2, rel=0.03)

# SPDX-License-Identifier: GPL-3.0-or-later
"""Holdouts: full and partial holes in opaque and transparent films, also of objects that are transparent in part; black
for all other rays.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from spectral_core.render import render_scene
from spectral_core.render.catching import BUT_CAMERA
from spectral_core.scene import (
    AddSurface,
    Diffuse,
    Emission,
    Film,
    Glossy,
    Holdout,
    ImageTexture,
    Material,
    MixSurface,
    Principled,
    Sheen,
    Transparent,
    World,
    gray,
    has_holes,
)
from tests.render.scenes import lit_plane, looking_down, matrix, plane

pytest.importorskip("mitsuba")
FILM = Film(8, 8, samples=64)
SHINING = Emission(gray(1.0), 3.0)


def shown(surface, *, transparent=False, is_holdout=False):
    scene = lit_plane(surface=surface, film=replace(FILM, transparent=transparent), world=World(gray(1.0)))
    if is_holdout:
        scene = replace(scene, instances=(replace(scene.instances[0], is_holdout=True),))
    assert has_holes(scene) == (transparent or is_holdout or not isinstance(surface, Diffuse))
    return render_scene(scene).pixels.mean(axis=(0, 1))


@pytest.mark.parametrize("transparent", [False, True])
def test_a_holdout_makes_a_hole(transparent):
    assert not shown(Holdout(), transparent=transparent).any()
    assert not shown(Diffuse(gray(0.5)), transparent=transparent, is_holdout=True).any()


@pytest.mark.parametrize("transparent", [False, True])
def test_a_mix_with_a_holdout_makes_a_partial_hole(transparent):
    mixed = MixSurface(0.25, Diffuse(gray(0.8)), Holdout())
    assert shown(mixed, transparent=transparent) == pytest.approx([0.6, 0.6, 0.6, 0.75], rel=0.02)


@pytest.mark.parametrize("transparent", [False, True])
@pytest.mark.parametrize(("is_image", "rest"), [(False, Diffuse(gray(0.8))), (True, SHINING)])
def test_a_holdout_object_shows_what_is_behind_its_transparent_parts(is_image, rest, transparent):
    """As a leaf with an alpha image does in Cycles; it cut out its whole card, and hid the shadows on a catcher."""
    opaque = ImageTexture("alpha", np.full((2, 2, 1), 0.25, np.float32), "raw") if is_image else 0.25
    plain = lit_plane(film=replace(FILM, transparent=transparent), world=World(gray(1.0)))
    card = replace(
        plain.instances[0], name="card", mesh="card", materials=("leaf",), world_from_object=matrix((0, 0, 1)),
        is_holdout=True, hidden_from=BUT_CAMERA,
    )  # fmt: skip
    leaf = Material("leaf", MixSurface(opaque, Transparent(), rest))
    behind = replace(
        plain, meshes=(*plain.meshes, plane(9.0, "card")), materials=(*plain.materials, leaf),
        instances=(*plain.instances, card),
    )  # fmt: skip
    expected = 0.75 * render_scene(plain).pixels.mean(axis=(0, 1))
    assert render_scene(behind).pixels.mean(axis=(0, 1)) == pytest.approx(expected, rel=0.02)


@pytest.mark.parametrize("surface", [AddSurface(Holdout(), Holdout()), Transparent(gray(2.0))])
def test_coverage_ends_at_zero(surface):
    """Where more than all shines through; the alpha of such pixels was -1."""
    scene = lit_plane(surface=surface, film=replace(FILM, transparent=True, samples=1), world=World(gray(1.0)))
    assert render_scene(scene).pixels[..., 3] == pytest.approx(0.0, abs=1e-6)


def test_a_mirror_image_of_a_holdout_is_black():
    """A mirror below a holdout shows black at its image, and no hole."""
    scene = lit_plane(surface=Glossy(gray(1.0), 0.0), camera=looking_down(1.0), film=FILM, world=World(gray(1.0)))
    above = replace(
        scene.instances[0], name="above", mesh="above", materials=("hole",), world_from_object=matrix((0, 0, 3))
    )
    scene = replace(
        scene, meshes=(*scene.meshes, plane(9.0, "above")), materials=(*scene.materials, Material("hole", Holdout())),
        instances=(*scene.instances, above),
    )  # fmt: skip
    assert render_scene(scene).pixels.mean(axis=(0, 1)) == pytest.approx([0, 0, 0, 1], abs=1e-3)


def test_a_plain_scene_has_no_holes():
    assert shown(Diffuse(gray(0.5)))[3] == pytest.approx(1.0)


@pytest.mark.parametrize("microfiber", [True, False])
def test_sheen_is_brighter_at_grazing_angles_and_adds_no_energy(microfiber):
    values = []
    for tilt in (0.05, 1.4):
        turn = np.eye(4)
        turn[1:3, 1:3] = [[np.cos(tilt), -np.sin(tilt)], [np.sin(tilt), np.cos(tilt)]]
        scene = lit_plane(surface=Sheen(gray(1.0), 0.5, microfiber), film=FILM, world=World(gray(1.0)))
        tilted = replace(scene.instances[0], world_from_object=turn)
        values.append(render_scene(replace(scene, instances=(tilted,))).pixels[..., :3].mean())
    assert 0 < values[0] < values[1] <= 1.0


def test_sheen_dims_the_emission_below_it():
    bare = Principled(gray(0.0), emission_strength=1.0, specular_level=0.0)
    dark = World(gray(0.0))
    plain = render_scene(lit_plane(surface=bare, film=FILM, world=dark)).pixels[..., 0].mean()
    dusty = replace(bare, sheen_weight=1.0, sheen_roughness=1.0)
    under = render_scene(lit_plane(surface=dusty, film=FILM, world=dark)).pixels[..., 0].mean()
    assert plain == pytest.approx(1.0, abs=0.01) and 0.6 < under < 0.7

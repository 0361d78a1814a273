# SPDX-License-Identifier: GPL-3.0-or-later
"""Normals that reflect the view below the surface are corrected as little as possible; negative colors remove light."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from spectral_core.render import render_scene
from spectral_core.scene import (
    Camera,
    Computed,
    Diffuse,
    Emission,
    Film,
    Glass,
    Glossy,
    Instance,
    Material,
    Principled,
    RenderSettings,
    Scene,
    World,
    gray,
)
from spectral_core.scene.shading import Builder

from ..media.test_medium import box
from ..scenes import lit_plane

pytest.importorskip("mitsuba")


def unit(vectors):
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def test_reflected_views_stay_outside_and_valid_normals_are_unchanged(rng):
    from spectral_core.render.plugins.closures.facets.upright import with_valid_normal
    from spectral_core.render.variant import activate, choose_backend

    mi = activate(choose_backend("rgb"))
    import drjit as dr

    count = 2000
    geometric = unit(rng.normal(size=(count, 3)))
    normal, toward = (unit(rng.normal(size=(count, 3))) for _ in range(2))
    normal *= np.sign((normal * geometric).sum(1, keepdims=True))  # the side of the viewer is random
    si = dr.zeros(mi.SurfaceInteraction3f, count)
    si.n = mi.Normal3f(geometric.T.astype(np.float32))
    si.sh_frame = mi.Frame3f(mi.Vector3f(normal.T.astype(np.float32)))
    si.dn_du = mi.Vector3f(toward.T.astype(np.float32))
    si.wi = si.to_local(si.dn_du)
    found = with_valid_normal(mi, dr, si)
    turned = np.array(found.sh_frame.n).T

    side = np.sign((geometric * toward).sum(1, keepdims=True))
    outer, before = geometric * side, normal * side

    def reflected(n):
        return ((2 * (n * toward).sum(1, keepdims=True) * n - toward) * outer).sum(1)

    least = np.minimum(0.9 * (outer * toward).sum(1), 0.01)
    good = reflected(before) >= least + 1e-4
    bad = reflected(before) < least - 1e-4
    assert good.sum() > 300 and bad.sum() > 300
    np.testing.assert_allclose(turned[good], normal[good], atol=1e-5)
    np.testing.assert_allclose(reflected(turned * side)[bad], least[bad], atol=2e-3)
    np.testing.assert_allclose(np.linalg.norm(turned, axis=1), 1, atol=1e-4)
    # it lies between the geometric normal and the given one
    volume = np.linalg.det(np.stack([outer, before, turned * side], axis=1))
    np.testing.assert_allclose(volume, 0, atol=1e-4)


@pytest.mark.parametrize("surface", [Diffuse(gray(0.8)), Glossy(gray(0.8), 0.5), Principled(gray(0.8))])
def test_a_normal_that_points_away_from_its_face_leaves_the_face_dark(surface):
    """As in Cycles, where faces of one smooth mesh have different windings; the face's own side does not mend it."""
    plain = lit_plane(surface=surface, film=Film(4, 4, 64), world=World(gray(1.0)))
    (mesh,) = plain.meshes
    up = np.tile(np.float32([0, 0, 1]), (len(mesh.positions), 1))
    right, wrong = (
        render_scene(replace(plain, meshes=(replace(mesh, normals=normals),))).pixels[..., :3].mean()
        for normals in (up, -up)
    )
    assert right > 0.01 and wrong < 1e-3 * right


def test_glass_turns_normals_that_would_mirror_the_view_below_it():
    """A smooth-shaded cube of clear glass in a white world: 14 % of the light is lost if its normals stay."""
    cube = box()
    smooth = cube.positions / np.linalg.norm(cube.positions, axis=1, keepdims=True)
    scene = Scene(
        camera=Camera(world_from_camera=seen_from(np.array([3.0, 2.0, 2.5])), field_of_view_rad=0.25),
        film=Film(8, 8, 128),
        meshes=(replace(cube, normals=smooth.astype(np.float32)),),
        materials=(Material("glass", Glass(ior=1.45)),),
        instances=(Instance("cube", "box", np.eye(4), ("glass",)),),
        world=World(gray(1.0)),
        settings=RenderSettings(max_bounces=64),
    )
    assert render_scene(scene).pixels[..., :3].mean() > 0.9


def seen_from(place):
    """Camera at a place that looks at the origin, up along z."""
    back = place / np.linalg.norm(place)
    side = np.cross((0.0, 0.0, 1.0), back)
    side /= np.linalg.norm(side)
    made = np.eye(4)
    made[:3, :3] = np.stack([side, np.cross(back, side), back], axis=1)
    made[:3, 3] = place
    return made


@pytest.mark.parametrize("transport", ["rgb", "spectral"])
def test_a_negative_emitted_color_removes_light(transport):
    build = Builder()
    place = build.add("vector_input", (), "position", 0)
    color = build.add("blend", (build.number(1.0), place, build.number((-0.5, 0.25, -0.5))), "MIX")
    shifted = build.add("vector_math", (color, place, build.number(0.0), build.number(0.0)), "ADD")
    scene = lit_plane(surface=Emission(Computed(build.program(shifted))), transport=transport, film=Film(4, 4, 256))
    found = render_scene(scene).pixels[..., :3].mean((0, 1))
    np.testing.assert_allclose(found, (-0.5, 0.25, -0.5), atol=0.03)

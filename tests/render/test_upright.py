# SPDX-License-Identifier: GPL-3.0-or-later
"""Normals that reflect the view below the surface are corrected as little as possible; negative colors remove light."""

from __future__ import annotations

import numpy as np
import pytest

from spectral_core.render import render_scene
from spectral_core.scene import Computed, Emission, Film
from spectral_core.scene.shading import Builder

from .scenes import lit_plane

pytest.importorskip("mitsuba")


def unit(vectors):
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def test_reflected_views_stay_outside_and_valid_normals_are_unchanged(rng):
    from spectral_core.render.plugins.closures.upright import with_valid_normal
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


@pytest.mark.parametrize("transport", ["rgb", "spectral"])
def test_a_negative_emitted_color_removes_light(transport):
    build = Builder()
    place = build.add("vector_input", (), "position", 0)
    color = build.add("blend", (build.number(1.0), place, build.number((-0.5, 0.25, -0.5))), "MIX")
    shifted = build.add("vector_math", (color, place, build.number(0.0), build.number(0.0)), "ADD")
    scene = lit_plane(surface=Emission(Computed(build.program(shifted))), transport=transport, film=Film(4, 4, 256))
    found = render_scene(scene).pixels[..., :3].mean((0, 1))
    np.testing.assert_allclose(found, (-0.5, 0.25, -0.5), atol=0.03)

# SPDX-License-Identifier: GPL-3.0-or-later
"""The facets of Ashikhmin and Shirley: densities integrate to 1, samples follow them, no energy is added."""

from __future__ import annotations

import numpy as np
import pytest

from spectral_core.render.variant import activate, choose_backend

pytest.importorskip("mitsuba")
SIDE = 1024


def facets(roughness, stretch):
    mi = activate(choose_backend("rgb"))
    import drjit as dr

    from spectral_core.render.plugins.closures.facets.phong import Phong

    size = SIDE * SIDE
    place = dr.arange(mi.UInt32, size)
    u, v = (mi.Float(place % SIDE) + 0.5) / SIDE, (mi.Float(place // SIDE) + 0.5) / SIDE
    return mi, dr, Phong(mi, dr, mi.Float(roughness), stretch), mi.Point2f(u, v)


@pytest.mark.parametrize("stretch", [None, (1.6, 0.5)])
@pytest.mark.parametrize("roughness", [0.4, 0.7, 1.0])
def test_samples_follow_the_density(roughness, stretch):
    mi, dr, model, square = facets(roughness, stretch)
    wi = dr.normalize(mi.Vector3f(0.5, 0.2, 0.8))
    sphere = mi.warp.square_to_uniform_hemisphere(square)
    _, density, _ = model.reflection(wi, sphere)
    wo, _ = model.mirrored(wi, square)
    above = wo.z > 0.0
    # equal moments from the density and from the samples; both exclude directions below the horizon
    for weight in (lambda w: 1.0 + 0.0 * w.x, lambda w: w.x, lambda w: w.y * w.y, lambda w: w.z):
        by_density = float(np.mean(np.array(density * weight(sphere)))) * 2 * np.pi
        by_samples = float(np.mean(np.array(dr.select(above, weight(wo), 0.0))))
        assert by_samples == pytest.approx(by_density, abs=4e-3)


@pytest.mark.parametrize("roughness", [0.05, 0.3, 1.0])
def test_facets_add_no_energy(roughness):
    mi, dr, model, square = facets(roughness, None)
    for z in (1.0, 0.5, 0.05):
        wi = mi.Vector3f(float(np.sqrt(1 - z * z)), 0.0, z)
        wo, _ = model.mirrored(wi, square)
        value, density, _ = model.reflection(wi, wo)
        share = np.array(dr.select(density > 0.0, value / dr.maximum(density, 1e-20), 0.0))
        assert share.mean() <= 1.0 and share.max() <= 1.0 + 1e-5

# SPDX-License-Identifier: GPL-3.0-or-later
"""Rays that a portal sends on from another place, as in Cycles' Ray Portal."""

from __future__ import annotations

from typing import Any

from spectral_core.render.plugins.closures.sharp import PORTAL

NEAR_SQUARED = 1e-9
"""Squared distance up to which the exit of a portal is the point that the ray hits."""


def send_on(tables: Any, hit: tuple[Any, Any, Any], path: Any, sample1: Any, straight: Any) -> None:
    """Move the rays of a path that a portal has drawn; ``hit``: interaction, BSDF and sample, drawn with ``sample1``.

    No light is sampled through a portal, so that what such a ray hits counts in full.
    """
    if not tables.surfaces.flags & PORTAL:
        return
    import drjit as dr
    import mitsuba as mi

    si, bsdf, bs = hit
    moved = straight & ((mi.UInt32(bs.sampled_type) & PORTAL) != 0)
    place = mi.Point3f(bsdf.of_drawn("exit_of", si, sample1, moved))
    ray = tables.at_bounce(si).spawn_ray(si.to_world(bs.wo))
    ray.o = dr.select(dr.squared_norm(place - si.p) > NEAR_SQUARED, place, ray.o)
    path.ray = dr.select(moved, ray, path.ray)
    path.before_delta |= moved

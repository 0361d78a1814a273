# SPDX-License-Identifier: GPL-3.0-or-later
"""Sides of a surface at a hit: methods of the path integrator for hits where geometric and shading normals disagree."""

from __future__ import annotations

from typing import Any

from spectral_core.render.plugins.closures.lobe import RAISED
from spectral_core.render.plugins.closures.strands import FIBER
from spectral_core.render.plugins.terminator import lifts, rounded
from spectral_core.render.trace.lobes import kinds_of
from spectral_core.scene import Rays


def upright(_self: Any, si: Any) -> Any:
    """Direction to the viewer on the geometry's side of the surface, as in Cycles.

    If interpolated normals lean away from the viewer, that direction would lie below the visible surface, and the
    surface would be lit from behind; mirrored at the surface, it keeps its angle and its side.
    """
    import drjit as dr
    import mitsuba as mi

    outside = dr.dot(si.n, si.to_world(si.wi)) > 0.0
    # Compared by sign alone: the angle itself is kept.
    above = (si.wi.z > 0.0) == outside
    return mi.Vector3f(si.wi.x, si.wi.y, dr.select(above | ~si.is_valid(), si.wi.z, -si.wi.z))


def keeps_side(_self: Any, si: Any, wo: Any, outward: Any, bsdf: Any) -> Any:
    """True if a direction leaves on the same side of the geometry as of the shading, so that no light leaks. Reflecting
    lobes and displaced surfaces check the geometry themselves, with a normal that may differ from the hit's.
    """
    import drjit as dr
    import mitsuba as mi

    same_side = (wo.z > 0.0) == (dr.dot(si.n, outward) > 0.0)
    return same_side | mi.has_flag(bsdf.flags(), mi.BSDFFlags.Glossy) | _is_raised(bsdf)


def _is_raised(bsdf: Any) -> Any:
    """True for surfaces whose displacement bends their normals."""
    import mitsuba as mi

    return (mi.UInt32(bsdf.flags()) & RAISED) != 0


def leaves_as_drawn(_self: Any, si: Any, bs: Any, outward: Any) -> Any:
    """True if a drawn direction reflects off, or passes through, both the geometry and the shading."""
    import drjit as dr
    import mitsuba as mi

    same_side = dr.dot(si.n, outward) * dr.dot(si.n, mi.Vector3f(si.dn_du)) > 0.0
    of_strand = (mi.UInt32(bs.sampled_type) & FIBER) != 0
    return of_strand | (same_side == mi.has_flag(bs.sampled_type, mi.BSDFFlags.Reflection))


def seen_side(_self: Any, si: Any, direction: Any) -> Any:
    """Normal of the geometry on the side that a ray comes from."""
    import drjit as dr

    return dr.select(dr.dot(si.n, direction) > 0.0, -si.n, si.n)


def sides_of(_self: Any, bsdf: Any, leaves: Any) -> tuple[Any, Any]:
    """True if light from behind a surface reaches its front, and the types of rays along which it scatters light;
    ``leaves``: True for paths that come from below it.
    """
    import drjit as dr
    import mitsuba as mi

    both = mi.has_flag(bsdf.flags(), mi.BSDFFlags.Transmission) | leaves
    return both, kinds_of(bsdf, both) | dr.select(leaves, mi.UInt32(int(Rays.DIFFUSE)), 0)


def kind_of(_self: Any, bsdf: Any, si: Any, wo: Any, leaves: Any) -> Any:
    """Type of ray of a direction from a surface: a mixture counts as diffuse on its own side.

    ``leaves``: True for paths that come from below the surface, whose light leaves it as diffuse light.
    """
    import drjit as dr
    import mitsuba as mi

    same_side = (si.wi.z * wo.z > 0.0) | leaves
    diffuse = mi.has_flag(bsdf.flags(), mi.BSDFFlags.DiffuseReflection) | leaves
    own = dr.select(diffuse, mi.UInt32(int(Rays.DIFFUSE)), int(Rays.GLOSSY))
    return dr.select(same_side, own, int(Rays.TRANSMISSION))


def shadow_ray(self: Any, si: Any, drawn: Any, viewer: Any, bsdf: Any) -> tuple[Any, Any]:
    """Ray from a hit to a point of a light, and True where it starts above a smooth-shaded triangle.

    As in Cycles, light at grazing angles starts from the rounded surface that the normals describe, so that the flat
    triangles of a coarse mesh do not show at the terminator (Hanika 2021, "Hacking the shadow terminator").
    """
    import drjit as dr
    import mitsuba as mi

    ray = si.spawn_ray_to(drawn.point)
    meshes = self.tables.meshes
    if not lifts(meshes):
        return ray, mi.Bool(False)
    outer = mi.Vector3f(dr.mulsign(si.n, dr.dot(si.n, viewer)))
    smooth = mi.Vector3f(dr.mulsign(si.sh_frame.n, dr.dot(si.n, viewer)))
    smooth = dr.select(_is_raised(bsdf), outer, smooth)  # the normals are those before the displacement
    outer = dr.select(dr.dot(smooth, drawn.direction) < 0.0, -outer, outer)
    shift, cutoff = rounded(meshes, si, outer)
    share = dr.clip(2.0 - dr.maximum(dr.dot(outer, drawn.direction), 0.0) / dr.maximum(cutoff, 1e-6), 0.0, 1.0)
    # Cycles does not sample an even environment, so that its light starts from the triangles
    lifted = (cutoff > 0.0) & (share > 0.0) & (drawn.number != self.lights.even_world)
    origin = si.spawn_ray(outer).o + shift * share
    away = drawn.point - origin
    length = dr.norm(away)
    higher = mi.Ray3f(ray)
    higher.o, higher.d, higher.maxt = origin, away / length, length * (1.0 - 1e-3)
    return dr.select(lifted, higher, ray), lifted


def lifted_place(si: Any, lifted: Any, sampled: Any) -> Any:
    """The hit with marks by which closures scatter light that starts above their triangle (``duv_dx``), and light that
    Cycles samples (``duv_dy``).
    """
    import drjit as dr
    import mitsuba as mi

    place = mi.SurfaceInteraction3f(si)
    place.duv_dx = mi.Vector2f(si.duv_dx.x, dr.select(lifted, mi.Float(1.0), 0.0))
    place.duv_dy = mi.Vector2f(si.duv_dy.x, dr.select(sampled, mi.Float(1.0), 0.0))
    return place

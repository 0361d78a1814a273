# SPDX-License-Identifier: GPL-3.0-or-later
"""Sides of a surface at a hit: methods of the path integrator, where geometry and shading normals disagree."""

from __future__ import annotations

from typing import Any

from spectral_core.scene import Rays


def upright(_self: Any, si: Any) -> Any:
    """Direction to the viewer on the side of the surface that the geometry has, as in Cycles.

    Where interpolated normals lean away from the viewer it would lie below the surface that is seen, and the
    surface would be lit from behind; mirrored at the surface it keeps its angle and its side.
    """
    import drjit as dr
    import mitsuba as mi

    outside = dr.dot(si.n, si.to_world(si.wi)) > 0.0
    faces = dr.dot(si.n, si.sh_frame.n) > 0.0
    # Compared by sign alone: the angle itself is kept.
    above = (si.wi.z > 0.0) == (outside == faces)
    return mi.Vector3f(si.wi.x, si.wi.y, dr.select(above | ~si.is_valid(), si.wi.z, -si.wi.z))


def keeps_side(_self: Any, si: Any, wo: Any, outward: Any) -> Any:
    """Whether a direction leaves on the side of the geometry that it leaves the shading on: no leaks."""
    import drjit as dr

    outside = dr.dot(si.n, outward) * dr.dot(si.n, si.sh_frame.n) > 0.0
    return (wo.z > 0.0) == outside


def leaves_as_drawn(_self: Any, si: Any, bs: Any, outward: Any) -> Any:
    """Whether a drawn direction reflects off, or passes through, the geometry as it does the shading."""
    import drjit as dr
    import mitsuba as mi

    same_side = dr.dot(si.n, outward) * dr.dot(si.n, mi.Vector3f(si.dn_du)) > 0.0
    return same_side == mi.has_flag(bs.sampled_type, mi.BSDFFlags.Reflection)


def seen_side(_self: Any, si: Any, direction: Any) -> Any:
    """Normal of the geometry on the side that a ray comes from."""
    import drjit as dr

    return dr.select(dr.dot(si.n, direction) > 0.0, -si.n, si.n)


def lets_through(_self: Any, bsdf: Any) -> Any:
    """Whether light from behind a surface reaches its front."""
    import mitsuba as mi

    return mi.has_flag(bsdf.flags(), mi.BSDFFlags.Transmission)


def kind_of(_self: Any, bsdf: Any, si: Any, wo: Any) -> Any:
    """Kind of ray that a direction is for a surface: a mixed one counts as diffuse on its own side."""
    import drjit as dr
    import mitsuba as mi

    same_side = si.wi.z * wo.z > 0.0
    diffuse = mi.has_flag(bsdf.flags(), mi.BSDFFlags.DiffuseReflection)
    own = dr.select(diffuse, mi.UInt32(int(Rays.DIFFUSE)), int(Rays.GLOSSY))
    return dr.select(same_side, own, int(Rays.TRANSMISSION))

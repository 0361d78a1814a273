# SPDX-License-Identifier: GPL-3.0-or-later
"""Light that leaves a surface evenly: at the exit from below it, and where a dye emits."""

from __future__ import annotations

from typing import Any


def outer_normal(mi: Any, dr: Any, si: Any, along: Any) -> Any:
    """The shading normal on the side of the surface that ``along`` points to."""
    geometric = mi.Vector3f(dr.mulsign(si.n, dr.dot(si.n, along)))
    return mi.Vector3f(dr.mulsign(si.sh_frame.n, dr.dot(si.sh_frame.n, geometric)))


def exit_normal(mi: Any, dr: Any, tables: Any, si: Any, along: Any, active: Any) -> Any:
    """The normal about which light from below leaves: of bump and normal maps, seen from outside as in Cycles."""
    outer = outer_normal(mi, dr, si, along)
    if not any(kind.closure.bends_below for kind in tables.surfaces.kinds):
        return outer
    place = mi.SurfaceInteraction3f(si)
    place.dn_du, place.wi = along, si.to_local(along)
    bent = tables.surface(place).normal_below(place, active)
    # An image may tilt the normal by so much that it vanishes or points inward: the outer side counts then.
    length = dr.norm(bent)
    bent = dr.mulsign(bent, dr.dot(bent, outer)) / dr.maximum(length, 1e-12)
    return dr.select(length > 1e-6, bent, outer)


def leaving(mi: Any, dr: Any, si: Any, normal: Any, sample: Any) -> tuple[Any, Any]:
    """Diffuse emission from a surface about ``normal``: a BSDF's sample and a direction."""
    bs = dr.zeros(mi.BSDFSample3f)
    local = mi.warp.square_to_cosine_hemisphere(sample)
    outward = mi.Frame3f(normal).to_world(local)
    bs.wo, bs.eta = si.to_local(outward), mi.Float(1.0)
    # A shading normal lets some directions point below the true surface: no light leaves that way.
    bs.pdf = dr.select(cosine_out(mi, dr, si, normal, outward) > 0.0, local.z / dr.pi, 0.0)
    bs.sampled_type = mi.UInt32(int(mi.BSDFFlags.DiffuseReflection))
    return bs, outward


def cosine_out(mi: Any, dr: Any, si: Any, normal: Any, direction: Any) -> Any:
    """Cosine of a direction to the normal about which light leaves; 0 for one to the other side of the surface."""
    same_side = dr.dot(si.n, normal) * dr.dot(si.n, direction) > 0.0
    return dr.select(same_side, dr.maximum(dr.dot(normal, direction), 0.0), 0.0)

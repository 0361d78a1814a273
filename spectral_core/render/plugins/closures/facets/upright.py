# SPDX-License-Identifier: GPL-3.0-or-later
"""A valid shading normal for reflecting lobes if the viewer's mirror image would lie below the surface."""

from __future__ import annotations

from typing import Any

LEAST_COSINE = 0.01
"""Cosine to the geometric normal that a mirrored view direction keeps (Cycles)."""


def toward_viewer(mi: Any, dr: Any, si: Any) -> Any:
    """World direction to the viewer.

    The path integrator stores it in ``dn_du``, which nothing else reads: if interpolated normals lean away from the
    viewer, ``si.wi`` is mirrored to the visible side and no longer contains it.
    """
    known = mi.Vector3f(si.dn_du)
    return dr.select(dr.squared_norm(known) > 0.5, known, si.to_world(si.wi))


def with_valid_normal(mi: Any, dr: Any, si: Any) -> Any:
    """The hit with the nearest normal that mirrors the viewer to the outer side.

    Cycles' ``ensure_valid_specular_reflection``: in the plane of the geometric and the shading normal, the normal N'
    nearest to the shading normal with 2 (N'·I)(N'·Ng) - I·Ng = t, a quadratic equation in the square of N'·Ng.
    """
    toward = toward_viewer(mi, dr, si)
    outer = mi.Vector3f(dr.mulsign(si.n, dr.dot(si.n, toward)))
    frame_normal = mi.Vector3f(si.sh_frame.n)
    # The side of the geometry decides: a normal that leans away from it by more than 90° (faces of one mesh with
    # different windings) stays so, and such places are dark in Cycles.
    side = dr.mulsign(mi.Float(1.0), dr.dot(si.n, toward))
    normal = frame_normal * side
    height = dr.dot(toward, outer)
    # a mirrored direction may always be as shallow as the incident one
    least = dr.minimum(0.9 * height, LEAST_COSINE)
    mirrored = 2.0 * dr.dot(normal, toward) * normal - toward
    invalid = (dr.dot(outer, mirrored) < least) & (height > 0.0)
    across = normal - outer * dr.dot(normal, outer)
    size = dr.norm(across)
    invalid &= size > 1e-6
    across /= dr.maximum(size, 1e-6)
    along = dr.dot(toward, across)
    a = along * along + height * height
    b, c = 2.0 * (a + height * least), dr.square(least + height)
    root = dr.safe_sqrt(b * b - 4.0 * a * c)
    # of the two positive solutions, the one whose sign did not change by squaring
    squared = dr.clip(0.25 * dr.select(along < 0.0, b + root, b - root) / dr.maximum(a, 1e-20), 0.0, 1.0)
    turned = dr.safe_sqrt(1.0 - squared) * across + dr.safe_sqrt(squared) * outer
    valid = mi.SurfaceInteraction3f(si)
    chosen = dr.select(invalid, turned * side, frame_normal)
    valid.sh_frame.n = mi.Normal3f(chosen)
    first, second = mi.coordinate_system(chosen)
    valid.sh_frame.s = dr.select(invalid, mi.Vector3f(first), mi.Vector3f(si.sh_frame.s))
    valid.sh_frame.t = dr.select(invalid, mi.Vector3f(second), mi.Vector3f(si.sh_frame.t))
    local = valid.to_local(toward)
    valid.wi = dr.select(invalid, local, si.wi)
    return valid


def sees_facets(mi: Any, dr: Any, si: Any) -> Any:
    """True if the viewer is above the normal, which facets need; scattering of other kinds does not depend on it."""
    toward = toward_viewer(mi, dr, si)
    return dr.dot(si.n, toward) * dr.dot(si.sh_frame.n, toward) > 0.0


def mark_drawn(mi: Any, dr: Any, si: Any, drawn: Any) -> Any:
    """The hit with a mark in ``duv_dy``, which nothing else reads, for the closure that has drawn the direction."""
    place = mi.SurfaceInteraction3f(si)
    place.duv_dy = mi.Vector2f(dr.select(drawn, mi.Float(1.0), -1.0), 0.0)
    return place


def drawn_elsewhere(si: Any) -> Any:
    """True if a closure is evaluated in a direction that another closure of the surface has drawn."""
    return si.duv_dy.x < -0.5


def is_drawn(si: Any) -> Any:
    """True if a closure is evaluated in a direction that it has drawn itself."""
    return si.duv_dy.x > 0.5


def is_sampled(si: Any) -> Any:
    """True if a closure is evaluated toward a light that Cycles samples: any but an even world."""
    return si.duv_dy.y > 0.5


def keeps_side(mi: Any, dr: Any, si: Any, wo: Any) -> Any:
    """True if a local direction leaves on the same side of the geometry as of the shading, seen from the viewer."""
    outside = dr.dot(si.n, toward_viewer(mi, dr, si)) * dr.dot(si.n, si.to_world(wo)) > 0.0
    # light of a lamp that starts above a coarse triangle may come from below its plane
    return (outside == (si.wi.z * wo.z > 0.0)) | (si.duv_dx.y > 0.5)


def softening(dr: Any, smooth: Any, bent: Any, together: Any) -> Any:
    """Share of diffuse light that a bent surface scatters: it fades toward the horizon of the smooth surface.

    ``smooth``, ``bent``: cosines of the light to the two normals; ``together``: cosine between these. Light that one of
    the two normals would reflect and the other transmit is lost (Estevez, Lecocq and Stein 2019, "A microfacet-based
    shadowing function to solve the bump terminator problem", as in Cycles).
    """
    alpha_squared = dr.minimum(0.125 * (dr.rcp(together * together) - 1.0), 1.0)
    tangent_squared = dr.rcp(dr.maximum(smooth * smooth, 1e-12)) - 1.0
    share = 2.0 / (1.0 + dr.safe_sqrt(1.0 + alpha_squared * tangent_squared))
    return dr.select(smooth * bent * together >= 0.0, share, 0.0)

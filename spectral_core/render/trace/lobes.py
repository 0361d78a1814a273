# SPDX-License-Identifier: GPL-3.0-or-later
"""Diffuse, glossy and transmitted shares of a surface's scattering."""

from __future__ import annotations

from typing import Any

from spectral_core.render.plugins.closures.strands.fiber import FIBER
from spectral_core.scene import Rays


def parts_of(mi: Any, dr: Any, si: Any, bsdf: Any, wo: Any, value: Any, active: Any) -> tuple[Any, Any]:
    """Diffuse and glossy shares of ``value``, the BSDF's value toward ``wo``.

    The rest is transmission. The diffuse lobes of a BSDF are evaluated separately.
    """
    flags = bsdf.flags()
    matt_lobes = int(mi.BSDFFlags.Diffuse)
    is_matt = (flags & matt_lobes) != 0
    mixed = is_matt & ((flags & (int(mi.BSDFFlags.Glossy) | int(mi.BSDFFlags.Delta))) != 0)
    asked = mi.BSDFContext()
    asked.type_mask = matt_lobes
    diffuse = bsdf.eval_pdf(asked, si, wo, active & mixed)[0]
    share = dr.select(value != 0.0, dr.clip(diffuse / value, 0.0, 1.0), 0.0)
    share = dr.select(mixed, share, dr.select(is_matt, mi.Spectrum(1.0), 0.0))
    through = int(mi.BSDFFlags.GlossyTransmission) | int(mi.BSDFFlags.DeltaTransmission)
    # normals that lean away from the surface's send reflected light below it
    reflects = (si.wi.z * wo.z > 0.0) | ((flags & through) == 0) | of_fiber(mi, flags)
    return share, dr.select(reflects, 1.0 - share, 0.0)


def of_fiber(mi: Any, flags: Any) -> Any:
    """True for hair that is glossy in all directions, as in Cycles: its lobes go around the strand."""
    return ((flags & FIBER) != 0) & ((flags & int(mi.BSDFFlags.GlossyReflection)) != 0)


def drawn_parts(mi: Any, dr: Any, si: Any, bsdf: Any, bs: Any, active: Any) -> tuple[Any, Any]:
    """The same shares of a sample that a BSDF has drawn."""
    sharp = mi.has_flag(bs.sampled_type, mi.BSDFFlags.Delta)
    blunt = active & ~sharp
    value = bsdf.eval_pdf(mi.BSDFContext(), si, bs.wo, blunt)[0]
    diffuse, glossy = parts_of(mi, dr, si, bsdf, bs.wo, value, blunt)
    mirrored = dr.select(mi.has_flag(bs.sampled_type, mi.BSDFFlags.Reflection), mi.Spectrum(1.0), 0.0)
    return dr.select(sharp, 0.0, diffuse), dr.select(sharp, mirrored, glossy)


def kinds_of(bsdf: Any, both_sides: Any) -> Any:
    """Types of rays along which a surface may scatter light; ``both_sides``: True if light from behind counts."""
    import drjit as dr
    import mitsuba as mi

    # A light is skipped only if it is hidden from all of these types. An additional type is harmless: it only keeps a
    # light that could be skipped.
    flags = bsdf.flags()
    has = lambda lobes: (flags & int(lobes)) != 0  # noqa: E731
    diffuse = dr.select(has(mi.BSDFFlags.Diffuse), mi.UInt32(int(Rays.DIFFUSE)), 0)
    glossy = dr.select(has(int(mi.BSDFFlags.Glossy) | int(mi.BSDFFlags.Delta)), mi.UInt32(int(Rays.GLOSSY)), 0)
    return diffuse | glossy | dr.select(both_sides, mi.UInt32(int(Rays.TRANSMISSION)), 0)


def visible_share(hidden: Any, hit: tuple[Any, Any], wo: Any, value: Any, active: Any) -> Any:
    """Share of a surface's scattering toward a light that is hidden from some types of rays (bits of ``Rays``): its
    closures of the other types. ``hit``: interaction and BSDF.
    """
    import drjit as dr
    import mitsuba as mi

    # Cycles leaves closures out one by one (surface_shader_exclude); rays that hit the light by chance follow the type
    # of the closure that has drawn them, so that both halves of the light's weight count the same closures.
    partly = active & (hidden != 0)
    diffuse, glossy = parts_of(mi, dr, *hit, wo, value, partly)
    shares = (diffuse, Rays.DIFFUSE), (glossy, Rays.GLOSSY), (1.0 - diffuse - glossy, Rays.TRANSMISSION)
    kept = mi.Spectrum(0.0)
    for share, kind in shares:
        kept += dr.select((hidden & int(kind)) != 0, mi.Spectrum(0.0), share)
    return dr.select(partly, kept, mi.Spectrum(1.0))

# SPDX-License-Identifier: GPL-3.0-or-later
"""Diffuse, glossy and transmitted shares of a surface's scattering."""

from __future__ import annotations

from typing import Any


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
    return share, dr.select(si.wi.z * wo.z > 0.0, 1.0 - share, 0.0)


def drawn_parts(mi: Any, dr: Any, si: Any, bsdf: Any, bs: Any, active: Any) -> tuple[Any, Any]:
    """The same shares of a sample that a BSDF has drawn."""
    sharp = mi.has_flag(bs.sampled_type, mi.BSDFFlags.Delta)
    blunt = active & ~sharp
    value = bsdf.eval_pdf(mi.BSDFContext(), si, bs.wo, blunt)[0]
    diffuse, glossy = parts_of(mi, dr, si, bsdf, bs.wo, value, blunt)
    mirrored = dr.select(mi.has_flag(bs.sampled_type, mi.BSDFFlags.Reflection), mi.Spectrum(1.0), 0.0)
    return dr.select(sharp, 0.0, diffuse), dr.select(sharp, mirrored, glossy)

# SPDX-License-Identifier: GPL-3.0-or-later
"""What Cycles' settings of a file cut off from paths: caustics, and contributions above a clamp."""

from __future__ import annotations

from typing import Any

from spectral_core.render.trace.path_settings import PathSettings
from spectral_core.scene import Rays


def cut_caustic(settings: PathSettings, bsdf: Any, kind: Any) -> Any:
    """Whether a diffuse ray meets a mirror or a glass that caustics are switched off for."""
    import mitsuba as mi

    limits = settings.limits
    cut = mi.Bool(False)
    flags = bsdf.flags()
    diffuse = mi.has_flag(flags, mi.BSDFFlags.Diffuse) | mi.has_flag(flags, mi.BSDFFlags.Null)
    bends = mi.has_flag(flags, mi.BSDFFlags.Transmission)
    if not limits.reflective_caustics:
        cut |= ~bends
    if not limits.refractive_caustics:
        cut |= bends
    return cut & ~diffuse & (kind == int(Rays.DIFFUSE))


def clamped(settings: PathSettings, value: Any, indirect: Any) -> Any:
    """A contribution brought down to the limits on a sample's mean."""
    import drjit as dr
    import mitsuba as mi

    limits = settings.limits
    if limits.clamp_direct <= 0 and limits.clamp_indirect <= 0:
        return value
    none = float(dr.largest(mi.Float))
    highest = [limit * settings.white if limit > 0 else none for limit in (limits.clamp_direct, limits.clamp_indirect)]
    low, high = (dr.opaque(mi.Float, limit) for limit in highest)
    mean = dr.mean(dr.abs(value))
    most = dr.select(indirect, high, low)
    return value * dr.select(mean > most, most / mean, 1.0)

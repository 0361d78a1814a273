# SPDX-License-Identifier: GPL-3.0-or-later
"""From the point where light enters a surface to the ray that leaves it."""

from __future__ import annotations

from typing import Any

from spectral_core.render.plugins.closures.subsurface import entry_of
from spectral_core.render.trace.below.disk import across
from spectral_core.render.trace.below.medium import per_wavelength
from spectral_core.render.trace.below.walk import walk


def dive(mi: Any, dr: Any, scene: Any, tables: Any, start: Any, sampler: Any) -> tuple[Any, Any, Any, Any]:
    """Find the exit of light that enters at ``start``: hit, its number, drawn sample, seen color, throughput of the
    path so far, True where light enters, True where the path was diffuse before, the BSDF, and the number in [0, 1)
    that it drew a closure with.

    Returns the ray that hits the surface from inside at the exit, the factor on the throughput, True if the light
    leaves at all, and the sampler.
    """
    si, own, bs, color, carried, active, was_diffuse, bsdf, pick = start
    entry = entry_of(mi, dr, bs)
    # after a diffuse bounce a disk would not be seen: Cycles shows the surface as diffuse
    radius = dr.select(entry.is_disk & was_diffuse, 0.0, per_wavelength(mi, dr, bs.wo, si.wavelengths))
    known = (tables.at_bounce(si), own, entry, radius, color, mi.Spectrum(bs.pdf), carried)
    ray, factor, left, sampler = walk(mi, dr, scene, tables, (*known, active & ~entry.is_disk), sampler)
    if tables.disks:
        other, moved, found, sampler = across(mi, dr, scene, tables, (*known, active & entry.is_disk), sampler)
        ray, factor = dr.select(entry.is_disk, other, ray), dr.select(entry.is_disk, moved, factor)
        left |= found
    if any(kind.closure.tints_below for kind in bsdf.tables.kinds):
        factor *= bsdf.of_drawn("tint_below", si, pick, active)
    return ray, mi.Spectrum(factor), left, sampler

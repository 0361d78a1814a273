# SPDX-License-Identifier: GPL-3.0-or-later
"""From the point where light enters a surface to the ray that leaves it."""

from __future__ import annotations

from typing import Any

from spectral_core.render.plugins.closures.subsurface import entry_of
from spectral_core.render.trace.below.disk import across
from spectral_core.render.trace.below.medium import per_wavelength
from spectral_core.render.trace.below.walk import walk


def dive(mi: Any, dr: Any, scene: Any, tables: Any, start: Any, sampler: Any) -> tuple[Any, Any, Any, Any]:
    """Find the exit of light that enters at ``start``: hit, its number, drawn sample, seen color, True where light
    enters, and True where the path was diffuse before.

    Returns the ray that hits the surface from inside at the exit, the factor on the throughput, True if the light
    leaves at all, and the sampler.
    """
    si, own, bs, color, active, was_diffuse = start
    entry = entry_of(mi, dr, bs)
    # after a diffuse bounce a disk would not be seen: Cycles shows the surface as diffuse
    radius = dr.select(entry.is_disk & was_diffuse, 0.0, per_wavelength(mi, dr, bs.wo, si.wavelengths))
    known = (si, own, entry, radius, color, mi.Spectrum(bs.pdf))
    ray, factor, left, sampler = walk(mi, dr, scene, tables, (*known, active & ~entry.is_disk), sampler)
    if tables.disks:
        other, moved, found, sampler = across(mi, dr, scene, tables, (*known, active & entry.is_disk), sampler)
        ray, factor = dr.select(entry.is_disk, other, ray), dr.select(entry.is_disk, moved, factor)
        left |= found
    return ray, mi.Spectrum(factor), left, sampler

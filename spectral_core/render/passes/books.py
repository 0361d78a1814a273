# SPDX-License-Identifier: GPL-3.0-or-later
"""Accumulation of shares of the light: rows of a pixel's sums, one per pass and one per light group.

The integrator (``path``) has these functions as methods.
"""

from __future__ import annotations

from typing import Any

from spectral_core.render.trace import lobes
from spectral_core.render.trace.path.state import by_reflections
from spectral_core.scene.passes import GROUP_PREFIX, LIGHT_PASSES, LOBES

LIGHT_ROWS = {name: row for row, name in enumerate(LIGHT_PASSES)}
"""Row of each pass among a pixel's sums; rows of light groups follow."""


def light_group_names(groups: tuple[str, ...]) -> dict[str, int]:
    """Row of each light group, by the name of its pass."""
    return {GROUP_PREFIX + group: len(LIGHT_ROWS) + number for number, group in enumerate(groups)}


def book_into(path: Any, sums: Any, lane: Any, measured: Any) -> None:
    """Set the target of accumulation: sums (pixels · rows · 3), each lane's pixel, and the conversion of radiance
    (with its parts ``by_reflections``) to color; or None.
    """
    path.sums, path.lane, path.measured = sums, lane, measured


def book(path: Any, row: int | Any, light: Any, active: Any) -> None:
    """Add light to a row of the pixel."""
    import drjit as dr

    finite = dr.all(dr.isfinite(light))
    light = dr.select(finite, light, 0.0)
    color = path.measured(light, by_reflections(dr, light, path.reflections))
    at = (path.lane * path.rows + row) * 3
    for k in range(3):
        wanted = active & (color[k] != 0.0)
        dr.scatter_add(path.sums, color[k], at + k, wanted, dr.ReduceMode.NoConflicts)


def book_lobes(path: Any, light: Any, order: str, parts: tuple[Any, ...], active: Any) -> None:
    """Add light to the passes of the first surface's lobes by their shares, and the rest to the pass of the medium."""
    import mitsuba as mi

    rest = mi.Spectrum(1.0)
    for lobe, part in zip(LOBES, parts, strict=True):
        path.book(LIGHT_ROWS[f"{lobe} {order}"], light * part, active)
        rest -= part
    if path.tables.media is not None:
        path.book(LIGHT_ROWS[f"Volume {order}"], light * rest, active)


def book_group(path: Any, light: Any, number: Any, active: Any) -> None:
    """Add light to the row of the group of a light."""
    import drjit as dr
    import mitsuba as mi

    if not path.groups:
        return
    group = dr.gather(mi.UInt32, path.by_light, number, active)
    path.book(len(LIGHT_ROWS) + dr.maximum(group, 1) - 1, light, active & (group > 0))


def parts_of(path: Any, hit: tuple[Any, ...], wo: Any, value: Any, active: Any) -> tuple[Any, ...]:
    """Diffuse, glossy and transmitted shares of a surface's scattering toward ``wo``."""
    import drjit as dr
    import mitsuba as mi

    si, bsdf, _, (even, _) = hit
    floats = mi.Bool(False) if path.fog is None else path.fog[0]
    return path.complete(lobes.parts_of(mi, dr, si, bsdf, wo, value, active & ~even & ~floats), even, floats)


def complete(path: Any, parts: tuple[Any, Any], even: Any, floats: Any) -> tuple[Any, ...]:
    """Shares of the diffuse and glossy lobes with that of transmission; light that leaves evenly is diffuse."""
    import drjit as dr
    import mitsuba as mi

    diffuse, glossy = dr.select(even, mi.Spectrum(1.0), parts[0]), dr.select(even, 0.0, parts[1])
    return tuple(dr.select(floats, 0.0, part) for part in (diffuse, glossy, 1.0 - diffuse - glossy))

# SPDX-License-Identifier: GPL-3.0-or-later
"""Turning points of a field along a ray: where the field stops to rise or to fall inside a cell.

Along a straight ray a trilinear field is a cubic inside each cell, so that it has at most two turning points there. The
tip of an object that a ray grazes inside a cell is at one of them. Steps that end at faces and at turning points have
data that rise or fall alone: the values between the two ends are exactly those inside the step.
"""

from __future__ import annotations

from typing import Any

from spectral_core.volume.march.arithmetic import larger, smaller
from spectral_core.volume.march.device.voxels import DeviceVolume
from spectral_core.volume.march.march_input import Rays

NEVER = 1e9  # voxels: farther than any way along a ray
_EVEN = 8.0  # times the planned step in voxels: the share of the way to a turning point that a step may take
_MOST = 0.5  # of that way
_SAME = 2e-5  # voxels: positions this close are the same to single precision


def graded(volume: DeviceVolume, rays: Rays, distance: Any, face: Any, planned: Any, least: Any) -> Any:
    """The step from ``distance`` voxels along, at most ``planned``, that grows with the distance from turning points.

    It ends at a turning point before ``face``, the distance to the next face. Near a turning point the data are a
    parabola: a step that has its tip at one end spends much less of its range of values beside the tip than of its
    length, so that a mean over the values would show too little of an object there. Steps that shrink toward the tip by
    a constant factor have the same small error for an object of any size, down to ``least`` voxels.
    """
    import drjit as dr

    before, after = _turns(volume, rays, distance, face)
    share = smaller(planned * _EVEN, _MOST)
    ahead = dr.select(after < least, larger(after, 0.25 * least), larger(share * after, least))
    behind = larger(share / (1.0 - share) * before, least)
    return smaller(smaller(planned, ahead), behind)


def _turns(volume: DeviceVolume, rays: Rays, distance: Any, face: Any) -> tuple[Any, Any]:
    """Voxels from ``distance`` back to the last turning point of the cell's cubic, and on to the next one; ``NEVER``
    without one. Those beyond the cell's faces count as well: the data are nearly a parabola beside them.
    """
    import drjit as dr

    half = 0.5 * face
    # The middle of the way to the next face is inside the cell, however rounding moves its ends.
    middle = rays.at(distance + half)
    c, b, a = _derivative(volume, middle, rays.direction)
    # Roots of a·s² + b·s + c, s from the middle, by the form that does not subtract nearly equal numbers.
    inside = b * b - 4.0 * a * c
    q = -0.5 * (b + dr.select(b < 0.0, -1.0, 1.0) * dr.sqrt(larger(inside, 0.0)))
    roots = [_quotient(q, a), _quotient(c, q)]
    before: Any = NEVER
    after: Any = NEVER
    for root in roots:
        way = root + half
        is_turn = (inside > 0.0) & (dr.abs(root) < NEVER)
        # A step that ends at a turning point ends beside it by rounding.
        is_ahead = way > _SAME
        after = smaller(dr.select(is_turn & is_ahead, way, NEVER), after)
        before = smaller(dr.select(is_turn & ~is_ahead, larger(-way, 0.0), NEVER), before)
    return before, after


def _quotient(over: Any, under: Any) -> Any:
    import drjit as dr

    return dr.select(under != 0.0, over / dr.select(under != 0.0, under, 1.0), 2.0 * NEVER)


def _derivative(volume: DeviceVolume, point: Any, direction: Any) -> tuple[Any, Any, Any]:
    """Coefficients of 1, s and s² of the field's derivative at ``point`` + s·``direction``, in the point's cell."""
    import drjit as dr

    edges, (x, y, z) = volume.cell(point)
    level = (point < 0.0) | (point > volume.last)  # the outer half voxel keeps the value of the face
    dx, dy, dz = dr.select(level, 0.0, direction)
    rise = [b - a for a, b in edges]
    at = [dr.fma(r, x, a) for r, (a, _) in zip(rise, edges, strict=True)]

    def over_yz(corners: list[Any]) -> tuple[Any, Any, Any, Any]:
        """Value, slopes along y and z, and mixed difference of a bilinear function."""
        low, high = corners[1] - corners[0], corners[3] - corners[2]
        mixed = high - low
        along_z = dr.fma(mixed, y, corners[2] - corners[0])
        return dr.fma(along_z, z, dr.fma(low, y, corners[0])), dr.fma(mixed, z, low), along_z, mixed

    _, fy, fz, fyz = over_yz(at)
    fx, fxy, fxz, fxyz = over_yz(rise)
    first = fx * dx + fy * dy + fz * dz
    second = 2.0 * (fxy * dx * dy + fxz * dx * dz + fyz * dy * dz)
    return first, second, 3.0 * fxyz * dx * dy * dz

# SPDX-License-Identifier: GPL-3.0-or-later
"""A reference marcher that shares nothing with the product: not its tables, bricks, units, camera or interpolation.

Each ray goes from one face between voxel centers to the next, and each such part is cut into equal pieces. In a piece
the field is taken as linear between its ends; the transfer function's mean over the values between them comes from the
exact antiderivative of its knots, found by bisection. All in float64, with no early end and no skipping.

Voxels and knots are counted from the least voxel, by integers or fractions: float64 holds no difference of two values
near 1.8e19 that is smaller than 2048. Rays are counted from where they enter the field, for a like reason.
"""

from __future__ import annotations

from fractions import Fraction
from itertools import accumulate, pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.transfer import TransferFunction
from spectral_core.volume.view import View

Array = NDArray[np.float64]


def exact_amounts(volume: ScalarVolume, transfer: TransferFunction, view: View, pieces: int = 32) -> Array:
    """Amounts (height, width, K) of one-dimensional ``transfer``, one ray through each pixel's center."""
    import drjit as dr
    import drjit.llvm as types

    real, count = types.Float64, types.UInt32
    start, direction = _rays(view)
    inverse = np.linalg.inv(np.asarray(volume.world_from_index, dtype=np.float64))
    origin, along = start @ inverse[:3, :3].T + inverse[:3, 3], direction @ inverse[:3, :3].T
    near, far = _box(volume.shape, origin, along, view.fov_deg is None)
    origin, far = origin + near[:, None] * along, far - near
    o, d = ([real(np.ascontiguousarray(v[:, a])) for a in range(3)] for v in (origin, along))
    base = volume.data.min().item()
    voxels, shape = real(_above(volume.data, base)), volume.shape
    curves = [_Curve(types, m.values, m.extinction, base) for m in transfer.materials]
    glows = [None if m.emission is None else _Curve(types, m.values, m.emission, base) for m in transfer.materials]

    def value(t: Any) -> Any:
        low, part = [], []
        for a in range(3):
            at = dr.clip(o[a] + t * d[a], 0.0, float(shape[a] - 1))
            cell = dr.minimum(count(at), max(shape[a] - 2, 0))
            low.append(cell)
            part.append(at - real(cell))

        def voxel(*up: int) -> Any:
            i, j, k = (dr.minimum(low[a] + up[a], shape[a] - 1) for a in range(3))
            return dr.gather(real, voxels, (i * shape[1] + j) * shape[2] + k)

        def along_z(i: int, j: int) -> Any:
            first = voxel(i, j, 0)
            return first + part[2] * (voxel(i, j, 1) - first)

        def along_y(i: int) -> Any:
            first = along_z(i, 0)
            return first + part[1] * (along_z(i, 1) - first)

        first = along_y(0)
        return first + part[0] * (along_y(1) - first)

    def next_face(t: Any) -> Any:
        """The next t at which a coordinate is a whole number."""
        nearest = real(1e300)
        for a in range(3):
            at = o[a] + t * d[a]
            face = dr.select(d[a] > 0, dr.floor(at + 1e-9) + 1.0, dr.ceil(at - 1e-9) - 1.0)
            still = dr.abs(d[a]) < 1e-14
            nearest = dr.minimum(nearest, dr.select(still, 1e300, (face - o[a]) / dr.select(still, 1.0, d[a])))
        return nearest

    end = real(far)

    def going(t: Any, *_: Any) -> Any:
        return t < end

    def part_of_a_cell(t: Any, face: Any, piece: Any, f: Any, passed: Any, amounts: list[Any]) -> tuple[Any, ...]:
        # One piece per iteration: a piece's length is a share of its cell's part, whose end is ``face``.
        left = real(pieces) - piece
        after = dr.select(left <= 1.0, face, t + (face - t) / left)
        g = value(after)
        sigma = [curve.mean(f, g) for curve in curves]
        source = [s if glow is None else s + glow.mean(f, g) for s, glow in zip(sigma, glows, strict=True)]
        depth = sum(sigma[1:], sigma[0]) * (after - t)
        reach = dr.select(depth > 1e-8, (1.0 - dr.exp(-depth)) / dr.maximum(depth, 1e-300), 1.0 - 0.5 * depth)
        gain = passed * reach * (after - t)
        amounts = [a + gain * s for a, s in zip(amounts, source, strict=True)]
        piece = piece + 1.0
        done = piece >= pieces
        face = dr.select(done, dr.minimum(next_face(after), end), face)
        return after, face, dr.select(done, 0.0, piece), g, passed * dr.exp(-depth), amounts

    t = zero = end * 0.0
    state = (t, dr.minimum(next_face(t), end), zero + 0.0, value(t), zero + 1.0, [zero + 0.0 for _ in curves])
    amounts = dr.while_loop(state, going, part_of_a_cell)[5]
    return np.stack([a.numpy() for a in amounts], axis=-1).reshape(view.height, view.width, -1)


def _above(data: NDArray[Any], base: float) -> Array:
    """Voxels minus the least of them, raveled: exact for integers."""
    if data.dtype.kind == "f":
        return np.ascontiguousarray((data.astype(np.float64) - base).ravel())
    # The difference of two integers, as an unsigned one of the same size, is exact even where it has no signed form.
    kind = np.dtype(f"u{data.dtype.itemsize}")
    return np.ascontiguousarray(
        (data.astype(kind) - np.array(base, data.dtype).astype(kind)).astype(np.float64).ravel()
    )


class _Curve:
    """A piecewise linear curve with jumps, constant outside, by its heights and areas at its distinct knots.

    Knots are ``values`` minus ``base``. The area before a knot is ``area`` plus ``less``, in twice the digits of
    float64, so that differences of areas keep all of theirs.
    """

    def __init__(self, types: Any, values: Array, heights: Array, base: float) -> None:
        given, first, counts = np.unique(values, return_index=True, return_counts=True)
        knots = [Fraction(float(each)) - Fraction(base) for each in given]
        left, right = ([Fraction(float(h)) for h in heights[at]] for at in (first, first + counts - 1))
        pieces = [(b - a, low, high) for (a, b), low, high in zip(pairwise(knots), right, left[1:], strict=False)]
        slopes = [(high - low) / width for width, low, high in pieces] + [Fraction(0)]
        areas = list(accumulate(((low + high) / 2 * width for width, low, high in pieces), initial=Fraction(0)))
        less = [area - Fraction(float(area)) for area in areas]
        # Below the first knot a level piece of its own, whose area counts down from there.
        columns = knots[:1] + knots, left[:1] + left, left[:1] + right, [0, *slopes], [0, *areas], [0, *less]
        self.knots, self.left, self.right, self.slope, self.area, self.less = (
            types.Float64(np.array([float(each) for each in column])) for column in columns
        )
        self.size, self.types = len(knots), types

    def _piece(self, v: Any) -> tuple[Any, Any]:
        """(piece, distance from its knot) of ``v``: piece 0 is below the first knot."""
        import drjit as dr

        at = self.types.UInt32(0) + dr.zeros(self.types.UInt32, dr.width(v))
        step = max(1 << 5, 1 << self.size.bit_length() - 1)  # one kernel serves all curves of up to 63 knots
        while step:
            probe = at + step
            inside = probe <= self.size
            knot = dr.gather(self.types.Float64, self.knots, dr.minimum(probe, self.size))
            at = dr.select(inside & (v >= knot), probe, at)
            step >>= 1
        return at, v - dr.gather(self.types.Float64, self.knots, at)

    def mean(self, a: Any, b: Any) -> Any:
        """Mean over the values between ``a`` and ``b``."""
        import drjit as dr

        (at_a, from_a), (at_b, from_b) = self._piece(a), self._piece(b)
        low, high = dr.minimum(at_a, at_b), dr.maximum(at_a, at_b)
        least = dr.select(at_a < at_b, a, b)

        def of(column: Any, at: Any) -> Any:
            return dr.gather(type(a), column, at)

        # Within a piece the curve is a line, whose mean is that of its ends; areas would differ by their rounding.
        inside = of(self.right, at_a) + 0.5 * (from_a + from_b) * of(self.slope, at_a)
        # The rest of the lower piece, the pieces between, and the part of the higher one: no large areas cancel.
        after = dr.minimum(low + 1, self.size)
        rest, part = of(self.knots, after) - least, dr.select(at_a < at_b, from_b, from_a)
        tail = rest * (of(self.left, after) - 0.5 * rest * of(self.slope, low))
        head = part * (of(self.right, high) + 0.5 * part * of(self.slope, high))
        between = of(self.area, high) - of(self.area, after) + (of(self.less, high) - of(self.less, after))
        across = (tail + between + head) / dr.select(low == high, 1.0, dr.abs(b - a))
        return dr.maximum(dr.select(low == high, inside, across), 0.0)


def _rays(view: View) -> tuple[Array, Array]:
    """Start and unit direction of the ray through each pixel's center: the camera looks along +z, +x to the left."""
    matrix = np.asarray(view.world_from_camera, dtype=np.float64)
    half = view.ortho_width / 2 if view.fov_deg is None else np.tan(np.radians(view.fov_deg) / 2)
    column, row = np.meshgrid(np.arange(view.width) + 0.5, np.arange(view.height) + 0.5)
    x = (1 - 2 * column / view.width) * half
    y = (1 - 2 * row / view.height) * half * view.height / view.width
    if view.fov_deg is None:
        start = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=-1) @ matrix[:3, :3].T + matrix[:3, 3]
        return start, np.tile(matrix[:3, 2], (x.size, 1))
    toward = np.stack([x.ravel(), y.ravel(), np.ones(x.size)], axis=-1) @ matrix[:3, :3].T
    return np.tile(matrix[:3, 3], (x.size, 1)), toward / np.linalg.norm(toward, axis=-1, keepdims=True)


def _box(shape: tuple[int, ...], origin: Array, along: Array, endless: bool) -> tuple[Array, Array]:
    near, far = np.full(len(origin), -np.inf if endless else 0.0), np.full(len(origin), np.inf)
    for axis, voxels in enumerate(shape):
        o, d = origin[:, axis], along[:, axis]
        parallel = np.abs(d) < 1e-14
        with np.errstate(divide="ignore", invalid="ignore"):
            first, last = (-0.5 - o) / d, (voxels - 0.5 - o) / d
        outside = parallel & ((o < -0.5) | (o > voxels - 0.5))
        near = np.where(parallel, near, np.maximum(near, np.minimum(first, last)))
        far = np.where(outside, -np.inf, np.where(parallel, far, np.minimum(far, np.maximum(first, last))))
    hit = far > near
    return np.where(hit, near, 0.0), np.where(hit, far, 0.0)

# SPDX-License-Identifier: GPL-3.0-or-later
"""A reference marcher that shares nothing with the product: not its tables, bricks, units, camera or interpolation.

Each ray goes from one face between voxel centers to the next, and each such part is cut into equal pieces. In a piece
the field is taken as linear between its ends; the transfer function's mean over the values between them comes from the
exact antiderivative of its knots, found by bisection. All in float64, with no early end and no skipping.
"""

from __future__ import annotations

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
    o, d = ([real(np.ascontiguousarray(v[:, a])) for a in range(3)] for v in (origin, along))
    voxels = real(np.ascontiguousarray(volume.data.astype(np.float64).ravel()))
    shape = volume.shape
    curves = [_Curve(types, m.values, m.extinction) for m in transfer.materials]
    glows = [None if m.emission is None else _Curve(types, m.values, m.emission) for m in transfer.materials]

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

    t = real(near)
    zero = t * 0.0
    state = (t, dr.minimum(next_face(t), end), zero + 0.0, value(t), zero + 1.0, [zero + 0.0 for _ in curves])
    amounts = dr.while_loop(state, going, part_of_a_cell)[5]
    return np.stack([a.numpy() for a in amounts], axis=-1).reshape(view.height, view.width, -1)


class _Curve:
    """A piecewise linear curve with jumps, constant outside, by its heights and areas at its distinct knots."""

    def __init__(self, types: Any, values: Array, heights: Array) -> None:
        knots, first, counts = np.unique(values, return_index=True, return_counts=True)
        left, right = heights[first], heights[first + counts - 1]
        width = np.diff(knots)
        slope = np.append((left[1:] - right[:-1]) / width, 0.0)
        area = np.concatenate([[0.0], np.cumsum(0.5 * (right[:-1] + left[1:]) * width)])
        # Below the first knot a level piece of its own, whose area counts down from there.
        self.size = len(knots)
        arrays = (knots[:1], knots), (left[:1], right), (np.zeros(1), slope), (np.zeros(1), area)
        self.knots, self.right, self.slope, self.area = (types.Float64(np.concatenate(pair)) for pair in arrays)
        self.types = types

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

        run = b - a
        close = dr.abs(run) <= 1e-12 * (dr.abs(a) + dr.abs(b) + 1e-300)
        difference = (self._integral(b) - self._integral(a)) / dr.select(close, 1.0, run)
        return dr.maximum(dr.select(close, self._height(0.5 * (a + b)), difference), 0.0)

    def _height(self, v: Any) -> Any:
        import drjit as dr

        at, part = self._piece(v)
        return dr.gather(type(v), self.right, at) + part * dr.gather(type(v), self.slope, at)

    def _integral(self, v: Any) -> Any:
        import drjit as dr

        at, part = self._piece(v)
        right, slope = dr.gather(type(v), self.right, at), dr.gather(type(v), self.slope, at)
        return dr.gather(type(v), self.area, at) + part * (right + 0.5 * part * slope)


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

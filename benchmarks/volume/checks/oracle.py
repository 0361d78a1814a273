# SPDX-License-Identifier: GPL-3.0-or-later
"""The march in plain NumPy, and pictures that are known in closed form: the references for the fast march.

Nothing here shares code with the fast march: exact knots instead of tables, float64, SciPy's trilinear
interpolation, uniform midpoint steps, no bricks, no empty-space skipping, no early end.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.gradient import gradient_magnitude
from spectral_core.volume.transfer import TransferFunction

Array = NDArray[np.float64]
_AT_ONCE = 1 << 14
"""Places that are looked up at once: a few rays take as many steps together, which costs NumPy a tenth of the time."""


@dataclass(frozen=True)
class OracleImage:
    """``amounts`` (rays, K) and ``transmittance`` (rays,), float64."""

    amounts: Array
    transmittance: Array


def march_oracle(
    volume: ScalarVolume, transfer: TransferFunction, rays: tuple[Array, Array], step: float = 0.05, begin: float = 0.0
) -> OracleImage:
    """Composite along world-space ``rays`` (start, unit direction), each (n, 3), with steps of ``step`` voxels.

    Rays begin ``begin`` world units after their start (-inf for an orthographic camera).
    """
    start, direction = (np.reshape(part, (-1, 3)) for part in rays)
    origin = start @ volume.index_from_world[:3, :3].T + volume.index_from_world[:3, 3]
    along = direction @ volume.index_from_world[:3, :3].T  # index units per world unit
    near, far = _box(volume, origin, along, begin)
    count = max(1, int(np.ceil(np.max((far - near) * np.linalg.norm(along, axis=-1)) / step)))
    width = (far - near) / count
    gradient = gradient_magnitude(volume) if transfer.uses_gradient else None
    amounts = np.zeros((len(origin), len(transfer.materials)))
    transmittance = np.ones(len(origin))
    block = max(1, _AT_ONCE // len(origin))
    for i in range(0, count, block):
        middles = np.arange(i, min(i + block, count)) + 0.5
        points = (origin + (near + middles[:, None] * width)[..., None] * along).reshape(-1, 3)
        slopes = None if gradient is None else trilinear(gradient, points)
        extinction, source = transfer.curves(trilinear(volume, points), slopes)
        depth = extinction.sum(-1).reshape(-1, len(origin)) * width
        gain = np.where(depth > 1e-12, -np.expm1(-depth) / np.maximum(depth, 1e-300), 1.0)
        after = transmittance * np.exp(-np.cumsum(depth, axis=0))
        before = np.concatenate([transmittance[None], after[:-1]])
        amounts += np.einsum("ij,ijk->jk", before * width * gain, source.reshape(*depth.shape, -1))
        transmittance = after[-1]
    return OracleImage(amounts, transmittance)


def trilinear(volume: ScalarVolume, points: Array) -> Array:
    """Field value at index-space points (n, 3); level in the outer half voxel."""
    from scipy import ndimage

    return ndimage.map_coordinates(volume.data.astype(np.float64), points.T, order=1, mode="nearest")


def slab(extinction: float, emission: float, thickness: float) -> tuple[float, float]:
    """(amount, transmittance) through a homogeneous slab: (κ + ε)(1 - e^(-κL))/κ, or ε·L where κ = 0."""
    depth = extinction * thickness
    gain = thickness if depth == 0 else -math.expm1(-depth) / extinction
    return (extinction + emission) * gain, math.exp(-depth)


def ramp_transmittance(extinction_at_end: float, thickness: float) -> float:
    """Transmittance where extinction rises linearly from 0: exp(-κ₁·L/2)."""
    return math.exp(-0.5 * extinction_at_end * thickness)


def gaussian_transmittance(peak: float, sigma: float, offset: float) -> float:
    """Transmittance past a Gaussian blob of extinction at distance ``offset``: exp(-κ₀·σ·√(2π)·exp(-b²/2σ²))."""
    return math.exp(-peak * sigma * math.sqrt(2 * math.pi) * math.exp(-0.5 * (offset / sigma) ** 2))


def _box(volume: ScalarVolume, origin: Array, along: Array, begin: float) -> tuple[Array, Array]:
    with np.errstate(divide="ignore", invalid="ignore"):
        low = (-0.5 - origin) / along
        high = (np.array(volume.shape) - 0.5 - origin) / along
    # A ray that is parallel to a pair of faces lies between them along its whole length, or never.
    inside = (origin >= -0.5) & (origin <= np.array(volume.shape) - 0.5)
    parallel = along == 0
    first = np.where(parallel, np.where(inside, -np.inf, np.inf), np.minimum(low, high))
    last = np.where(parallel, np.where(inside, np.inf, -np.inf), np.maximum(low, high))
    near = np.maximum(first.max(-1), begin)
    far = last.min(-1)
    hit = far > near
    return np.where(hit, near, 0.0), np.where(hit, far, 0.0)

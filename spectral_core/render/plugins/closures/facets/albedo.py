# SPDX-License-Identifier: GPL-3.0-or-later
"""Albedos of rough surfaces for one bounce, as tables: the input of layering and energy compensation.

GGX with height-correlated masking (Heitz 2014, "Understanding the masking-shadowing function"), integrated over
visible normals (Heitz 2018, "Sampling the GGX distribution of visible normals"). Tables are (roughness, cosine) at
``nodes``, which lie densest where shares change fastest: at grazing angles and little roughness. ``alpha = roughness²``
as in Blender.
"""

from __future__ import annotations

from functools import cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating]

SIZE = 48
LAYERS = 12
"""Tables of a stack over the index of refraction, at even steps of √((n - 1) / (n + 1)) up to ``HIGHEST``."""
HIGHEST = 0.95
_POINTS = 1024
_SMALLEST_ALPHA, _SMALLEST_COSINE = 1e-3, 1e-3


def nodes() -> tuple[Array, Array]:
    """Roughness (SIZE,) and cosine (SIZE,) of rows and columns: the square and the fourth power of even steps.

    Between them a table is read linearly: with cosines at squares and even roughness a white mirror gave back 1.007 at
    89 degrees.
    """
    steps = np.linspace(0, 1, SIZE)
    return steps**2, steps**4


@cache
def conductor() -> Array:
    """Share (SIZE, SIZE) that a perfect rough mirror reflects in one bounce; the rest bounces between facets."""
    _, _, weights, _ = _reflected()
    return _not_below(weights.mean(axis=2, dtype=np.float64))


@cache
def dielectric(relative_ior: float) -> tuple[Array, Array]:
    """Shares (SIZE, SIZE) that a rough dielectric interface reflects, and reflects or transmits, in one bounce."""
    cosine, cosine_facet, weights, alpha = _reflected()
    fresnel = fresnel_dielectric(cosine_facet, relative_ior)
    # the transmitted direction's masking: Λ at the cosine of the refracted ray to the mean surface
    into, up = _refracted(relative_ior)
    lambda_i, lambda_o = _smith_lambda(cosine, alpha), _smith_lambda(np.abs(into), alpha)
    passing = np.where(up, 0.0, (1 + lambda_i) / (1 + lambda_i + lambda_o))
    reflected = (fresnel * weights).mean(axis=2, dtype=np.float64)
    total = reflected + ((1 - fresnel) * passing).mean(axis=2, dtype=np.float64)
    return _not_below(reflected), _not_below(total)


def _not_below(table: Array) -> Array:
    """The table, raised where it bends down: lines between its nodes lie nowhere below the truth.

    Energy that a table underestimates is given to the closure below a layer, or to light between facets; the sum would
    exceed 1.
    """
    raised = table.copy()
    for axis in (0, 1):
        bend = np.zeros_like(table)
        inner: list[slice] = [slice(None), slice(None)]
        inner[axis] = slice(1, -1)
        bend[tuple(inner)] = np.maximum(0.0, -np.diff(table, 2, axis=axis)) / 8
        # a cell's error is that of the larger bend at its ends
        for shift in (-1, 1):
            bend = np.maximum(bend, np.roll(bend, shift, axis=axis))
        raised += bend
    return np.minimum(raised, 1.0)


@cache
def facing_parts(count: int, lost: bool = False) -> tuple[Array, ...]:
    """Mean cosines (SIZE, SIZE) to facets of a rough mirror in ``count`` equal parts, the smallest cosines first.

    Each facet counts by the light that it reflects, or by the ``lost`` light that hits other facets.
    """
    _, facing, weights, _ = _reflected()
    weights = np.broadcast_to(weights, facing.shape)
    order = np.argsort(facing, axis=2)
    facing, weights = (np.take_along_axis(part, order, axis=2).astype(np.float64) for part in (facing, weights))
    weights = np.clip(1 - weights, 1e-6, None) if lost else weights
    total = np.maximum(weights.sum(axis=2, keepdims=True), 1e-12)
    before = np.cumsum(weights, axis=2) - weights
    ends = [np.clip(number / count * total - before, 0.0, weights) for number in range(count + 1)]
    parts = (count * (facing * (end - begin) / total).sum(axis=2) for begin, end in pairwise(ends))
    return tuple(np.clip(part, 0.0, 1.0) for part in parts)


def layer_iors() -> list[float]:
    """Indices of refraction of the tables of a stack."""
    return [index_at(float(place)) for place in np.linspace(0, 1, LAYERS)]


def place_of_index(ior: float) -> float:
    """Place of an index of refraction, or of its inverse, in [0, 1] between the first table of a stack and the last."""
    return float(np.sqrt(abs(ior - 1) / (ior + 1)) / HIGHEST)


def index_at(place: float) -> float:
    """Index of refraction at a place of ``place_of_index``."""
    squared = (HIGHEST * place) ** 2
    return max(float((1 + squared) / (1 - squared)), 1 + 1e-6)


def average(table: Array) -> Array:
    """Mean over the hemisphere (SIZE,), cosine-weighted: 2 ∫ E(μ) μ dμ."""
    steps = np.linspace(0, 1, SIZE)
    weights = steps**7  # μ = step⁴, so μ dμ = 4 step⁷ d step
    weights[-1] /= 2
    return np.asarray(table @ (weights / weights.sum()))


def fresnel_dielectric(cosine: Array, relative_ior: float) -> Array:
    """Unpolarized reflectance of an interface, ``relative_ior`` = inside over outside."""
    sine_squared = (1 - cosine**2) / relative_ior**2
    inner = np.sqrt(np.maximum(0.0, 1 - sine_squared))
    parallel = (relative_ior * cosine - inner) / (relative_ior * cosine + inner)
    across = (cosine - relative_ior * inner) / (cosine + relative_ior * inner)
    return np.asarray(np.where(sine_squared >= 1, 1.0, (parallel**2 + across**2) / 2))


def _smith_lambda(cosine: Array, alpha: Array) -> Array:
    squared = np.maximum(cosine**2, 1e-12)
    return np.asarray((np.sqrt(1 + alpha**2 * (1 - squared) / squared) - 1) / 2)


@cache
def _visible_normals() -> tuple[Array, Array, Array, Array, Array]:
    """Cosine and alpha of each table entry, and normals (x, y, z) drawn for it, all broadcast to (SIZE, SIZE, n)."""
    roughness, columns = nodes()
    alpha = np.maximum(roughness[:, None, None] ** 2, _SMALLEST_ALPHA)
    cosine = np.maximum(columns[None, :, None], _SMALLEST_COSINE)
    index = np.arange(_POINTS)
    u = ((index + 0.5) / _POINTS)[None, None, :]
    v = (index * 0.6180339887498949 % 1)[None, None, :]
    sine = np.sqrt(1 - cosine**2)
    view_x, view_z = alpha * sine, cosine
    length = np.hypot(view_x, view_z)
    view_x, view_z = view_x / length, view_z / length
    radius, turn = np.sqrt(u), 2 * np.pi * v
    first, second = radius * np.cos(turn), radius * np.sin(turn)
    share = (1 + view_z) / 2
    second = (1 - share) * np.sqrt(np.maximum(0.0, 1 - first**2)) + share * second
    third = np.sqrt(np.maximum(0.0, 1 - first**2 - second**2))
    # tangent frame of the stretched view (x, 0, z): across = (0, 1, 0), along = view × across
    normal_x = -view_z * second + view_x * third
    normal_y = first + 0 * third
    normal_z = view_x * second + view_z * third
    normal_x, normal_y = alpha * normal_x, alpha * normal_y
    length = np.sqrt(normal_x**2 + normal_y**2 + normal_z**2)
    return cosine, alpha, normal_x / length, normal_y / length, normal_z / length


@cache
def _reflected() -> tuple[Array, Array, Array, Array]:
    """Cosine of view, cosine to the facet, weight G2/G1 of the mirrored direction (0 below), alpha."""
    cosine, alpha, normal_x, _, normal_z = _visible_normals()
    facing = np.sqrt(1 - cosine**2) * normal_x + cosine * normal_z
    out_z = 2 * facing * normal_z - cosine
    lambda_i, lambda_o = _smith_lambda(cosine, alpha), _smith_lambda(out_z, alpha)
    weight = np.where(out_z > 0, (1 + lambda_i) / (1 + lambda_i + lambda_o), 0.0)
    # in single precision: every index of refraction is weighed over all of these
    cosine, facing, weight, alpha = (part.astype(np.float32) for part in (cosine, facing, weight, alpha))
    return cosine, np.clip(facing, 0, 1), weight, alpha


def _refracted(relative_ior: float) -> tuple[Array, Array]:
    """Cosine of the refracted direction to the mean surface (negative: below); True without one (total reflection)."""
    cosine, facing, _, _ = _reflected()
    normal_z = _visible_normals()[4].astype(np.float32)
    inside_squared = 1 - (1 - facing**2) / relative_ior**2
    total = inside_squared <= 0
    inner = np.sqrt(np.maximum(0.0, inside_squared))
    out_z = (facing / relative_ior - inner) * normal_z - cosine / relative_ior
    return out_z, total | (out_z >= 0)

# SPDX-License-Identifier: GPL-3.0-or-later
"""Geometry of the light dial: a selector's position among bulbs becomes a weight per light (thesis section 6.3.1)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spectral_core.checks import require_finite
from spectral_core.errors import InvalidInputError

Array = NDArray[np.float64]

MOST_BULBS = 64
COINCIDENT = 1e-9
"""Bulbs nearer than this share of the dial's extent count as coincident."""


def bulbs_on_polygon(count: int) -> Array:
    """Initial positions of bulbs: corners (count, 2) of a regular polygon of radius 1, the first at the top,
    clockwise.
    """
    if not isinstance(count, int | np.integer) or not 2 <= count <= MOST_BULBS:
        raise InvalidInputError(f"a dial has 2 to {MOST_BULBS} lights; got {count}")
    angles = np.pi / 2 - 2 * np.pi * np.arange(count) / count
    return np.stack([np.cos(angles), np.sin(angles)], axis=1)


def dial_weights(selector: ArrayLike, bulbs: ArrayLike, is_on: ArrayLike | None = None) -> Array:
    """Weights (..., n) of n bulbs at ``bulbs`` (..., n, 2) for a selector at (..., 2); leading axes broadcast.

    Eq. 6.1, normalized to sum 1: the weight of bulb i is the product over the other bulbs of the selector's distance to
    them, over bulb i's distance to them. It is 1 at the bulb and 0 at every other. ``is_on``: (..., n), all on by
    default; a bulb that is off has weight 0 and does not affect the others.

    The equation divides by the distance between bulbs. Definitions for the remaining cases:

    - Coincident bulbs (``COINCIDENT``) count as one and share its weight equally. The limit of the equation would give
      them all weight at every position except the other bulbs.
    - All bulbs off: all weights are 0, the only case in which they do not sum to 1. Nothing is lit.
    - Far away, the weights tend to those of the distances between the bulbs, because the selector is equally far from
      each.

    Raises InvalidInputError for shapes that do not fit, fewer than 1 or more than 64 bulbs, NaN or Inf.
    """
    at, places, on = _checked(selector, bulbs, is_on)
    scale = np.maximum(np.abs(at).max(axis=-1), np.abs(places).max(axis=(-1, -2)))
    scale = np.where(scale > 0, scale, 1.0)[..., None]  # keeps distances of huge and tiny dials in range
    at, places = at / scale, places / scale[..., None]

    between = _distance(places[..., :, None, :], places[..., None, :, :])
    extent = np.where(on[..., :, None] & on[..., None, :], between, 0.0).max(axis=(-1, -2), keepdims=True)
    same = between <= COINCIDENT * extent
    first_of_spot = on & ~np.tril(same & on[..., None, :], -1).any(axis=-1)
    others = first_of_spot[..., None, :] & ~same  # row i: the other positions in the product of bulb i

    with np.errstate(divide="ignore"):
        to_selector = np.log(_distance(at[..., None, :], places))
        apart = np.log(between)
    # In logarithms, so that 64 factors neither overflow nor vanish; a position at the selector is log 0 = -inf.
    exponents = np.where(others, to_selector[..., None, :], 0.0).sum(-1) - np.where(others, apart, 0.0).sum(-1)
    exponents = np.where(on, exponents, -np.inf)
    top = exponents.max(axis=-1, keepdims=True)
    weights = np.exp(exponents - np.where(np.isfinite(top), top, 0.0))
    weights = weights / np.maximum((same & on[..., None, :]).sum(axis=-1), 1)
    total = weights.sum(axis=-1, keepdims=True)
    return np.where(on, weights, 0.0) / np.where(total > 0, total, 1.0)


def _distance(first: Array, second: Array) -> Array:
    difference = first - second
    return np.hypot(difference[..., 0], difference[..., 1])


def _checked(selector: ArrayLike, bulbs: ArrayLike, is_on: ArrayLike | None) -> tuple[Array, Array, NDArray[np.bool_]]:
    at, places = np.asarray(selector, dtype=np.float64), np.asarray(bulbs, dtype=np.float64)
    if at.shape[-1:] != (2,) or places.ndim < 2 or places.shape[-1] != 2:
        raise InvalidInputError(
            f"the selector has shape {at.shape} and the bulbs {places.shape}; expected (..., 2) and (..., n, 2)"
        )
    if not 1 <= places.shape[-2] <= MOST_BULBS:
        raise InvalidInputError(f"a dial has 1 to {MOST_BULBS} bulbs; got {places.shape[-2]}")
    require_finite("the selector", at)
    require_finite("the bulbs", places)
    on = np.ones(places.shape[:-1], bool) if is_on is None else np.asarray(is_on, dtype=bool)
    if on.shape[-1:] != places.shape[-2:-1]:
        raise InvalidInputError(f"is_on has shape {on.shape} for {places.shape[-2]} bulbs; give one switch per bulb")
    batch = np.broadcast_shapes(at.shape[:-1], places.shape[:-2], on.shape[:-1])
    count = places.shape[-2]
    return (
        np.broadcast_to(at, (*batch, 2)),
        np.broadcast_to(places, (*batch, count, 2)),
        np.broadcast_to(on, (*batch, count)),
    )

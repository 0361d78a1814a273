# SPDX-License-Identifier: GPL-3.0-or-later
"""A hierarchy of clusters of items: among a million items, one is found with about a hundred weights.

Rows hold the data of a weight: items first, then clusters, then items at infinity. Up to ``EXACT`` items, the choice
computes the weight of every one. Above, each level has at most ``BRANCHES`` children per cluster, made by halving along
the longest side, so that neighbors share a cluster.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

EXACT = 128
"""Largest number of items for which every weight is computed."""
BRANCHES = 32
FAR_SUN, FAR_WORLD = -1.0, -2.0
"""Values in place of a radius: the first three numbers of a row are a direction, or have no meaning."""
LEAST_SHARE = 0.05
"""Least share of a cluster's light at a receiver: single items may face it although their mean direction does not."""


@dataclass(frozen=True, slots=True, eq=False)
class Rows:
    """Inputs of weights: ``centers`` (m, 3), ``radii`` (m,), ``strengths`` (m,) largest radiant intensity (or
    irradiance of what is far), ``axes`` (m, 3) and ``offsets`` (m,): the share of it along -d is
    clip(offset + axis · d, least, 1); ``least`` (m,); ``two_sided`` (m,): |axis · d| instead.
    """

    centers: Array
    radii: Array
    strengths: Array
    axes: Array
    offsets: Array
    least: Array
    two_sided: NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.centers)

    def take(self, index: NDArray[np.intp]) -> Rows:
        """Some rows, in an order."""
        return Rows(*(getattr(self, name)[index] for name in Rows.__slots__))

    @staticmethod
    def joined(parts: list[Rows]) -> Rows:
        """Rows one after the other."""
        return Rows(*(np.concatenate([getattr(part, name) for part in parts]) for name in Rows.__slots__))


@dataclass(frozen=True, slots=True, eq=False)
class Hierarchy:
    """``rows``: items in the order ``item_of_row``, clusters, far items. ``first``, ``count``: children of each row (0
    for items). ``parent``: -1 at the top. ``top``: first row and number of rows at the top. ``levels``: number of
    choices. ``row_of_item``: inverse of the order, far items included (they stay at the end).
    """

    rows: Rows
    row_of_item: NDArray[np.intp]
    item_of_row: NDArray[np.intp]
    first: NDArray[np.intp]
    count: NDArray[np.intp]
    parent: NDArray[np.intp]
    top: tuple[int, int]
    levels: int


def build(near: Rows, far: Rows, exact: int = EXACT) -> Hierarchy:
    """Clusters over more than ``exact`` ``near`` items, with ``far`` items beside the top level. Near items have the
    first numbers.
    """
    count = len(near)
    levels = 1
    if count > exact:
        while BRANCHES**levels < count:
            levels += 1
    # as few branches as the number of levels allows: each choice then computes about as many weights
    branches = count if levels == 1 else int(np.ceil(count ** (1 / levels)))
    order = np.arange(count) if levels == 1 else _order(near.centers, branches, levels)
    parts, firsts, counts = [near.take(order)], [np.zeros(count, np.intp)], [np.zeros(count, np.intp)]
    parents: list[NDArray[np.intp]] = []
    start, below = 0, parts[0]
    for _ in range(levels - 1):
        starts = np.arange(0, len(below), branches)
        sizes = np.diff(np.append(starts, len(below)))
        parents.append(start + len(below) + np.repeat(np.arange(len(starts)), sizes))
        firsts.append(start + starts)
        counts.append(sizes)
        start += len(below)
        below = clusters(below, starts, sizes)
        parts.append(below)
    parents.append(np.full(len(below) + len(far), -1, np.intp))
    extra = sum(len(part) for part in parts) - count
    parts.append(far)
    firsts.append(np.zeros(len(far), np.intp))
    counts.append(np.zeros(len(far), np.intp))
    far_items = count + np.arange(len(far))
    row_of_item = np.empty(count + len(far), np.intp)
    row_of_item[order] = np.arange(count)
    row_of_item[count:] = count + extra + np.arange(len(far))
    item_of_row = np.concatenate([order, np.full(extra, -1, np.intp), far_items])
    return Hierarchy(
        Rows.joined(parts),
        row_of_item,
        item_of_row,
        np.concatenate(firsts),
        np.concatenate(counts),
        np.concatenate(parents),
        (start, len(below) + len(far)),
        levels,
    )


def _order(centers: Array, branches: int, levels: int) -> NDArray[np.intp]:
    """Order of the items by halving along the longest side, in runs that fill whole clusters.

    All runs are halved together: one by one, twenty thousand triangles take a quarter of a second.
    """
    order = np.arange(len(centers))
    lows, highs, units = np.array([0]), np.array([len(centers)]), np.array([branches ** (levels - 1)])
    while True:
        for _ in range(levels):
            units = np.where((units > 1) & (highs - lows <= units), units // branches, units)
        goes_on = (highs - lows > units) & (highs - lows >= 3)
        if not goes_on.any():
            return order
        lows, highs, units = lows[goes_on], highs[goes_on], units[goes_on]
        sizes = highs - lows
        starts = np.cumsum(sizes) - sizes
        run = np.repeat(np.arange(len(sizes)), sizes)
        at = np.arange(len(run)) + (lows - starts)[run]
        places = centers[order[at]]
        sides = np.maximum.reduceat(places, starts, axis=0) - np.minimum.reduceat(places, starts, axis=0)
        along = places[np.arange(len(run)), np.argmax(sides, axis=1)[run]]
        order[at] = order[at][np.lexsort((along, run))]
        middles = lows + units * np.maximum(1, -(-sizes // units) // 2)
        lows, highs = np.concatenate([lows, middles]), np.concatenate([middles, highs])
        units = np.concatenate([units, units])


def clusters(below: Rows, starts: NDArray[np.intp], sizes: NDArray[np.intp]) -> Rows:
    """One row per run of rows: center weighted by strength, extent, and mean direction of emission."""
    add = lambda values: np.add.reduceat(values, starts, axis=0)  # noqa: E731
    strengths = add(below.strengths)
    share = below.strengths / np.maximum(np.repeat(strengths, sizes), 1e-300)
    centers = add(below.centers * share[:, None])
    apart = np.sum((below.centers - np.repeat(centers, sizes, axis=0)) ** 2, axis=1)
    radii = np.sqrt(np.maximum(add((apart + below.radii**2) * share), 0.0))
    # a lamp with two sides emits half along its axis and half against it: evenly in the mean
    steep = np.linalg.norm(below.axes, axis=1)
    gentle = np.where(below.two_sided | (steep > 1), 1 / np.maximum(steep, 1.0), 1.0) * ~below.two_sided
    axes = add(below.axes * (gentle * share)[:, None])
    lost = add(steep * gentle * share) - np.linalg.norm(axes, axis=1)
    even = np.where(below.two_sided, 0.5, np.clip(below.offsets, 0.0, 1.0))
    offsets = add(even * share) + 0.25 * np.maximum(lost, 0.0)
    return Rows(
        centers,
        radii,
        strengths,
        axes,
        offsets,
        np.full(len(starts), LEAST_SHARE),
        np.zeros(len(starts), bool),
    )

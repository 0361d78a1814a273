# SPDX-License-Identifier: GPL-3.0-or-later
"""The shape of the dial in pixels, without Blender: positions, the handle under the mouse, and snapping."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
Rectangle = tuple[float, float, float, float]
"""Left, bottom, width and height in pixels."""

MARGIN = 26.0
LABEL_ROOM = 22.0
LEFT_ROOM = 24.0
"""Unscaled pixels, more than at the other ends, for names at the left."""
SELECTOR_REACH, BULB_REACH = 8.0, 14.0
"""Unscaled pixels within which the mouse grabs a handle. Smaller for the selector: a bulb below it can be grabbed."""
EDGE = 8.0
"""Unscaled pixels beside the disc in an editor that is too narrow for the names."""
LEAST_UNIT, LARGEST_UNIT = 48.0, 110.0
"""Unscaled pixels."""
DISC = 1.25
"""Radius of the dial's disc in the dial's unit; new bulbs are placed at 1."""
OUTWARD = 0.35
"""Share of the unit beside the middle from which on texts begin, or end, at their bulb."""
SNAP_STEP = 0.25
SNAP_REACH = 0.12
SHARE_DIGITS = 3
"""Digits of a share in the tooltip, which states percent with one digit."""
CLICK_PIXELS = 4.0
"""A press with less movement is a click."""


@dataclass(frozen=True, slots=True)
class Target:
    """The handle at a press: the selector, bulb ``index``, or the disc, to which the selector then jumps."""

    kind: Literal["selector", "bulb", "disc"]
    index: int = -1


@dataclass(frozen=True, slots=True)
class DialShape:
    """A dial on screen: middle (x, y) and unit length in pixels, the interface's scale, and where the room ends.

    ``begin``, ``end``: left and right end of the part of the editor that nothing covers, in pixels.
    """

    x: float
    y: float
    unit: float
    scale: float = 1.0
    end: float = np.inf
    begin: float = -np.inf

    @classmethod
    def in_region(
        cls, width: float, height: float, *, left: float = 0.0, right: float = 0.0, bottom: float = 0.0,
        scale: float = 1.0,
    ) -> DialShape:  # fmt: skip
        """In the lower left corner of a region, past ``left`` pixels that a toolbar covers, and ``bottom`` ones that
        a header or an asset shelf covers. A sidebar covers ``right`` pixels at the other end. Between them the dial is
        smaller where the names beside it need the room, and without that room in a still narrower part.
        """
        unit, end = 0.13 * min(width - left, height - bottom), width - right
        beside = (MARGIN + LABEL_ROOM) * scale
        most = (end - left - 2 * beside - LEFT_ROOM * scale) / (2 * DISC)
        unit = float(np.clip(min(unit, most), LEAST_UNIT * scale, LARGEST_UNIT * scale))
        reach, edge = DISC * unit + beside, DISC * unit + EDGE * scale
        x = max(min(left + reach + LEFT_ROOM * scale, end - edge), left + edge)
        return cls(x, bottom + reach, unit, scale, end, left)

    @property
    def left(self) -> float:
        """Left end of the names beside the dial, in pixels."""
        return max(self.begin, self.x - DISC * self.unit - (MARGIN + LABEL_ROOM + LEFT_ROOM) * self.scale)

    @property
    def right(self) -> float:
        """Right end of the dial and the names beside it, in pixels from the left."""
        return self.x + DISC * self.unit + (MARGIN + LABEL_ROOM) * self.scale

    def pixels(self, places: ArrayLike) -> Array:
        """Pixels (..., 2) of coordinates on the dial."""
        return np.array([self.x, self.y]) + self.unit * np.asarray(places, dtype=np.float64)

    def label_start(self, x: float, width: float) -> float:
        """Where the text at a bulb begins: it leads outward, since neighbors at the top and bottom are nearly level."""
        outward = float(np.clip((x - self.x) / (OUTWARD * self.unit), -1.0, 1.0))
        return x - width * (1.0 - outward) / 2

    def place(self, pixel: ArrayLike) -> Array:
        """Coordinates (2,) on the dial of a pixel."""
        return (np.asarray(pixel, dtype=np.float64) - (self.x, self.y)) / self.unit

    def is_over(self, pixel: ArrayLike) -> bool:
        """True if a pixel is on the disc."""
        return bool(np.hypot(*self.place(pixel)) <= DISC)

    def target(self, pixel: ArrayLike, selector: ArrayLike, bulbs: ArrayLike) -> Target | None:
        """Find the handle under a pixel; None outside the dial. If bulbs coincide, the first one counts."""
        at = np.asarray(pixel, dtype=np.float64)
        if np.hypot(*(self.pixels(selector) - at)) <= SELECTOR_REACH * self.scale:
            return Target("selector")
        distances = np.hypot(*(self.pixels(np.reshape(bulbs, (-1, 2))) - at).T)
        if distances.size and distances.min() <= BULB_REACH * self.scale:
            return Target("bulb", int(distances.argmin()))
        return Target("disc") if self.is_over(at) else None


def on_disc(place: ArrayLike) -> Array:
    """The point (2,) of the disc that is nearest to ``place``: a view does not show what lies far outside the disc, and
    no mouse could bring it back.
    """
    at = np.asarray(place, dtype=np.float64)
    return np.array(at * min(1.0, DISC / max(float(np.hypot(*at)), DISC)))


def snapped(place: ArrayLike, bulbs: ArrayLike) -> Array:
    """Snap ``place`` to the nearest bulb, middle of two bulbs or middle of the dial within reach; else to a grid, but
    not beyond the rim of the disc.
    """
    at, spots = np.asarray(place, dtype=np.float64), np.reshape(np.asarray(bulbs, dtype=np.float64), (-1, 2))
    first, second = np.triu_indices(len(spots), 1)
    offered = np.concatenate([spots, (spots[first] + spots[second]) / 2, np.zeros((1, 2))])
    distances = np.hypot(*(offered - at).T)
    nearest = int(distances.argmin())
    if distances[nearest] <= SNAP_REACH:
        return np.array(offered[nearest])
    return on_disc(np.round(at / SNAP_STEP) * SNAP_STEP)


def tooltip(names: Sequence[str], shares: ArrayLike, intensity: float) -> list[str]:
    """Give one line per light with its share, strongest first; a warning if all are off."""
    parts = np.asarray(shares, dtype=np.float64)
    if not parts.size or not parts.any():
        return ["All bulbs are off: nothing is lit. Click one to switch it on."]
    return [
        f"{names[k] or 'ungrouped'}: {100 * parts[k]:.1f} %, × {intensity * parts[k]:.3f}"
        for k in strongest_first(parts)
    ]


def strongest_first(shares: ArrayLike) -> list[int]:
    """Indices of shares, the largest first. Those that read alike keep the given order, whatever their last digits."""
    return [int(k) for k in np.argsort(-np.asarray(shares).round(SHARE_DIGITS), kind="stable")]


def percent(share: float) -> str:
    """A share in whole percent; equal shares read alike, whatever their last digits: eight of them are 13 % each."""
    return f"{int(np.floor(100 * round(float(share), 6) + 0.5))} %"


def fitting(lines: Sequence[str], most: int) -> list[str]:
    """At most so many lines; the last one counts those that are left out."""
    if len(lines) <= max(most, 1):
        return list(lines)
    kept = max(most - 1, 0)
    return [*lines[:kept], f"and {len(lines) - kept} more"]


def without_overlaps(boxes: Sequence[Rectangle], order: Iterable[int], obstacles: Sequence[Rectangle] = ()) -> set[int]:
    """Indices of boxes that overlap no box before them in ``order``, and no obstacle."""
    kept: set[int] = set()
    for number in map(int, order):
        box = boxes[number]
        before = (boxes[other] for other in kept)
        if not any(overlap(box, other) for other in (*before, *obstacles)):
            kept.add(number)
    return kept


def overlap(one: Rectangle, other: Rectangle) -> bool:
    """True if two rectangles share a part of their areas."""
    across = min(one[0] + one[2], other[0] + other[2]) - max(one[0], other[0])
    return across > 0 and min(one[1] + one[3], other[1] + other[3]) - max(one[1], other[1]) > 0


def disc(middle: ArrayLike, radius: float, corners: int = 48) -> Array:
    """Triangles (3 · corners, 2) of a filled circle."""
    around = rim(middle, radius, corners)
    center = np.broadcast_to(np.asarray(middle, dtype=np.float64), (corners, 2))
    return np.stack([center, around[:-1], around[1:]], axis=1).reshape(-1, 2)


def rim(middle: ArrayLike, radius: float, corners: int = 48) -> Array:
    """Points (corners + 1, 2) of a circle, closed."""
    angles = 2 * np.pi * np.arange(corners + 1) / corners
    return np.asarray(middle, dtype=np.float64) + radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)

# SPDX-License-Identifier: GPL-3.0-or-later
"""Names and shares beside the bulbs of the dial, and the room that they take."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from bpy.types import PropertyGroup

from ..editing.dial.live import shares_of
from ..editing.dial.names import name_of
from .covered import dial_beside
from .dial_shape import LABEL_ROOM, DialShape, percent, strongest_first, without_overlaps
from .text import told_apart

FONT = 0
LABEL_POINTS = 11
BORDER = 8.0
"""Unscaled pixels around the outermost points: half of a line, and what a letter exceeds its text by."""
PAD = 4.0
"""Unscaled pixels of a plate around the text of a bulb."""
BULB_RADIUS = 8.0
"""Radius of a bulb in unscaled pixels."""
MOST_FULL_NAMES = 6
"""Most bulbs beside which whole names have room."""
NAME_ROOM = 90.0
"""Unscaled pixels of a name beside one of more bulbs."""
LONGEST_SHARE = "100 %"
Label = tuple[str, float, float]
"""Text, and the pixel of its lower left corner; no text where it would lie over another one."""


def right_end(area: Any, region: Any, dial: PropertyGroup, scale: float) -> float:
    """Right end of the dial and of all names beside it, in pixels from the left of a region."""
    shape = dial_beside(area, region, scale)
    return max((shape.right, *(end + PAD * scale for end in ends_of(labels_of(shape, dial, shares_of(dial)), scale))))


def ends_of(labels: Sequence[Label], scale: float) -> list[float]:
    """Pixel of the right end of each text."""
    import blf

    blf.size(FONT, LABEL_POINTS * scale)
    return [x + blf.dimensions(FONT, text)[0] for text, x, _ in labels if text]


def _names(shape: DialShape, dial: PropertyGroup) -> list[str]:
    """The names beside the bulbs: a few of them have the width of the view, more are shortened; the tooltip has all in
    full.
    """
    import blf

    names = [name_of(bulb) for bulb in dial.bulbs]
    blf.size(FONT, LABEL_POINTS * shape.scale)

    def width(text: str) -> float:
        return float(blf.dimensions(FONT, text)[0])

    room = shape.end - shape.left - 2 * BORDER * shape.scale - width(f"  {LONGEST_SHARE}")
    return told_apart(names, room if len(names) <= MOST_FULL_NAMES else min(room, NAME_ROOM * shape.scale), width)


def labels_of(shape: DialShape, dial: PropertyGroup, shares: np.ndarray) -> list[Label]:
    """Name and share of each bulb, beyond it as seen from the middle; of texts that overlap that of the larger share.

    Few texts are centered at their bulbs where all of them have room, else they lead outward as many do. Beside many
    bulbs a text that would lie over another bulb is left out, too.
    """
    names, is_crowded = _names(shape, dial), len(shares) > MOST_FULL_NAMES
    texts = [
        f"{name}  {percent(share)}" if bulb.is_on else f"{name}  off"
        for name, share, bulb in zip(names, shares, dial.bulbs, strict=True)
    ]
    # placed by their widest texts, so that no text changes its place while the dial is turned
    widest = [f"{name}  {LONGEST_SHARE}" for name in names]
    is_centered = not is_crowded and all(text for text, _, _ in _placed(shape, dial, shares, widest, outward=False))
    return _placed(shape, dial, shares, texts, outward=not is_centered, beside_bulbs=is_crowded)


def _placed(
    shape: DialShape, dial: PropertyGroup, shares: np.ndarray, texts: Sequence[str], *, outward: bool,
    beside_bulbs: bool = False,
) -> list[Label]:  # fmt: skip
    """Texts at their bulbs, centered or leading ``outward``, without those whose plates overlap others."""
    import blf

    found: list[Label] = []
    boxes, scale, pad = [], shape.scale, PAD * shape.scale
    spots = [shape.pixels(tuple(bulb.place)) for bulb in dial.bulbs]
    blf.size(FONT, LABEL_POINTS * scale)
    for text, at in zip(texts, spots, strict=True):
        width, height = blf.dimensions(FONT, text)
        above = 1.0 if at[1] >= shape.y - 1e-6 else -1.0
        start = shape.label_start(at[0], width) if outward else at[0] - width / 2
        start = min(start, shape.end - BORDER * scale - width)  # the sidebar, or the end of the editor
        start = max(start, shape.left + BORDER * scale)  # the tools, or the end of the editor
        found.append((text, float(start), float(at[1] + above * LABEL_ROOM * scale - height / 2)))
        boxes.append((found[-1][1] - pad, found[-1][2] - pad, width + 2 * pad, height + 2 * pad))  # the plate
    radius = BULB_RADIUS * scale
    bulbs = [(x - radius, y - radius, 2 * radius, 2 * radius) for x, y in spots] if beside_bulbs else []
    kept = without_overlaps(boxes, strongest_first(shares), bulbs)
    return [label if number in kept else ("", *label[1:]) for number, label in enumerate(found)]

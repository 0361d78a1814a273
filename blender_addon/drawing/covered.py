# SPDX-License-Identifier: GPL-3.0-or-later
"""What Blender's own bars and panels cover of a part of an editor, so that drawings begin beside them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from .dial_shape import LABEL_ROOM, MARGIN, DialShape, Rectangle, overlap

LEAST = 1
"""Width or height in pixels of a part that is hidden."""


@dataclass(frozen=True, slots=True)
class Covered:
    """Pixels of a region at its ends below the tools, the sidebar, the headers and the asset shelf.

    ``panel``: width and height, from its lower left corner, of the panel Adjust Last Operation; zero without it.
    """

    left: float = 0.0
    right: float = 0.0
    bottom: float = 0.0
    top: float = 0.0
    panel: tuple[float, float] = (0.0, 0.0)


def covered(area: Any, region: Any) -> Covered:
    """Find the bars and panels over a region. A quad view has four regions, and tools lie over those at the left."""
    left, right, bottom, top, panel = 0.0, 0.0, 0.0, 0.0, (0.0, 0.0)
    for each in area.regions:
        if each.type == "WINDOW" or min(each.width, each.height) <= LEAST:
            continue
        if not overlap(_rectangle(each), _rectangle(region)):
            continue
        if each.type == "HUD":
            panel = (each.x + each.width - region.x, each.y + each.height - region.y)
        elif each.alignment == "LEFT":
            left = max(left, each.x + each.width - region.x)
        elif each.alignment == "RIGHT":
            right = max(right, region.x + region.width - each.x)
        elif each.alignment == "BOTTOM":
            bottom = max(bottom, each.y + each.height - region.y)
        elif each.alignment == "TOP":
            top = max(top, region.y + region.height - each.y)
    return Covered(left, right, bottom, top, panel)


def dial_beside(area: Any, region: Any, scale: float) -> DialShape:
    """Position and size of the dial in a region of an area: beside the tools, and a panel that would cover it."""
    known = covered(area, region)
    width, height = known.panel
    left = max(known.left, width) if height - known.bottom > (MARGIN + LABEL_ROOM) * scale else known.left
    ends = {"left": left, "right": known.right, "bottom": known.bottom}
    return DialShape.in_region(region.width, region.height, **ends, scale=scale)


def _rectangle(region: Any) -> Rectangle:
    return region.x, region.y, region.width, region.height

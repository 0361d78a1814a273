# SPDX-License-Identifier: GPL-3.0-or-later
"""The divider of a split view with the name of the light on each side, over all that Blender draws in the view.

What the render engine draws lies below the passepartout of a camera view, which would darken names and divider.
"""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

from ..properties.render import ENGINE
from .after import AfterEditors
from .covered import Covered, covered
from .overlay import FONT, draw_line, draw_triangles, write
from .text import told_apart

PLATE = (0.0, 0.0, 0.0, 1.0)
"""Opaque: the noise of a bright picture would show through."""
NAME = (1.0, 1.0, 1.0, 1.0)


def is_split(space: Any, scene: Any) -> bool:
    """True if a 3D view shows the two sides of a split view."""
    return bool(
        space is not None
        and space.type == "VIEW_3D"
        and space.shading.type == "RENDERED"
        and scene.render.engine == ENGINE
        and scene.spectral.viewport.is_split
    )


def draw() -> None:
    """Called by Blender after it has drawn the 3D view."""
    import gpu

    context = bpy.context
    if not is_split(context.space_data, context.scene):
        return
    settings, region = context.scene.spectral.viewport, context.region
    middle = round(settings.divider * region.width)
    names = look_words(settings.look), look_words(settings.other)
    draw_divider(middle, region, names, context.preferences.system.ui_scale, covered(context.area, region))
    gpu.state.blend_set("NONE")


def look_words(look: Any) -> str:
    """Name of the light of a side of a split view."""
    named = {"COLUMN": look.column, "GROUP": look.group, "LAMP": look.lamp}
    return str(named.get(look.kind, "As It Is"))


def draw_divider(middle: int, region: Any, names: tuple[str, str], scale: float, known: Covered | None = None) -> None:
    """The line between the sides of a split view, and the name of the light of each.

    ``known``: what bars and panels cover of the region.
    """
    import blf

    known = known or Covered()
    ends = [(middle, known.bottom), (middle, region.height - known.top)]
    draw_line(np.array(ends, np.float32), (1.0, 1.0, 1.0, 0.9), 2 * scale)
    blf.size(FONT, 13 * scale)
    pad, room = 4 * scale, (known.left, region.width - known.right)
    shown = [_in_room(name, room[1] - room[0] - 4 * pad) for name in names]
    widths = tuple(float(blf.dimensions(FONT, name)[0]) for name in shown)
    spots = name_spots(middle, room, (widths[0], widths[1]), scale)
    for name, width, (start, base) in zip(shown, widths, spots, strict=True):
        base += known.bottom
        low, high, left, right = base - 6 * scale, base + 14 * scale, start - pad, start + width + pad
        corners = [(left, low), (right, low), (right, high), (left, low), (right, high), (left, high)]
        draw_triangles(np.array(corners, np.float32), PLATE)
        write(name, start, base, NAME)


def _in_room(name: str, room: float) -> str:
    """A name, shortened in its middle if it is wider; the size of its letters is set."""
    import blf

    return told_apart([name], room, lambda text: float(blf.dimensions(FONT, text)[0]))[0]


def name_spots(
    middle: float, ends: tuple[float, float], widths: tuple[float, float], scale: float
) -> list[tuple[float, float]]:
    """Lower left corner of the names beside the divider, between the ends of what is visible of a region.

    A name without room on its side is above the other one.
    """
    pad, base = 8 * scale, 24 * scale
    wanted = (middle - widths[0] - 2 * pad, middle + 2 * pad)
    starts = [
        max(min(start, ends[1] - width - pad), ends[0] + pad) for start, width in zip(wanted, widths, strict=True)
    ]
    overlaps = starts[0] + widths[0] + pad > starts[1]
    return [(starts[0], base), (starts[1], base + 26 * scale if overlaps else base)]


_after = AfterEditors(draw, bpy.types.SpaceView3D)


def register() -> None:
    """Draw after the 3D view."""
    _after.begin()


def unregister() -> None:
    """Remove the drawing."""
    _after.end()

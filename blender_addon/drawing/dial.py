# SPDX-License-Identifier: GPL-3.0-or-later
"""The light dial over the 3D view and the image editor: disc, bulbs as bright as their share, selector, tooltip.

It is drawn only while Blender draws. Positions come from ``dial_shape``, which the mouse handling uses too.
"""

import bpy
import numpy as np
from bpy.types import Area, PropertyGroup, Region

from ..editing.dial.live import shares_of
from .dial_shape import DISC, LABEL_ROOM, DialShape, disc, rim, tooltip
from .overlay import FONT, draw_line, draw_triangles, write
from .text import told_apart

DISC_COLOR = (0.07, 0.07, 0.08, 0.80)
RIM_COLOR = (1.0, 1.0, 1.0, 0.25)
SPOKE_COLOR = (1.0, 1.0, 1.0, 0.10)
TEXT = (1.0, 1.0, 1.0, 0.85)
FAINT = (1.0, 1.0, 1.0, 0.40)
WARNING = (1.0, 0.55, 0.25, 1.0)
SELECTOR = (1.0, 1.0, 1.0, 1.0)

MOST_FULL_NAMES = 6
"""Most bulbs beside which whole names have room."""
NAME_ROOM = 90.0
"""Unscaled pixels of a name beside one of more bulbs."""
SPACES = (bpy.types.SpaceView3D, bpy.types.SpaceImageEditor)
hovered = {"area": 0}
"""``as_pointer`` of the area in which the mouse is over the dial; the tooltip is shown there."""
_handlers: list = []


def shape_in(area: Area, region: Region) -> DialShape:
    """Position and size of the dial in the main region of an area."""
    tools = sum(each.width for each in area.regions if each.type == "TOOLS" and each.alignment == "LEFT")
    scale = bpy.context.preferences.system.ui_scale
    return DialShape.in_region(region.width, region.height, left=tools, scale=scale)


def draw() -> None:
    """Called by Blender after it has drawn an editor."""
    import gpu

    dial = bpy.context.scene.spectral.dial
    if not dial.show or not len(dial.bulbs):
        return
    area = bpy.context.area
    shape = shape_in(area, bpy.context.region)
    shares = shares_of(dial)
    _draw_plate(shape, dial)
    for bulb, name, share in zip(dial.bulbs, _names(shape, dial), shares, strict=True):
        _draw_bulb(shape, bulb, name, float(share), is_crowded=len(shares) > MOST_FULL_NAMES)
    _draw_selector(shape, dial)
    if not shares.any():
        write("All bulbs are off", *_below(shape), WARNING)
    elif hovered["area"] == area.as_pointer():
        _draw_tooltip(shape, tooltip([bulb.name for bulb in dial.bulbs], shares, dial.intensity))
    gpu.state.blend_set("NONE")


def _below(shape: DialShape) -> tuple[float, float]:
    return shape.x - DISC * shape.unit, shape.y - DISC * shape.unit - 20 * shape.scale


def _draw_plate(shape: DialShape, dial: PropertyGroup) -> None:
    middle = (shape.x, shape.y)
    draw_triangles(disc(middle, DISC * shape.unit, 96), DISC_COLOR)
    draw_line(rim(middle, DISC * shape.unit, 96), RIM_COLOR, 1.5 * shape.scale)
    at = shape.pixels(tuple(dial.selector))
    for bulb in dial.bulbs:
        if bulb.is_on:
            draw_line(np.array([at, shape.pixels(tuple(bulb.place))]), SPOKE_COLOR, 1.0 * shape.scale)


def _names(shape: DialShape, dial: PropertyGroup) -> list[str]:
    """The names beside the bulbs: in full for a few of them, else shortened; the tooltip has them in full."""
    import blf

    names = [bulb.name or "ungrouped" for bulb in dial.bulbs]
    if len(names) <= MOST_FULL_NAMES:
        return names
    blf.size(FONT, 11 * shape.scale)
    return told_apart(names, NAME_ROOM * shape.scale, lambda text: float(blf.dimensions(FONT, text)[0]))


def _draw_bulb(shape: DialShape, bulb: PropertyGroup, name: str, share: float, *, is_crowded: bool) -> None:
    """Draw a bulb with a brightness by its share, in the color of its light; one that is off is an empty ring."""
    import blf

    at, scale = shape.pixels(tuple(bulb.place)), shape.scale
    tint = np.clip(bulb.color[:], 0.0, 1.0)
    if bulb.is_on:
        for size, strength in ((17.0, 0.18), (13.0, 0.30)):
            draw_triangles(disc(at, size * scale * (0.5 + share / 2)), (*tint, strength * min(1.0, share + 0.15)))
        draw_triangles(disc(at, 8 * scale), (*(tint * (0.25 + 0.75 * min(share, 1.0) ** 0.5)), 1.0))
    draw_line(rim(at, 8 * scale), (*tint, 1.0) if bulb.is_on else FAINT, 1.5 * scale)
    blf.size(FONT, 11 * scale)
    label = f"{name}  {100 * share:.0f} %" if bulb.is_on else f"{name}  off"
    width, height = blf.dimensions(FONT, label)
    above = 1.0 if at[1] >= shape.y - 1e-6 else -1.0
    y = at[1] + above * LABEL_ROOM * scale - height / 2
    start = shape.label_start(at[0], width) if is_crowded else at[0] - width / 2
    write(label, start, y, TEXT if bulb.is_on else FAINT)


def _draw_selector(shape: DialShape, dial: PropertyGroup) -> None:
    at, scale = shape.pixels(tuple(dial.selector)), shape.scale
    draw_line(rim(at, 5 * scale), (0.0, 0.0, 0.0, 0.8), 4.0 * scale)
    draw_line(rim(at, 5 * scale), SELECTOR, 2.0 * scale)
    for step in ((1, 0), (-1, 0), (0, 1), (0, -1)):
        draw_line(at + np.outer((5 * scale, 10 * scale), step), SELECTOR, 2 * scale)


def _draw_tooltip(shape: DialShape, lines: list[str]) -> None:
    import blf

    scale = shape.scale
    blf.size(FONT, 12 * scale)
    row = 17 * scale
    width = max(blf.dimensions(FONT, line)[0] for line in lines) + 20 * scale
    left = shape.x + DISC * shape.unit + 60 * scale
    low = shape.y - row * len(lines) / 2 - 8 * scale
    corners = np.array([(left, low), (left + width, low), (left + width, low + row * len(lines) + 16 * scale),
                        (left, low + row * len(lines) + 16 * scale)])  # fmt: skip
    draw_triangles(corners[[0, 1, 2, 0, 2, 3]], DISC_COLOR)
    for number, line in enumerate(reversed(lines)):
        write(line, left + 10 * scale, low + 12 * scale + number * row, TEXT)


def register() -> None:
    """Draw after the editors that show pictures."""
    if not bpy.app.background:
        _handlers.extend((space, space.draw_handler_add(draw, (), "WINDOW", "POST_PIXEL")) for space in SPACES)


def unregister() -> None:
    """Remove the drawing."""
    for space, handler in _handlers:
        space.draw_handler_remove(handler, "WINDOW")
    _handlers.clear()

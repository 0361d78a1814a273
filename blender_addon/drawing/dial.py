# SPDX-License-Identifier: GPL-3.0-or-later
"""The light dial over the 3D view and the image editor: disc, bulbs as bright as their share, selector, tooltip.

It is drawn only while Blender draws. Positions come from ``dial_shape``, which the mouse handling uses too.
"""

from collections.abc import Sequence

import bpy
import numpy as np
from bpy.types import Area, PropertyGroup, Region

from ..editing.dial.live import shares_of
from ..editing.dial.names import name_of
from .after import AfterEditors
from .covered import covered, dial_beside
from .dial_labels import BORDER, BULB_RADIUS, LABEL_POINTS, PAD, Label, ends_of, labels_of
from .dial_shape import DISC, DialShape, Rectangle, disc, fitting, rim, tooltip
from .kept import Box, Kept
from .overlay import FONT, Color, draw_line, draw_triangles, write

DISC_COLOR = (0.07, 0.07, 0.08, 0.80)
TOOLTIP_COLOR = (0.05, 0.05, 0.06, 0.97)
"""Nearly opaque: the tooltip lies over plots and names, and a seventh of a bright picture is a middle gray."""
LABEL_COLOR = (0.05, 0.05, 0.06, 0.97)
RIM_COLOR = (1.0, 1.0, 1.0, 0.25)
SPOKE_COLOR = (1.0, 1.0, 1.0, 0.10)
TEXT = (1.0, 1.0, 1.0, 0.85)
FAINT = (1.0, 1.0, 1.0, 0.40)
WARNING = (1.0, 0.55, 0.25, 1.0)
SELECTOR = (1.0, 1.0, 1.0, 1.0)
TOOLTIP_POINTS, WARNING_POINTS = 12, 11
TOOLTIP_ROW = 17
"""Height of a line in unscaled pixels."""
ALL_OFF = "All bulbs are off"
KEPT = Kept()

hovered = {"region": 0}
"""``as_pointer`` of the region in which the mouse is over the dial; the tooltip is shown there."""
_drawn: dict[int, DialShape] = {}
"""Where the dial was drawn last, by the ``as_pointer`` of the region."""


def shape_in(area: Area, region: Region) -> DialShape:
    """Position and size of the dial in a region of an area."""
    return dial_beside(area, region, bpy.context.preferences.system.ui_scale)


def is_elsewhere(area: Area) -> bool:
    """True if a dial of an area was drawn where it does not belong any more.

    Blender does not draw an editor again when its panel of the last operation is opened or closed.
    """
    parts = [each for each in area.regions if each.type == "WINDOW" and each.as_pointer() in _drawn]
    return any(_drawn[each.as_pointer()] != shape_in(area, each) for each in parts)


def draw() -> None:
    """Called by Blender after it has drawn an editor."""
    dial = bpy.context.scene.spectral.dial
    if not dial.show or not len(dial.bulbs):
        return
    area, region = bpy.context.area, bpy.context.region
    shape = _drawn[region.as_pointer()] = shape_in(area, region)
    shares = shares_of(dial)
    labels = labels_of(shape, dial, shares)
    lines: list[str] = []
    plate = (0.0, 0.0, 0.0, 0.0)
    if shares.any() and hovered["region"] == region.as_pointer():
        lines = tooltip([name_of(bulb) for bulb in dial.bulbs], shares, dial.intensity)
        known = covered(area, region)
        room = (0.0, known.bottom, region.width - known.right, region.height - known.top)
        lines = fitting(lines, int((room[3] - room[1]) / (TOOLTIP_ROW * shape.scale)) - 2)
        plate = _tooltip_plate(shape, lines, labels, room)
    bulbs = [(bulb.is_on, tuple(bulb.color), tuple(bulb.place)) for bulb in dial.bulbs]
    content = (shape, tuple(shares), tuple(dial.selector), tuple(bulbs), tuple(labels), tuple(lines), plate)
    box = Box.around(_reach(shape, labels, plate), BORDER * shape.scale, (region.width, region.height))
    KEPT.draw(content, box, lambda: _paint(shape, dial, shares, labels, lines, plate))


def _paint(
    shape: DialShape, dial: PropertyGroup, shares: np.ndarray, labels: Sequence[Label], lines: Sequence[str],
    plate: Rectangle,
) -> None:  # fmt: skip
    import blf
    import gpu

    _draw_plate(shape, dial)
    for bulb, share, label in zip(dial.bulbs, shares, labels, strict=True):
        _draw_bulb(shape, bulb, float(share), label)
    _draw_selector(shape, dial)
    if not shares.any():
        blf.size(FONT, WARNING_POINTS * shape.scale)
        _write_on_plate((ALL_OFF, *_below(shape)), WARNING, shape.scale)
    elif lines:
        _draw_tooltip(shape, lines, plate)
    gpu.state.blend_set("NONE")


def _reach(shape: DialShape, labels: Sequence[Label], plate: Rectangle) -> list[tuple[float, float]]:
    """Corners (n, 2) of all that is drawn."""
    import blf

    radius = DISC * shape.unit
    corners = [(shape.x - radius, shape.y - radius), (shape.x + radius, shape.y + radius), _below(shape)]
    for text, x, y in labels:
        blf.size(FONT, LABEL_POINTS * shape.scale)
        width, height = blf.dimensions(FONT, text)
        corners += [(x, y), (x + width, y + height)]
    left, low, width, height = plate
    if width:
        corners += [(left, low), (left + width, low + height)]
    blf.size(FONT, WARNING_POINTS * shape.scale)
    x, y = _below(shape)
    return [*corners, (x + blf.dimensions(FONT, ALL_OFF)[0], y)]


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


def _draw_bulb(shape: DialShape, bulb: PropertyGroup, share: float, label: Label) -> None:
    """Draw a bulb with a brightness by its share, in the color of its light; one that is off is an empty ring."""
    import blf

    at, scale = shape.pixels(tuple(bulb.place)), shape.scale
    tint = np.clip(bulb.color[:], 0.0, 1.0)
    if bulb.is_on:
        for size, strength in ((17.0, 0.18), (13.0, 0.30)):
            draw_triangles(disc(at, size * scale * (0.5 + share / 2)), (*tint, strength * min(1.0, share + 0.15)))
        draw_triangles(disc(at, BULB_RADIUS * scale), (*(tint * (0.25 + 0.75 * min(share, 1.0) ** 0.5)), 1.0))
    draw_line(rim(at, BULB_RADIUS * scale), (*tint, 1.0) if bulb.is_on else FAINT, 1.5 * scale)
    if label[0]:
        blf.size(FONT, LABEL_POINTS * scale)
        _write_on_plate(label, TEXT if bulb.is_on else FAINT, scale)


def _write_on_plate(label: Label, color: Color, scale: float) -> None:
    """A text in the present size on a dark plate: a picture below it may be as bright as the text."""
    import blf

    text, x, y = label
    width, height = blf.dimensions(FONT, text)
    left, right, low, high = x - PAD * scale, x + width + PAD * scale, y - PAD * scale, y + height + PAD * scale
    corners = [(left, low), (right, low), (right, high), (left, low), (right, high), (left, high)]
    draw_triangles(np.array(corners), LABEL_COLOR)
    write(text, x, y, color)


def _draw_selector(shape: DialShape, dial: PropertyGroup) -> None:
    at, scale = shape.pixels(tuple(dial.selector)), shape.scale
    draw_line(rim(at, 5 * scale), (0.0, 0.0, 0.0, 0.8), 4.0 * scale)
    draw_line(rim(at, 5 * scale), SELECTOR, 2.0 * scale)
    for step in ((1, 0), (-1, 0), (0, 1), (0, -1)):
        draw_line(at + np.outer((5 * scale, 10 * scale), step), SELECTOR, 2 * scale)


def _tooltip_plate(shape: DialShape, lines: Sequence[str], labels: Sequence[Label], room: Rectangle) -> Rectangle:
    """The tooltip's plate: beyond the names at the right, else above them; within ``room`` (left, low, right, high)."""
    import blf

    scale = shape.scale
    ends = ends_of(labels, scale)
    blf.size(FONT, TOOLTIP_POINTS * scale)
    height = TOOLTIP_ROW * scale * len(lines) + 16 * scale
    width = max(blf.dimensions(FONT, line)[0] for line in lines) + 20 * scale
    left = max(shape.x + DISC * shape.unit + 60 * scale, max(ends, default=0.0) + 12 * scale)
    low, border = shape.y - height / 2, BORDER * scale
    if left + width > room[2] - border:
        tops = [y + (LABEL_POINTS + BORDER) * scale for text, _, y in labels if text]
        left, low = shape.left + border, max((shape.y + DISC * shape.unit + border, *tops))
    left = max(min(left, room[2] - border - width), room[0] + border)
    low = max(min(low, room[3] - border - height), room[1] + border)
    return left, low, width, height


def _draw_tooltip(shape: DialShape, lines: Sequence[str], plate: Rectangle) -> None:
    import blf

    left, low, width, height = plate
    corners = np.array([(left, low), (left + width, low), (left + width, low + height), (left, low + height)])
    draw_triangles(corners[[0, 1, 2, 0, 2, 3]], TOOLTIP_COLOR)
    blf.size(FONT, TOOLTIP_POINTS * shape.scale)
    for number, line in enumerate(reversed(lines)):
        write(line, left + 10 * shape.scale, low + (12 + number * TOOLTIP_ROW) * shape.scale, TEXT)


_after = AfterEditors(draw, bpy.types.SpaceView3D, bpy.types.SpaceImageEditor)


def register() -> None:
    """Draw after the editors that show pictures."""
    _after.begin()


def unregister() -> None:
    """Remove the drawing."""
    _after.end()
    _drawn.clear()
    KEPT.forget()

# SPDX-License-Identifier: GPL-3.0-or-later
"""The palette's spectra over the 3D view: all lights in one plot, all materials in another, the selected ones thick.

Only this module uses the graphics card, only while Blender draws, and the geometry comes from ``curve_plot``.
"""

from collections.abc import Sequence

import bpy
import numpy as np

from ..translate.spectra.stored import stored_samples
from .after import AfterEditors
from .covered import Covered, covered
from .curve_image import value_range
from .curve_plot import Array, Plot, side_by_side
from .dial_labels import FONT, right_end
from .kept import Box, Kept

MARGIN = 16.0
Color = tuple[float, ...]
"""Red, green, blue and alpha."""
Curve = tuple[str, Array, Array]
"""Name, wavelengths and values."""
BACKGROUND = (0.06, 0.06, 0.07, 0.94)
TICK = (1.0, 1.0, 1.0, 0.14)
TEXT = (1.0, 1.0, 1.0, 0.75)
DISTINCT_COLORS = (
    (0.95, 0.95, 0.95), (0.90, 0.62, 0.00), (0.34, 0.71, 0.91), (0.00, 0.72, 0.52), (0.94, 0.89, 0.26),
    (0.25, 0.55, 0.95), (0.95, 0.45, 0.15), (0.90, 0.55, 0.75),
)  # fmt: skip
"""After Okabe and Ito 2008, brightened for a dark background."""

KEPT = Kept()


def draw() -> None:
    """Called by Blender after it has drawn the 3D view."""
    palette = bpy.context.scene.spectral.palette
    if not palette.show_curves or not len(palette.lights):
        return
    region, scale = bpy.context.region, bpy.context.preferences.system.ui_scale
    known = covered(bpy.context.area, region)
    sides = [
        ("illuminant", palette.lights, palette.active_column),
        ("reflectance", palette.materials, palette.active_row),
    ]
    curves = [[(entry.name, *stored_samples(entry.result)) for entry in entries] for _, entries, _ in sides]
    ranges = [_range(known, kind) for known, (kind, _, _) in zip(curves, sides, strict=True)]
    room = (region.width - known.right, region.height - known.bottom)
    plots = side_by_side(room, ranges, MARGIN * scale, _left(known, scale), known.bottom)
    if not plots:
        return
    box = Box.around(np.concatenate([plot.corners() for plot in plots]), 1.0, (region.width, region.height))
    shown = tuple(tuple((name, x.tobytes(), y.tobytes()) for name, x, y in known) for known in curves)
    content = (tuple(plots), shown, tuple(active for _, _, active in sides), scale)
    KEPT.draw(content, box, lambda: _paint(plots, curves, [active for _, _, active in sides], scale))


def _paint(plots: Sequence[Plot], curves: Sequence[Sequence[Curve]], active: Sequence[int], scale: float) -> None:
    import gpu

    for plot, known, selected in zip(plots, curves, active, strict=False):
        _draw_plot(plot, known, selected, scale)
    gpu.state.blend_set("NONE")


def _left(known: Covered, scale: float) -> float:
    """Pixels on the left that tools, the panel of the last operation, or the dial cover."""
    dial, covering = bpy.context.scene.spectral.dial, max(known.left, known.panel[0])
    if not dial.show or not len(dial.bulbs):
        return covering
    return max(covering, right_end(bpy.context.area, bpy.context.region, dial, scale))


def _range(known: Sequence[Curve], kind: str) -> tuple[float, float]:
    values = [each for _, _, each in known if each.size]
    low, high = value_range(np.concatenate(values) if values else np.zeros(1), kind)
    return low, high


def line_color(number: int) -> tuple[float, float, float, float]:
    """Color of a curve by its index in the table, distinguishable by color-blind observers; the spectra's own colors
    are made equal by a palette.
    """
    return (*DISTINCT_COLORS[number % len(DISTINCT_COLORS)], 1.0)


def _draw_plot(plot: Plot, curves: Sequence[Curve], active: int, scale: float) -> None:
    """Plate, axes, curves and, within the plate, the names in the colors of their curves."""
    import blf

    draw_triangles(plot.corners(), BACKGROUND)
    inner = plot.within(left=40 * scale, bottom=18 * scale, right=8 * scale, top=30 * scale)
    blf.size(FONT, 11 * scale)
    for ends in inner.rules():
        draw_line(ends, TICK, 1.0)
    for _, ends in inner.ticks():
        draw_line(ends, TICK, 1.0)
    order = sorted(range(len(curves)), key=lambda number: number == active)  # the selected one on top
    for number in order:
        _, wavelengths, values = curves[number]
        if wavelengths.size:
            draw_line(inner.line(wavelengths, values), line_color(number), (3.0 if number == active else 1.6) * scale)
    for mark, ends in inner.ticks():  # after the curves, which would cover the numbers
        _write_centered(f"{mark}", ends[0, 0], plot.y + 4 * scale)
    for value, ends in zip((inner.low, inner.high), inner.rules(), strict=True):
        text = f"{value:.2g}"
        write(text, inner.x - blf.dimensions(FONT, text)[0] - 5 * scale, ends[0, 1] - 4 * scale, TEXT)
    write("nm", inner.x + inner.width - blf.dimensions(FONT, "nm")[0], plot.y + 4 * scale, TEXT)
    _write_names(plot, curves, scale)


def _write_centered(text: str, x: float, y: float) -> None:
    import blf

    write(text, x - blf.dimensions(FONT, text)[0] / 2, y, TEXT)


def _write_names(plot: Plot, curves: Sequence[Curve], scale: float) -> None:
    """Names along the top of the plate; names without room are counted."""
    import blf

    x, y, end = plot.x + 8 * scale, plot.y + plot.height - 15 * scale, plot.x + plot.width - 8 * scale
    for number, (name, _, _) in enumerate(curves):
        rest = f"+{len(curves) - number}"
        last = number == len(curves) - 1
        if x + blf.dimensions(FONT, name)[0] + (0 if last else blf.dimensions(FONT, rest)[0] + 12 * scale) > end:
            write(rest, x, y, TEXT)
            return
        write(name, x, y, line_color(number))
        x += blf.dimensions(FONT, name)[0] + 12 * scale


def write(text: str, x: float, y: float, color: Color) -> None:
    """Text with its lower left corner at a pixel, in the present size of ``blf``."""
    import blf

    blf.color(FONT, *color)
    blf.position(FONT, x, y, 0)
    blf.draw(FONT, text)


def draw_triangles(points: Array, color: Color) -> None:
    """Triangles (3n, 2) in pixels, of one color."""
    import gpu
    from gpu_extras.batch import batch_for_shader

    gpu.state.blend_set("ALPHA")  # each time: drawing text resets it
    shader = gpu.shader.from_builtin("UNIFORM_COLOR")
    shader.uniform_float("color", color)
    batch_for_shader(shader, "TRIS", {"pos": points.astype(np.float32)}).draw(shader)


def draw_line(points: Array, color: Color, width: float) -> None:
    """Line through points (n, 2) in pixels."""
    import gpu
    from gpu_extras.batch import batch_for_shader

    gpu.state.blend_set("ALPHA")  # each time: drawing text resets it
    shader = gpu.shader.from_builtin("POLYLINE_UNIFORM_COLOR")
    shader.uniform_float("viewportSize", gpu.state.viewport_get()[2:])
    shader.uniform_float("lineWidth", width)
    shader.uniform_float("color", color)
    flat = np.concatenate([points, np.zeros((len(points), 1))], axis=1).astype(np.float32)
    batch_for_shader(shader, "LINE_STRIP", {"pos": flat}).draw(shader)


_after = AfterEditors(draw, bpy.types.SpaceView3D)


def register() -> None:
    """Draw after the 3D view."""
    _after.begin()


def unregister() -> None:
    """Remove the drawing."""
    _after.end()
    KEPT.forget()

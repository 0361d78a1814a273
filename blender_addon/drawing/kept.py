# SPDX-License-Identifier: GPL-3.0-or-later
"""Drawings over an editor that are painted once and shown again as one rectangle, until their content changes.

A dial or a plot has dozens of lines and texts, each of which is a call of the graphics driver, in each redraw of the
editor: also in those of a picture that is dragged.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Hashable
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

MOST = 6
"""Drawings that are kept of one kind: editors of several sizes show the same dial."""
VERTEX = "void main() { at = texCoord; gl_Position = ModelViewProjectionMatrix * vec4(pos, 0.0, 1.0); }"
FRAGMENT = "void main() { fragColor = texture(image, at); }"
"""A shader reads linear light from a texture of format sRGB, and writes linear light to an editor, which has it, too.
Blender's own shaders for textures expect display colors.
"""
OWN_OFFSET = -0.01
"""Blender shifts the coordinates of a region's pixels by this, so that lines at whole numbers have one pixel."""


@dataclass(frozen=True, slots=True)
class Box:
    """Whole pixels of a region that a drawing may cover: (x, y) the lower left corner."""

    x: int
    y: int
    width: int
    height: int

    @classmethod
    def around(cls, points: Any, margin: float, region: tuple[int, int]) -> Box:
        """All ``points`` (n, 2) with a margin, within a region of (width, height) pixels; maybe empty."""
        every = np.asarray(points, dtype=np.float64)
        low = np.clip(np.floor(every.min(axis=0) - margin), 0, region).astype(int)
        high = np.clip(np.ceil(every.max(axis=0) + margin), 0, region).astype(int)
        return cls(int(low[0]), int(low[1]), int(high[0] - low[0]), int(high[1] - low[1]))


class Kept:
    """The last drawings of one kind, by content."""

    def __init__(self) -> None:
        self._painted: OrderedDict[Hashable, tuple[Any, Any]] = OrderedDict()

    def draw(self, content: Hashable, box: Box, paint: Callable[[], None]) -> None:
        """Show what ``paint`` draws in ``box``. It is called only for a ``content`` that is not kept.

        ``content``: all that the drawing depends on, besides its box. Blender must be drawing.
        """
        if box.width < 1 or box.height < 1:
            return
        key = (content, box)
        if key not in self._painted:
            found = _painted(box, paint)
            if found is None:
                paint()
                return
            self._painted[key] = found
            while len(self._painted) > MOST:
                self._painted.popitem(last=False)
        self._painted.move_to_end(key)
        _show(*self._painted[key])

    def forget(self) -> None:
        """Free the memory of the graphics card."""
        self._painted.clear()


def _painted(box: Box, paint: Callable[[], None]) -> tuple[Any, Any] | None:
    """The drawing on the graphics card and the rectangle that shows it; None if the card has no room."""
    import gpu
    from gpu_extras.batch import batch_for_shader
    from mathutils import Matrix

    try:  # in the format of the editor itself, whose translucent colors are blended in linear light
        picture = gpu.types.GPUTexture((box.width, box.height), format="SRGB8_A8")
        target = gpu.types.GPUFrameBuffer(color_slots=picture)
    except (RuntimeError, ValueError):
        return None
    with target.bind(), gpu.matrix.push_pop(), gpu.matrix.push_pop_projection():
        gpu.state.active_framebuffer_get().clear(color=(0.0, 0.0, 0.0, 0.0))
        gpu.matrix.load_matrix(Matrix.Identity(4))
        left, low = box.x + OWN_OFFSET, box.y + OWN_OFFSET
        gpu.matrix.load_projection_matrix(_flat(left, left + box.width, low, low + box.height))
        paint()
    right, top = box.x + box.width, box.y + box.height
    corners = ((box.x, box.y), (right, box.y), (right, top), (box.x, top))
    places = tuple((x + OWN_OFFSET, y + OWN_OFFSET) for x, y in corners)
    shape = {"pos": places, "texCoord": ((0, 0), (1, 0), (1, 1), (0, 1))}
    return picture, batch_for_shader(_shader(), "TRI_FAN", shape)


@cache
def _shader() -> Any:
    """Shows a texture in the format of an editor."""
    import gpu

    between = gpu.types.GPUStageInterfaceInfo("kept_drawing")
    between.smooth("VEC2", "at")
    info = gpu.types.GPUShaderCreateInfo()
    info.push_constant("MAT4", "ModelViewProjectionMatrix")
    info.sampler(0, "FLOAT_2D", "image")
    info.vertex_in(0, "VEC2", "pos")
    info.vertex_in(1, "VEC2", "texCoord")
    info.vertex_out(between)
    info.fragment_out(0, "VEC4", "fragColor")
    info.vertex_source(VERTEX)
    info.fragment_source(FRAGMENT)
    return gpu.shader.create_from_info(info)


def _flat(left: float, right: float, bottom: float, top: float) -> Any:
    """Projection of the pixels of a rectangle."""
    from mathutils import Matrix

    return Matrix((
        (2 / (right - left), 0.0, 0.0, -(right + left) / (right - left)),
        (0.0, 2 / (top - bottom), 0.0, -(top + bottom) / (top - bottom)),
        (0.0, 0.0, -0.01, 0.0),
        (0.0, 0.0, 0.0, 1.0),
    ))  # fmt: skip


def _show(picture: Any, rectangle: Any) -> None:
    import gpu

    shader = _shader()
    gpu.state.blend_set("ALPHA_PREMULT")  # what was blended into an empty picture is multiplied by its alpha
    shader.uniform_sampler("image", picture)
    rectangle.draw(shader)
    gpu.state.blend_set("NONE")

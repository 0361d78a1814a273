# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws a picture of the live renderer in a 3D view, in display colors, with a text if there is an error."""

from __future__ import annotations

import math
import threading
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.render.live.messages import Shown

from .covered import Covered

LARGEST_HALF = 65504.0
"""Largest half float: more would be infinite on the graphics card."""
BLOCK = 1 << 14
"""Pixels that are multiplied at once: few enough that the product stays in the cache, and that NumPy's library starts
no threads, which would wait for the processors that the render uses.
"""
WARNING = (1.0, 0.34, 0.05, 1.0)
"""Shown as the orange (1, 0.62, 0.25): what a render engine draws is encoded for the screen afterward, texts once and
triangles twice."""
PLATE = (0.0, 0.0, 0.0, 1.0)
"""Black and opaque: even a dark gray, or a seventh of a bright picture, would be shown as a light gray, on which texts
are hard to read.
"""


class _Memory:
    """Memory for one picture on its way to the graphics card.

    All views use it in turn, in Blender's main thread, also for coarser and finer pictures: new pages take the system
    longer than the copy, and in a virtual machine a hundred times as long at their very first use.
    """

    def __init__(self) -> None:
        self._numbers = np.empty(0, np.float32)
        self._wanted = 0

    def reserve(self, pixels: int) -> None:
        """Let a thread prepare memory for pictures of so many pixels, before Blender's main thread needs it."""
        if 4 * pixels > max(self._wanted, self._numbers.size):
            self._wanted = 4 * pixels
            threading.Thread(target=self._prepare, args=(4 * pixels,), daemon=True).start()

    def _prepare(self, count: int) -> None:
        numbers = np.empty(count, np.float32)
        numbers.fill(0.0)  # the system finds a page at its first use
        if count > self._numbers.size:
            self._numbers = numbers

    def of(self, shape: tuple[int, ...]) -> NDArray[np.float32]:
        """An array for a picture (height, width, 4)."""
        count = math.prod(shape)
        numbers = self._numbers
        if numbers.size < count:
            self._numbers = numbers = np.empty(count, np.float32)
        return numbers[:count].reshape(shape)


_memory = _Memory()


class Canvas:
    """The texture of one view; it is created again only for a new picture."""

    def __init__(self) -> None:
        self._texture: Any = None
        self._shown: Any = None
        self._corner, self._size = (0, 0), (1, 1)

    def show(self, shown: Shown, working_from_rgb: NDArray[np.float64] | None, *, transparent: bool) -> bool:
        """Copy a picture to the graphics card; False if it is there already."""
        import gpu

        key = (shown, None if working_from_rgb is None else working_from_rgb.tobytes())
        if self._shown is not None and self._shown[0] is shown and self._shown[1] == key[1]:
            return False
        pixels = _memory.of(shown.pixels.shape)
        half_pixels(shown.pixels, working_from_rgb, pixels)
        if not transparent:
            pixels[..., 3] = 1.0
        height, width = pixels.shape[:2]
        data = gpu.types.Buffer("FLOAT", pixels.size, pixels.ravel())
        self._texture = gpu.types.GPUTexture((width, height), format="RGBA16F", data=data)
        self._shown, self._size = key, (width * shown.frame.level, height * shown.frame.level)
        self._corner = shown.frame.corner
        return True

    def draw(self, engine: Any, scene: Any, clip: tuple[int, int, int, int] | None = None) -> None:
        """Draw the picture over the region. ``clip``: left, bottom, width, height of what is drawn, None for all."""
        if self._texture is None:
            return
        import gpu
        from gpu_extras.presets import draw_texture_2d

        gpu.state.blend_set("ALPHA_PREMULT")
        if clip is not None:
            gpu.state.scissor_test_set(True)
            gpu.state.scissor_set(*clip)
        engine.bind_display_space_shader(scene)
        draw_texture_2d(self._texture, self._corner, *self._size)
        engine.unbind_display_space_shader()
        if clip is not None:
            gpu.state.scissor_test_set(False)
        gpu.state.blend_set("NONE")


def reserve_memory(region: Any) -> None:
    """Prepare memory for pictures that fill a region, in a thread."""
    _memory.reserve((region.width + 8) * (region.height + 8))  # a coarse picture reaches over the region's edges


def half_pixels(
    pixels: NDArray[np.float32], working_from_rgb: NDArray[np.float64] | None, out: NDArray[np.float32]
) -> None:
    """Pixels (height, width, 4) in the working space, clipped to half floats. ``working_from_rgb``: None if equal.

    A product of whole pixels takes less than half the time of one that leaves out every fourth number.
    """
    if working_from_rgb is None:
        np.minimum(pixels, np.float32(LARGEST_HALF), out=out)
        return
    matrix = np.eye(4, dtype=np.float32)
    matrix[:3, :3] = working_from_rgb
    matrix = np.ascontiguousarray(matrix.T)
    given, found = pixels.reshape(-1, 4), out.reshape(-1, 4)
    product = np.empty((min(BLOCK, len(given)), 4), np.float32)
    for start in range(0, len(given), BLOCK):
        part = found[start : start + BLOCK]
        np.minimum(given[start : start + BLOCK], np.float32(LARGEST_HALF), out=part)
        np.matmul(part, matrix, out=product[: len(part)])
        np.minimum(product[: len(part)], np.float32(LARGEST_HALF), out=part)


def draw_message(text: str, region: Any, known: Covered, scale: float) -> None:
    """A line or two of text on a plate in the middle of what bars and panels leave of the view."""
    import blf

    from .overlay import FONT, draw_triangles, write

    blf.size(FONT, 13 * scale)
    room = region.width - known.left - known.right
    lines = wrapped_words(f"{text[:1].upper()}{text[1:]}", max(12, int(room / (8 * scale))))
    height = 20 * scale
    middle = known.left + room / 2
    top = (known.bottom + region.height - known.top) / 2 + height * len(lines) / 2
    wide = max(blf.dimensions(FONT, line)[0] for line in lines) / 2 + 12 * scale
    left, right, low, high = middle - wide, middle + wide, top - height * len(lines) - 8 * scale, top + 8 * scale
    corners = [(left, low), (right, low), (right, high), (left, low), (right, high), (left, high)]
    draw_triangles(np.array(corners, np.float32), PLATE)
    for number, line in enumerate(lines):
        width = blf.dimensions(FONT, line)[0]
        write(line, middle - width / 2, top - height * (number + 0.8), WARNING)


def wrapped_words(text: str, longest: int) -> list[str]:
    """Lines of at most so many letters; words are not broken."""
    lines = [""]
    for word in text.split():
        if lines[-1] and len(lines[-1]) + 1 + len(word) > longest:
            lines.append(word)
        else:
            lines[-1] = f"{lines[-1]} {word}".strip()
    return lines

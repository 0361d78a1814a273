# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures as icons for panels: created at their first use, cached by content.

Panels have no custom widgets, but an icon may be any picture; so a curve in a panel is an icon. No icon is ever
removed: buttons of regions that are not laid out again refer to it, and Blender then reports "no icon for icon ID". One
that no panel has used for a while gets the pixels of the next picture instead.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import bpy
import bpy.utils.previews
import numpy as np
from bpy.types import PropertyGroup
from numpy.typing import ArrayLike

from ..translate.spectra.stored import kind_in, stored_samples
from .curve_image import Picture, curve_picture, swatch_picture

KEPT = 512
"""Icons after which unused ones get other pictures; more than a 15 × 15 table shows, and dragging a slider makes a few
dozen per solve.
"""
UNUSED_S = 5.0
"""Time without a use after which an icon may get another picture; a table of more than ``KEPT`` pictures keeps all."""

_previews = None


@dataclass
class _Icon:
    preview: Any
    size: tuple[int, int]
    used: float


_icons: dict[str, _Icon] = {}
"""By content, the one that was not used for the longest time first."""


def _icon(key: str, make: Callable[[], Picture]) -> int:
    """Icon number of the picture that ``make()`` returns, created only if it is not cached."""
    if _previews is None:
        return 0
    found = _icons.pop(key, None)
    if found is None:
        picture = make()
        size = picture.shape[1], picture.shape[0]
        found = _unused(size) or _Icon(_previews.new(f"{len(_previews)}"), size, 0.0)
        if tuple(found.preview.image_size) != size:
            found.preview.image_size = size
        found.preview.image_pixels_float.foreach_set(np.ascontiguousarray(picture).ravel())
    found.used = time.monotonic()
    _icons[key] = found
    return int(found.preview.icon_id)


def _unused(size: tuple[int, int]) -> _Icon | None:
    """An icon of this size that no panel has used for a while, taken out of the cache; None if there are few icons."""
    if len(_icons) < KEPT:
        return None
    now = time.monotonic()
    for key, icon in _icons.items():
        if now - icon.used < UNUSED_S:
            return None
        if icon.size == size:
            del _icons[key]
            return icon
    return None


def curve_icon(spectral: PropertyGroup, size: int = 128) -> int:
    """Icon of the curve of a stored spectrum; 0 (no icon) without a stored spectrum."""
    wavelengths, values = stored_samples(spectral)
    if not wavelengths.size:
        return 0
    kind = kind_in(spectral)
    key = f"{kind} {size} {hash((wavelengths.tobytes(), values.tobytes()))}"
    return _icon(key, lambda: curve_picture(wavelengths, values, kind, size))


def swatch_icon(display_rgb: ArrayLike) -> int:
    """Icon of one color, sRGB (3,)."""
    shown = np.round(np.clip(np.asarray(display_rgb, dtype=np.float64), 0, 1) * 255)
    return _icon("swatch " + " ".join(f"{channel:.0f}" for channel in shown), lambda: swatch_picture(shown / 255))


def picture_icon(picture: Picture) -> int:
    """Icon of a picture (height, width, 4), bottom row first; 0 for an empty one."""
    return _icon(f"picture {hash(picture.tobytes())}", lambda: picture) if picture.size else 0


def register() -> None:
    """Create the collection of icons."""
    global _previews
    _previews = bpy.utils.previews.new()


def unregister() -> None:
    """Remove the icons."""
    global _previews
    if _previews is not None:
        bpy.utils.previews.remove(_previews)
    _previews = None
    _icons.clear()

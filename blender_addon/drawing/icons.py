# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures as icons for panels: created at their first use, cached by content, the oldest removed.

Panels have no custom widgets, but an icon may be any picture; so a curve in a panel is an icon.
"""

from collections.abc import Callable

import bpy
import bpy.utils.previews
import numpy as np
from bpy.types import PropertyGroup
from numpy.typing import ArrayLike

from ..translate.spectra.stored import kind_in, stored_samples
from .curve_image import Picture, curve_picture, swatch_picture

KEPT = 512
"""More than a 15 × 15 table shows; dragging a slider makes a few dozen per solve."""

_previews = None


def _icon(key: str, make: Callable[[], Picture]) -> int:
    """Icon number of the picture that ``make()`` returns, created only if it is not cached."""
    if _previews is None:
        return 0
    found = _previews.get(key)
    if found is None:
        while len(_previews) >= KEPT:
            del _previews[next(iter(_previews))]
        picture = make()
        found = _previews.new(key)
        found.image_size = picture.shape[1], picture.shape[0]
        found.image_pixels_float.foreach_set(np.ascontiguousarray(picture).ravel())
    return found.icon_id


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

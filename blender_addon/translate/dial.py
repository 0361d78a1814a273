# SPDX-License-Identifier: GPL-3.0-or-later
"""The light dial's settings as the core states them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bpy.types import PropertyGroup

from ..properties.dial import RESOLUTION_NM

if TYPE_CHECKING:
    from spectral_core.render.relight.storage import Storage


def storage_of(dial: PropertyGroup) -> Storage:
    """The Storage that ``dial`` asks for."""
    from spectral_core.render.relight.storage import Storage
    from spectral_core.spectra.spectrum import SpectralGrid

    if dial.storage == "DIAL":
        return Storage.dial()
    if dial.storage == "EXACT":
        return Storage.exact(SpectralGrid.uniform(*RESOLUTION_NM))
    return Storage.bands(int(dial.storage.removeprefix("BANDS")))

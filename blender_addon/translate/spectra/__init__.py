# SPDX-License-Identifier: GPL-3.0-or-later
"""Spectra of materials, lights, worlds and nodes, as properties/spectrum.py stores them."""

from __future__ import annotations

from typing import Any

import numpy as np

from spectral_core.errors import InvalidInputError
from spectral_core.spectra.observer import error_of_ends, is_seen
from spectral_core.spectra.spectrum import Illuminant, Reflectance, Spectrum

from ..context import Translation
from . import stored

LARGEST_LOSS = 1.0
"""ΔE2000 of a white under daylight up to which the wavelengths that a file has not are not missed: 400 to 700 nm are
enough.
"""


def spectrum_of(translation: Translation, owner: Any) -> Spectrum | None:
    """Spectrum of ``owner``, None if its color is used; a Note explains a spectrum that cannot be used."""
    if (shown := _designed(translation, owner)) is not None:
        return shown[0]
    if getattr(owner, "spectral", None) is None or owner.spectral.source == "NONE":
        return None
    try:
        spectrum = stored.spectrum_of(owner)
    except InvalidInputError as error:
        translation.note(owner.name, f"{error}; its color is used instead")
        return None
    if isinstance(spectrum, Illuminant) and np.any(spectrum.values) and not is_seen(spectrum):
        translation.note(
            owner.name,
            f"its spectrum {spectrum.name!r} has {spectrum.grid}, where the eye sees nothing, so its power cannot be "
            "that of a white light; it is dark",
        )
        return spectrum.scaled(0.0)
    if isinstance(spectrum, Reflectance) and owner.spectral.source == "FILE":
        _note_ends(translation, owner, spectrum)
    return spectrum


def _note_ends(translation: Translation, owner: Any, surface: Reflectance) -> None:
    """A surface reflects at all wavelengths, but a file may hold a part of them: the others are black."""
    low, high = (float(surface.grid.wavelengths_nm[end]) for end in (0, -1))
    if (error := error_of_ends(low, high)) > LARGEST_LOSS:
        translation.note(
            owner.name,
            f"the file of its spectrum {surface.name!r} has {low:g} to {high:g} nm; beyond, it is black, which changes "
            f"a white by ΔE {error:.1f}: measure it from 400 to 700 nm or more",
        )


def strength_of(translation: Translation, owner: Any) -> float:
    """Factor on the power of a light or world with its spectrum."""
    shown = _designed(translation, owner)
    return float(stored.strength_of(owner)) if shown is None else shown[1]


def _designed(translation: Translation, owner: Any) -> tuple[Spectrum, float] | None:
    """The design's replacement of a data-block's spectrum; nodes are not searched."""
    if not translation.designed or not isinstance(owner, stored.OWNERS):
        return None
    return translation.designed.get(owner.original.session_uid)

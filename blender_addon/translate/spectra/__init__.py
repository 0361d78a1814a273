# SPDX-License-Identifier: GPL-3.0-or-later
"""Spectra of materials, lights, worlds and nodes, as properties/spectrum.py stores them."""

from __future__ import annotations

from typing import Any

from spectral_core.errors import InvalidInputError
from spectral_core.spectra.spectrum import Spectrum

from ..context import Translation
from . import stored


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
    return spectrum


def strength_of(translation: Translation, owner: Any) -> float:
    """Factor on the power of a light or world with its spectrum."""
    shown = _designed(translation, owner)
    return float(stored.strength_of(owner)) if shown is None else shown[1]


def _designed(translation: Translation, owner: Any) -> tuple[Spectrum, float] | None:
    """The design's replacement of a data-block's spectrum; nodes are not searched."""
    if not translation.designed or not isinstance(owner, stored.OWNERS):
        return None
    return translation.designed.get(owner.original.session_uid)

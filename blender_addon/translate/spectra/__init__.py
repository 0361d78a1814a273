# SPDX-License-Identifier: GPL-3.0-or-later
"""Spectra that materials, lights, worlds and nodes carry, as properties/spectrum.py stores them."""

from __future__ import annotations

from typing import Any

from spectral_core.errors import InvalidInputError
from spectral_core.spectra.spectrum import Spectrum

from ..context import Translation
from . import stored


def spectrum_of(translation: Translation, owner: Any) -> Spectrum | None:
    """Spectrum of ``owner``, None if its color is meant; where it cannot be used, a Note says so."""
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
    """Factor on the power of a light or world of that spectrum."""
    shown = _designed(translation, owner)
    return float(stored.strength_of(owner)) if shown is None else shown[1]


def _designed(translation: Translation, owner: Any) -> tuple[Spectrum, float] | None:
    """What a design shows in place of the spectrum that a data-block carries; nodes are not looked up."""
    if not translation.designed or not isinstance(owner, stored.OWNERS):
        return None
    return translation.designed.get(owner.original.session_uid)

# SPDX-License-Identifier: GPL-3.0-or-later
"""Built-in colorants and channels of recipes: LED channels, and measured paint chips.

LEDs: Gaussians at the peaks and widths of data sheets of today's color LEDs, and the phosphor LEDs that the CIE
measured (CIE 15:2018), each with one watt of radiation at full drive, so that drive levels are comparable. Paints: the
24 chips of the ColorChecker in the catalogue, which are opaque matte paints. Inks and filters differ between printers
and makers, so they are read from a file.
"""

from __future__ import annotations

import math

from spectral_core.palette.texture.lights import led
from spectral_core.spectra import catalogue
from spectral_core.spectra.spectrum import Illuminant, Reflectance

LED_PEAKS_AND_WIDTHS_NM = (
    ("royal blue", 447, 18), ("blue", 470, 25), ("cyan", 500, 28), ("green", 523, 33), ("lime", 556, 95),
    ("amber", 594, 16), ("red", 632, 18), ("deep red", 660, 20),
)  # fmt: skip
DOSAGE_ERROR = 0.02
"""Standard deviation of each amount or drive level, relative to it, for the stated sensitivity of a recipe."""
PHOSPHOR_LEDS = ("LED-B1", "LED-B3", "LED-B5")


def led_channels() -> list[Illuminant]:
    """Eight colored LEDs and three white ones, in watts per nanometer: one watt of radiation each at full drive."""
    known = catalogue.illuminant_names()
    named = [(f"{name} {peak} nm", led(peak, width)) for name, peak, width in LED_PEAKS_AND_WIDTHS_NM]
    named += [(name, catalogue.illuminant(name)) for name in PHOSPHOR_LEDS if name in known]
    return [_of_one_watt(name, channel) for name, channel in named]


def _of_one_watt(name: str, channel: Illuminant) -> Illuminant:
    watts = float(channel.grid.cell_widths_nm @ channel.values)
    return Illuminant(name, channel.grid, channel.values / watts)


def paint_chips() -> list[Reflectance]:
    """The 24 paints of the ColorChecker."""
    return [catalogue.reflectance(name) for name in catalogue.reflectance_names()[:24]]


def amount_text(amount: float, decimals: int) -> str:
    """An amount of at least 0 with so many decimals, or more for three digits: 0.00123, not 0.001."""
    digits = 2 - math.floor(math.log10(amount)) if amount > 0 else 0
    return f"{amount:.{max(decimals, digits)}f}"

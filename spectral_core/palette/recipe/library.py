# SPDX-License-Identifier: GPL-3.0-or-later
"""What there is to mix from when no file of one's own is at hand: LED channels, and measured paint chips.

LEDs: bells at the peaks and widths that data sheets of today's color LEDs state, and the phosphor LEDs that the CIE
measured (CIE 15:2018). Paints: the 24 chips of the ColorChecker as the catalogue has them, which are opaque matte
paints. Inks and filters differ from printer to printer and maker to maker, so they come from a file.
"""

from __future__ import annotations

from spectral_core.palette.texture.lights import led
from spectral_core.spectra import catalogue
from spectral_core.spectra.spectrum import Illuminant, Reflectance

LED_PEAKS_AND_WIDTHS_NM = (
    ("royal blue", 447, 18), ("blue", 470, 25), ("cyan", 500, 28), ("green", 523, 33), ("lime", 556, 95),
    ("amber", 594, 16), ("red", 632, 18), ("deep red", 660, 20),
)  # fmt: skip
PHOSPHOR_LEDS = ("LED-B1", "LED-B3", "LED-B5")


def led_channels() -> list[Illuminant]:
    """Eight colored LEDs and three white ones."""
    colored = []
    for name, peak, width in LED_PEAKS_AND_WIDTHS_NM:
        bell = led(peak, width)
        colored.append(Illuminant(f"{name} {peak} nm", bell.grid, bell.values))
    known = catalogue.illuminant_names()
    return [*colored, *(catalogue.illuminant(name) for name in PHOSPHOR_LEDS if name in known)]


def paint_chips() -> list[Reflectance]:
    """The 24 paints of the ColorChecker."""
    return [catalogue.reflectance(name) for name in catalogue.reflectance_names()[:24]]

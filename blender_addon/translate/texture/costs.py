# SPDX-License-Identifier: GPL-3.0-or-later
"""Contrast that the lights of a spectral texture allow, stated before the design."""

from functools import lru_cache

import numpy as np
from bpy.types import PropertyGroup

from spectral_core.errors import SpectralError
from spectral_core.palette.texture.reach import reachable_contrast
from spectral_core.palette.texture.realism import realism_cost
from spectral_core.spectra.spectrum import Illuminant, SpectralGrid

from ..spectra.stored import stored_samples


def realism_words(daylight_share: float, led_width_nm: float) -> list[str]:
    """Text on the effect of the sliders of designed lights."""
    cost = realism_cost(daylight_share, led_width_nm)
    return [
        f"Unrelated pictures keep a contrast of about {cost.contrast:.0f}:1.",
        f"Other surfaces look off by about ΔE {cost.rendering_delta_e:.0f} under one of the lights.",
    ]


def given_contrast(design: PropertyGroup) -> str:
    """Text on the contrast that two given lamps allow."""
    stored = [stored_samples(getattr(design, f"light_{number}").spectral) for number in (1, 2)]
    if not all(wavelengths.size for wavelengths, _ in stored):
        return "Choose both lamps to see what contrast they allow."
    floor = max(design.floor, 0.01)
    return _contrast(tuple((nm.tobytes(), values.tobytes()) for nm, values in stored), round(floor, 3))


@lru_cache(maxsize=64)
def _contrast(lamps: tuple[tuple[bytes, bytes], ...], floor: float) -> str:
    lights = [
        Illuminant(f"light {number}", SpectralGrid(np.frombuffer(nm)), np.frombuffer(values))
        for number, (nm, values) in enumerate(lamps, 1)
    ]
    try:
        reach = reachable_contrast(lights, floor)
    except SpectralError as error:
        return str(error)
    return f"With these lamps, unrelated pictures can have a contrast of {reach.contrast:.2g}:1 if black is {floor:g}."

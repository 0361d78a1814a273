# SPDX-License-Identifier: GPL-3.0-or-later
"""Indices of refraction that vary with wavelength: of glasses by name, and of any glass by its Abbe number.

The Abbe number is (n_d - 1) / (n_F - n_C), with the index of refraction n at three of Fraunhofer's lines; the smaller
it is, the further a prism spreads colors.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from spectral_core.checks import require_range
from spectral_core.errors import UnknownNameError
from spectral_core.spectra.spectrum import EXCITING_NM, LAST_NM, SpectralGrid, Spectrum

D_NM, F_NM, C_NM = 587.5618, 486.1327, 656.2725
"""Fraunhofer's lines d (helium), F and C (hydrogen)."""
ABBE_NUMBERS = (5.0, 200.0)
"""Range of Abbe numbers that are accepted; glasses have 20 to 95."""
_STEPS = (EXCITING_NM, LAST_NM, 5)
"""Knots in nm, from the ultraviolet that excites dyes on: from 360 nm on, straight lines between them are within 6e-5
of the curve of any named glass.
"""


@dataclass(frozen=True, slots=True)
class Sellmeier:
    """n² - 1 as a sum of B λ² / (λ² - C), λ in micrometers. ``terms``: pairs (B, C), C in µm²."""

    label: str
    terms: tuple[tuple[float, float], ...]
    source: str

    def at(self, wavelength_nm: float | np.ndarray) -> np.ndarray:
        """Indices of refraction, same shape as the wavelengths."""
        squared = np.square(np.asarray(wavelength_nm, np.float64) / 1e3)
        return np.sqrt(1.0 + sum(strength * squared / (squared - pole) for strength, pole in self.terms))


_SCHOTT = "Schott data sheet"
NAMED_INDICES: Mapping[str, Sellmeier] = MappingProxyType(
    {
        "BK7": Sellmeier(
            "Crown glass N-BK7",
            ((1.03961212, 0.00600069867), (0.231792344, 0.0200179144), (1.01046945, 103.560653)), _SCHOTT,
        ),
        "F2": Sellmeier(
            "Flint glass F2",
            ((1.34533359, 0.00997743871), (0.209073176, 0.0470450767), (0.937357162, 111.886764)), _SCHOTT,
        ),
        "SF11": Sellmeier(
            "Dense flint N-SF11",
            ((1.73759695, 0.013188707), (0.313747346, 0.0623068142), (1.89878101, 155.23629)), _SCHOTT,
        ),
        "SILICA": Sellmeier(
            "Fused silica",
            ((0.6961663, 0.0684043**2), (0.4079426, 0.1162414**2), (0.8974794, 9.896161**2)), "Malitson 1965",
        ),
        "WATER": Sellmeier(
            "Water",
            (
                (0.5684027565, 0.005101829712), (0.1726177391, 0.01821153936), (0.02086189578, 0.02620722293),
                (0.1130748688, 10.69792721),
            ),
            "Daimon and Masumura 2007, 20 °C",
        ),
        "SAPPHIRE": Sellmeier(
            "Sapphire",
            ((1.4313493, 0.0726631**2), (0.65054713, 0.1193242**2), (5.3414021, 18.028251**2)),
            "Malitson and Dodge 1972, ordinary ray",
        ),
        "DIAMOND": Sellmeier("Diamond", ((0.3306, 0.175**2), (4.3356, 0.106**2)), "Peter 1923"),
    }
)  # fmt: skip
"""Glasses and other clear materials by name."""


def named_index(name: str) -> Spectrum:
    """Index of refraction of a material in ``NAMED_INDICES``, 300 to 830 nm.

    Raises UnknownNameError for another name.
    """
    if name not in NAMED_INDICES:
        raise UnknownNameError.among("index of refraction", name, NAMED_INDICES)
    found = NAMED_INDICES[name]
    grid = SpectralGrid.uniform(*_STEPS)
    return Spectrum(found.label, grid, found.at(grid.wavelengths_nm), source=found.source)


def index_by_abbe(index_d: float, abbe_number: float) -> Spectrum:
    """Index of refraction by that at the line d and an Abbe number: Cauchy's A + B / λ², 300 to 830 nm.

    An index below 1 is that of a bubble: the inverse of the index of what surrounds it, which has the Abbe number.
    Raises InvalidInputError for an index that is not positive, or an Abbe number outside ``ABBE_NUMBERS``.
    """
    index = require_range("the index of refraction", index_d, 1e-5, 1e3)
    abbe = require_range("the Abbe number", abbe_number, *ABBE_NUMBERS)
    around = max(index, 1.0 / index)
    slope = (around - 1.0) / abbe / (F_NM**-2 - C_NM**-2)
    grid = SpectralGrid.uniform(*_STEPS)
    values = around + slope * (grid.wavelengths_nm**-2 - D_NM**-2)
    name = f"index {index:.4g}, Abbe number {abbe:.3g}"
    made = Spectrum(name, grid, values, source="Cauchy's equation")
    return made if index >= 1.0 else bubble_in(made)


def bubble_in(index: Spectrum) -> Spectrum:
    """Index of refraction of a bubble of air in a material, by the material's."""
    return replace(index, values=1.0 / index.values)

# SPDX-License-Identifier: GPL-3.0-or-later
"""The light model of a conventional renderer: colors of surfaces times colors of lights."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spectral_core.checks import require_kind
from spectral_core.errors import InvalidInputError
from spectral_core.light_models.interface import LightModel
from spectral_core.spectra.color import RGB_FROM_XYZ, XYZ_FROM_RGB
from spectral_core.spectra.observer import Observer, xyz_from_product
from spectral_core.spectra.spectrum import Illuminant, SpectralGrid, Spectrum

Array = NDArray[np.float64]


class RgbModel(LightModel):
    """Coefficients are linear sRGB under ``reference``, relative to its white, so that flat white is (1, 1, 1)."""

    def __init__(self, grid: SpectralGrid, reference: Illuminant, viewer: Observer | None = None) -> None:
        require_kind("the reference light", reference, Spectrum, "spectra.catalogue.illuminant(NAME)")
        matrix = RGB_FROM_XYZ @ xyz_from_product(reference, grid, viewer)
        white = matrix.sum(axis=1, keepdims=True)
        if np.any(white <= 0):
            raise InvalidInputError(
                f"reference light {reference.name!r} has linear RGB {white[:, 0].tolist()}; choose one inside the gamut"
            )
        super().__init__(grid, matrix / white, viewer)

    @property
    def multiplications_per_reflection(self) -> int:
        """3."""
        return 3

    def xyz_from_coefficients(self, light: Spectrum) -> Array:
        """XYZ of RGB that was multiplied by the light's RGB, (3, 3)."""
        return XYZ_FROM_RGB * (RGB_FROM_XYZ @ self.matrix_of_light(light).sum(axis=1))

    def reflect(self, first: ArrayLike, second: ArrayLike) -> Array:
        """Channel by channel."""
        return self.numbers_of(first) * self.numbers_of(second)

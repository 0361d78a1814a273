# SPDX-License-Identifier: GPL-3.0-or-later
"""A texture whose texels are reflectances: K weights per texel, K spectra for all."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from spectral_core.checks import as_array, frozen_array, read_only_when_copied, require_declared
from spectral_core.errors import InvalidInputError
from spectral_core.spectra.color import RGB_FROM_XYZ
from spectral_core.spectra.observer import xyz_from_product
from spectral_core.spectra.spectrum import Illuminant, SpectralGrid

MOST_SPECTRA = 8


@read_only_when_copied
@dataclass(frozen=True, slots=True, eq=False)
class SpectralImage:
    """Reflectances over a mesh's UV square, row 0 at v = 0 (bottom, as in Blender).

    ``weights``: (K, height, width) float16 in [0, 1]; ``spectra``: (K, n) in [0, 1] on ``grid``; the reflectance of a
    texel is the weighted sum of the spectra. ``uv_from_mesh_uv``: (3, 3) affine.
    """

    name: str
    weights: NDArray[np.float16]
    spectra: NDArray[np.float64]
    grid: SpectralGrid
    extension: Literal["repeat", "clip", "extend", "mirror"] = "repeat"
    interpolation: Literal["linear", "nearest"] = "linear"
    uv_from_mesh_uv: NDArray[np.float64] = field(default_factory=lambda: np.eye(3))

    def __post_init__(self) -> None:
        require_declared(self)
        weights = as_array(f"spectral image {self.name!r} has weights of", self.weights, np.float16)
        if weights.ndim != 3 or 0 in weights.shape or len(weights) > MOST_SPECTRA:
            raise InvalidInputError(
                f"spectral image {self.name!r} has weights of shape {weights.shape}; expected (1 to {MOST_SPECTRA} "
                "spectra, height, width)"
            )
        spectra = frozen_array(f"spectra of {self.name!r}", self.spectra, (len(weights), self.grid.size))
        # The bits of a half float in [0, 1] are at most those of 1; negative, infinite and NaN ones are larger.
        if np.any((np.abs(weights) + np.float16(0)).view(np.uint16) > 0x3C00) or weights.min() < 0:
            raise InvalidInputError(f"spectral image {self.name!r} has weights outside [0, 1]")
        if spectra.min() < -1e-9 or spectra.sum(axis=0).max() > 1 + 1e-6:
            raise InvalidInputError(
                f"spectral image {self.name!r} has spectra whose sum reaches {spectra.sum(axis=0).max():g}; "
                "non-negative spectra of sum at most 1 keep every reflectance within [0, 1]"
            )
        object.__setattr__(self, "weights", weights)
        object.__setattr__(self, "spectra", spectra)
        object.__setattr__(self, "uv_from_mesh_uv", frozen_array("uv_from_mesh_uv", self.uv_from_mesh_uv, (3, 3)))

    def linear_rgb(self, light: Illuminant) -> NDArray[np.float32]:
        """Colors (height, width, 3) in linear sRGB under ``light`` of luminance 1, as RGB transport shows them."""
        rgb_from_weights = RGB_FROM_XYZ @ xyz_from_product(light, self.grid) @ self.spectra.T
        colors = np.tensordot(self.weights.astype(np.float32), rgb_from_weights.astype(np.float32), axes=(0, 1))
        return np.ascontiguousarray(colors, dtype=np.float32)

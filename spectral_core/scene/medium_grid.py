# SPDX-License-Identifier: GPL-3.0-or-later
"""Grids by which media vary."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spectral_core.checks import as_array, read_only_when_copied, require_unmasked
from spectral_core.errors import InvalidInputError
from spectral_core.scene.geometry import affine
from spectral_core.spectra.spectrum import Spectrum


@read_only_when_copied
@dataclass(frozen=True, slots=True, eq=False)
class MediumGrid:
    """How a medium varies: linear between voxel centers, and nothing beyond half a voxel outside of the outermost.

    ``scattering``, ``absorption``, ``emission``: None for a coefficient that does not vary; (nx, ny, nz), factors of at
    least 0 on the medium's own coefficient; or (nx, ny, nz, 3), linear RGB that with the medium's density (of emission:
    its strength) is the coefficient. ``world_from_index``: (4, 4), voxel centers to world space. ``spectra``: for each
    of the three the spectra of its n entries (nx, ny, nz, n) in place of red, green and blue, in spectral transport; of
    scattering and absorption from 0 to 1, of emission relative to white.
    """

    world_from_index: NDArray[np.float64]
    scattering: NDArray[np.float32] | None = None
    absorption: NDArray[np.float32] | None = None
    emission: NDArray[np.float32] | None = None
    spectra: tuple[tuple[Spectrum, ...], tuple[Spectrum, ...], tuple[Spectrum, ...]] | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "world_from_index", affine("MediumGrid", self.world_from_index))
        if abs(np.linalg.det(self.world_from_index[:3, :3])) == 0:
            raise InvalidInputError("MediumGrid: its matrix is singular; expected voxels with a volume")
        for name in ("scattering", "absorption", "emission"):
            if (given := getattr(self, name)) is not None:
                require_unmasked(f"MediumGrid {name}", given)
                object.__setattr__(self, name, as_array(f"MediumGrid {name} is of", given, np.float32))
        shapes = {values.shape[:3] for values in self.given}
        if len(shapes) != 1 or 0 in next(iter(shapes)):
            raise InvalidInputError(f"MediumGrid has values of sizes {sorted(shapes)}; expected one size, none of it 0")
        colors = {(3,)} if self.spectra is None else {(len(each),) for each in self.spectra}
        for values in self.given:
            if values.ndim not in (3, 4) or values.shape[3:] not in {(), *colors}:
                raise InvalidInputError(f"MediumGrid has values of shape {values.shape}; expected (nx, ny, nz[, 3])")
            if not np.isfinite(values).all() or values.min() < 0:
                raise InvalidInputError("MediumGrid has values below 0 or not finite; expected finite values from 0")

    @property
    def given(self) -> tuple[NDArray[np.float32], ...]:
        """The values that vary."""
        return tuple(v for v in (self.scattering, self.absorption, self.emission) if v is not None)

    @property
    def shape(self) -> tuple[int, int, int]:
        """Number of voxels along each axis."""
        nx, ny, nz = self.given[0].shape[:3]
        return nx, ny, nz

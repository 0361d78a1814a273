# SPDX-License-Identifier: GPL-3.0-or-later
"""All kinds of storage, by the names that panels, command line and files use."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from spectral_core.errors import InvalidInputError, UnknownNameError
from spectral_core.render.relight.band_storage import BAND_COUNTS, BandStorage
from spectral_core.render.relight.exact_storage import ExactStorage
from spectral_core.render.relight.storage import MixtureStorage, Storage
from spectral_core.spectra.spectrum import SpectralGrid

EXACT_GRID = SpectralGrid.uniform(380.0, 780.0, 10.0)
"""Grid of an exact recording where none is named: that of the palette's designs."""
STORAGE_NAMES = ("dial", *(f"bands{count}" for count in BAND_COUNTS), "exact")


def storage_named(name: str) -> Storage:
    """Give the storage of one of STORAGE_NAMES. Raises UnknownNameError."""
    if name not in STORAGE_NAMES:
        raise UnknownNameError.among("storage", name, STORAGE_NAMES)
    if name == MixtureStorage.kind:
        return MixtureStorage()
    if name == ExactStorage.kind:
        return ExactStorage(EXACT_GRID)
    return BandStorage(int(name.removeprefix(BandStorage.kind)))


def storage_of_document(kind: str, wavelengths_nm: Sequence[float] | None) -> Storage:
    """Give the storage that a file's header states. Raises InvalidInputError for one that this program has not."""
    if kind == MixtureStorage.kind and wavelengths_nm is None:
        return MixtureStorage()
    if kind == ExactStorage.kind and wavelengths_nm is not None:
        return ExactStorage(SpectralGrid(np.array(wavelengths_nm, dtype=np.float64)))
    if kind == BandStorage.kind and wavelengths_nm is not None:
        storage = BandStorage(len(wavelengths_nm))
        if np.allclose(storage.grid.wavelengths_nm, wavelengths_nm, rtol=0, atol=1e-6):
            return storage
    raise InvalidInputError(f"storage {kind!r} with these wavelengths is none of {', '.join(STORAGE_NAMES)}")


def smaller_storages() -> tuple[Storage, ...]:
    """What else might fit where a recording does not, smallest first."""
    return (MixtureStorage(), *(BandStorage(count) for count in BAND_COUNTS))

# SPDX-License-Identifier: GPL-3.0-or-later
"""All kinds of storage, by the names that panels, command line and files use."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from spectral_core.errors import InvalidInputError, UnknownNameError
from spectral_core.render.relight.band_storage import BandStorage
from spectral_core.render.relight.exact_storage import ExactStorage
from spectral_core.render.relight.storage import MixtureStorage, Storage
from spectral_core.spectra.spectrum import SpectralGrid

KINDS: tuple[type[Storage], ...] = (MixtureStorage, BandStorage, ExactStorage)
STORAGES = {name: storage for kind in KINDS for name, storage in kind.choices().items()}
"""What a recording may keep, smallest first, by the name that the command line and panel show."""


def storage_named(name: str) -> Storage:
    """Give one of STORAGES. Raises UnknownNameError."""
    if name not in STORAGES:
        raise UnknownNameError.among("storage", name, STORAGES)
    return STORAGES[name]


def storage_of_document(kind: str, wavelengths_nm: Sequence[float] | None) -> Storage:
    """Give the storage that a file's header states. Raises InvalidInputError for one that this program has not."""
    grid = None if wavelengths_nm is None else SpectralGrid(np.array(wavelengths_nm, dtype=np.float64))
    for candidate in KINDS:
        if candidate.kind == kind and (storage := candidate.of_grid(grid)) is not None:
            return storage
    raise InvalidInputError(f"storage {kind!r} with these wavelengths is none of {', '.join(STORAGES)}")

# SPDX-License-Identifier: GPL-3.0-or-later
"""All types of storage, by their names in panels, on the command line and in files."""

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
"""Storages of a recording, smallest first, by their names on the command line and in the panel."""


def storage_named(name: str) -> Storage:
    """Return one of STORAGES. Raises UnknownNameError."""
    if name not in STORAGES:
        raise UnknownNameError.among("storage", name, STORAGES)
    return STORAGES[name]


def storage_of_document(kind: str, wavelengths_nm: Sequence[float] | None) -> Storage:
    """Return the storage that a file's header states. Raises InvalidInputError for an unknown one."""
    grid = None if wavelengths_nm is None else SpectralGrid(np.array(wavelengths_nm, dtype=np.float64))
    for candidate in KINDS:
        if candidate.kind == kind and (storage := candidate.of_grid(grid)) is not None:
            return storage
    raise InvalidInputError(f"storage {kind!r} with these wavelengths is none of {', '.join(STORAGES)}")

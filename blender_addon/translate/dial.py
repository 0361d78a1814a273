# SPDX-License-Identifier: GPL-3.0-or-later
"""The light dial's settings as the core states them."""


def storage_of(dial):
    """The Storage that ``dial`` asks for."""
    from spectral_core.render.relight.storage import Storage
    from spectral_core.spectra.spectrum import SpectralGrid

    if dial.storage == "DIAL":
        return Storage.dial()
    if dial.storage == "EXACT":
        return Storage.exact(SpectralGrid.uniform(*RESOLUTION_NM))
    return Storage.bands(int(dial.storage.removeprefix("BANDS")))

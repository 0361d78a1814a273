# SPDX-License-Identifier: GPL-3.0-or-later
"""The light dial's settings as the core states them."""


def storage_of(dial):
    """The Storage that ``dial`` asks for: its words are the core's in capitals."""
    from spectral_core.render.relight.storages import storage_named

    return storage_named(dial.storage.lower())

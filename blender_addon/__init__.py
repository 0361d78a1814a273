# SPDX-License-Identifier: GPL-3.0-or-later
"""Spectral Scene Design in Blender. Importing this needs no Blender; ``register()`` does."""


def register() -> None:
    """Blender calls this when the extension is enabled."""
    from . import registration

    registration.register()


def unregister() -> None:
    """Blender calls this when the extension is disabled: everything that register() added is removed."""
    from . import registration

    registration.unregister()

# SPDX-License-Identifier: GPL-3.0-or-later
"""Spectral Scene Design in Blender. Importing this needs no Blender; ``register()`` does."""

import importlib
import sys
from types import ModuleType

_WITH_WHEELS = "bl_ext."
"""Start of the package's name where Blender has installed this as an extension, and the core from a wheel."""


def _forget_earlier_version() -> None:
    """Forget modules of an earlier version of this extension, if it is updated or reloaded while Blender runs.

    Blender executes this file anew then, but keeps the modules of wheels: the new panels would import the old core,
    fail, and leave the extension enabled without its wheels, also after a restart. Reload Scripts also keeps the names
    of this package, and ``from . import`` would find the old modules among them.
    """
    earlier = [name for name in sys.modules if f"{name}.".startswith(("spectral_core.", f"{__name__}."))]
    for name in earlier:
        if name != __name__:
            del sys.modules[name]
            parent, _, module = name.rpartition(".")
            if parent == __name__:
                globals().pop(module, None)
    importlib.invalidate_caches()


if __name__.startswith(_WITH_WHEELS):
    _forget_earlier_version()


def register() -> None:
    """Blender calls this when the extension is enabled."""
    _registration().register()


def register_once() -> None:
    """Enable the extension in a process where it may be enabled already; Blender refuses a second ``register()``."""
    _registration().register_once()


def unregister() -> None:
    """Blender calls this when the extension is disabled: everything that register() added is removed."""
    _registration().unregister()


def _registration() -> ModuleType:
    """The module that registers the others. They import SciPy, whose BLAS must not spin."""
    from spectral_core.blas_threads import wait_without_spinning

    wait_without_spinning()
    from . import registration

    return registration

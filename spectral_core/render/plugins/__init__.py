# SPDX-License-Identifier: GPL-3.0-or-later
"""Mitsuba plugins for features of Blender that Mitsuba lacks: closures, mixed paints, lights with Blender's falloffs.

A plugin's class is derived from a class of the active variant, so each module here defines its classes inside
``register(mitsuba)``, which runs once per variant.
"""

from __future__ import annotations

from collections.abc import Iterator
from importlib import import_module
from pkgutil import iter_modules
from types import ModuleType

from spectral_core.render.plugins import closures

_registered: set[str] = set()


def register(variant: str) -> None:
    """Register every plugin for ``variant``, which must be the active one; a second call does nothing."""
    if variant in _registered:
        return
    import drjit
    import mitsuba

    from spectral_core.render.plugins.lamps import emitters, environment, sun
    from spectral_core.render.plugins.paints import spectral_image, textures

    for module in (textures, spectral_image, emitters, environment, sun, *_closures()):
        module.register(mitsuba, drjit)
    _registered.add(variant)


def _closures() -> Iterator[ModuleType]:
    """Each module of ``closures`` that registers one: a new closure's file needs no entry in a list."""
    for found in sorted(iter_modules(closures.__path__), key=lambda found: found.name):
        module = import_module(f"{closures.__name__}.{found.name}")
        if hasattr(module, "register"):
            yield module

# SPDX-License-Identifier: GPL-3.0-or-later
"""Registration of the extension in Blender, in order: each module has ``register()`` and ``unregister()``."""

from __future__ import annotations

import bpy

from . import command_line, engine, interface, jobs, preferences

MODULES = (preferences, *interface.MODULES, jobs, engine, command_line)


def register() -> None:
    """Register every module; if one fails, those registered before it are removed again."""
    done = []
    try:
        for module in MODULES:
            module.register()
            done.append(module)
    except Exception:
        for module in reversed(done):
            module.unregister()
        raise


def register_once() -> None:
    """Register every module unless this process has done so: commands, workers and tests enable the extension."""
    if not hasattr(bpy.types.Scene, "spectral"):
        register()


def unregister() -> None:
    """Remove everything, in reverse order."""
    for module in reversed(MODULES):
        module.unregister()

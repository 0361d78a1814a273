# SPDX-License-Identifier: GPL-3.0-or-later
"""Registration of the extension in Blender, in order: each module has ``register()`` and ``unregister()``."""

from __future__ import annotations

from importlib import import_module

import bpy

from spectral_core.errors import InvalidInputError

from . import command_line, engine, exit_status, interface, jobs, preferences
from .properties.render import ENGINE

MODULES = (preferences, *interface.MODULES, jobs, exit_status, engine, command_line)


def register() -> None:
    """Register every module; if one fails, those registered before it are removed again.

    While another copy of the extension is enabled this is refused: Blender would silently replace the classes of that
    copy, and would then fail to disable it.
    """
    others = sorted(_registered_packages() - {__package__})
    if others:
        raise InvalidInputError(
            f"another copy of Spectral Scene Design is enabled, as {', '.join(others)}, so this copy, {__package__}, "
            "was not enabled; disable the other one in Preferences, Add-ons, and enable this one again "
            "(in a script: register_once())"
        )
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
    """Register every module unless this process has done so: commands, workers and tests enable the extension.

    Another copy of the extension is disabled: Blender enables the installed one in each process, also where this one
    runs from its sources, and requests of one copy do not reach the engine of another one.
    """
    import addon_utils  # bpy from PyPI has put its folder on the path by now

    if hasattr(bpy.types.Scene, "spectral"):
        others = {package for package in _registered_packages() if package != __package__}
        if not others:
            return
        for package in others:
            addon_utils.disable(package)
            if package in _registered_packages():  # it was registered by a script
                import_module(package).unregister()
    register()


def _registered_packages() -> set[str]:
    """Packages of the registered engines with this engine's identifier: one for each copy of the extension."""
    engines = bpy.types.RenderEngine.__subclasses__()
    return {
        each.__module__.rpartition(".")[0]
        for each in engines
        if getattr(each, "bl_idname", "") == ENGINE and getattr(each, "is_registered", False)
    }


def unregister() -> None:
    """Remove everything, in reverse order."""
    for module in reversed(MODULES):
        module.unregister()

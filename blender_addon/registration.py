# SPDX-License-Identifier: GPL-3.0-or-later
"""What the extension adds to Blender, in order: each module has ``register()`` and ``unregister()``."""

from __future__ import annotations

from . import command_line, engine, interface, jobs, preferences

MODULES = (preferences, *interface.MODULES, jobs, engine, command_line)


def register() -> None:
    """Register every module; where one fails, what was registered before it is taken away again."""
    done = []
    try:
        for module in MODULES:
            module.register()
            done.append(module)
    except Exception:
        for module in reversed(done):
            module.unregister()
        raise


def unregister() -> None:
    """Take everything away, in the opposite order."""
    for module in reversed(MODULES):
        module.unregister()

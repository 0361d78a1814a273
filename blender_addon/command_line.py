# SPDX-License-Identifier: GPL-3.0-or-later
"""``blender --command spectral …``: the command line in an artist's Blender, without any other installation."""

from __future__ import annotations

from typing import Any

_handle: Any = None


def _execute(arguments: list[str]) -> int:
    from .commands import main

    return main(arguments)


def register() -> None:
    """Register the command in Blender."""
    import bpy

    global _handle
    _handle = bpy.utils.register_cli_command("spectral", _execute)


def unregister() -> None:
    """Remove the command."""
    import bpy

    bpy.utils.unregister_cli_command(_handle)

# SPDX-License-Identifier: GPL-3.0-or-later
"""Commands that need Blender; ``main`` is the whole command line, with those of ``spectral_core.cli``."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from spectral_core.explore.sweep.parameters import Space


def command_names() -> list[str]:
    """Names of all commands, in alphabetical order."""
    from spectral_core import cli

    return list(cli.command_packages([__name__]))


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit status.

    The script `spectral-scene` imports this module and calls this function. What takes time to import is imported here,
    where Ctrl-C is one line from the start.
    """
    try:
        from spectral_core import cli

        given = list(sys.argv[1:] if arguments is None else arguments)
        if given[:1] in (["sweep"], ["explore"]):
            from spectral_core.explore.sweep.document import register_compute

            register_compute("blend", _blend_node)
    except KeyboardInterrupt:
        print("stopped", file=sys.stderr)
        return 130
    return cli.main(given, [__name__], _program())


def _program() -> list[str]:
    """Words that start this command line in another process: in Blender, Blender itself, where the extension is."""
    bpy = sys.modules.get("bpy")
    binary = bpy.app.binary_path if bpy is not None else ""
    if binary:
        return [binary, "--command", "spectral"]
    return [sys.executable, "-P", "-m", __name__.rpartition(".")[0]]


def _blend_node(table: dict[str, Any], space: Space, folder: Path) -> Any:
    """The compute node of a .blend file; Blender's module is only loaded if a sweep needs it."""
    from ._blend import require_blender

    require_blender()
    from ..editing.sweep.node import blend_node

    return blend_node(table, space, folder)

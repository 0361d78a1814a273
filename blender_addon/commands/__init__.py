# SPDX-License-Identifier: GPL-3.0-or-later
"""Commands that need Blender; ``main`` is the whole command line, these beside those of ``spectral_core.cli``."""

from __future__ import annotations

from collections.abc import Sequence

from spectral_core import cli


def command_names() -> list[str]:
    """Names of all commands, in alphabetical order."""
    return list(cli.command_packages([__name__]))


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit status."""
    return cli.main(arguments, [__name__])

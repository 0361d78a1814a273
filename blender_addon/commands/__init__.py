# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line: one module per command, found by name.

A command is a module of this package: the first line of its docstring is its help, ``add_arguments(parser)``
declares what it takes and ``run(arguments) -> int`` does it and returns the exit status (0 only on success).
With ``--json`` (``arguments.json``) it prints one JSON object as its last line.
"""

from __future__ import annotations

import argparse
import importlib
import json
import pkgutil
import sys
from collections.abc import Sequence
from types import ModuleType

from spectral_core import __version__
from spectral_core.errors import SpectralError


def command_names() -> list[str]:
    """Names of all commands, in alphabetical order."""
    return sorted(info.name for info in pkgutil.iter_modules(__path__) if not info.name.startswith("_"))


def _load(name: str) -> ModuleType:
    return importlib.import_module(f"{__name__}.{name}")


def _parser(name: str | None) -> argparse.ArgumentParser:
    """Parser of all commands, or of one alone, so that only its module is imported."""
    parser = argparse.ArgumentParser(prog="spectral-scene", description="Design and render spectral scenes.")
    parser.add_argument("--version", action="version", version=f"spectral-scene {__version__}")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", required=True)
    for known in [name] if name in command_names() else command_names():
        module = _load(known)
        summary = (module.__doc__ or "").strip().split("\n")[0]
        sub = commands.add_parser(known, help=summary, description=module.__doc__)
        sub.formatter_class = argparse.RawDescriptionHelpFormatter
        sub.add_argument("--json", action="store_true", help="print one JSON object as the last line")
        module.add_arguments(sub)
        sub.set_defaults(run=module.run)
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; returns its exit status. An error that this project raises on purpose is one clear line."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    parsed = _parser(given[0] if given else None).parse_args(given)
    try:
        return int(parsed.run(parsed))
    except SpectralError as error:
        return _failed(parsed, error, str(error))
    except MemoryError as error:
        return _failed(parsed, error, f"not enough memory; ask for less ({error})")
    except OSError as error:
        if error.filename is None:  # no file that was asked for: a fault of ours, whose traceback is wanted
            raise
        return _failed(parsed, error, f"{error.filename}: {error.strerror}")
    except KeyboardInterrupt:
        print(f"spectral-scene {parsed.command}: stopped", file=sys.stderr)
        return 130


def _failed(parsed: argparse.Namespace, error: Exception, message: str) -> int:
    """Say why in one line, and as JSON where that was asked for."""
    print(f"spectral-scene {parsed.command}: {message}", file=sys.stderr)
    if parsed.json:
        print(json.dumps({"error": message, "kind": type(error).__name__}))
    return 1

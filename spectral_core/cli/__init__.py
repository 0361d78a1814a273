# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line: one module per command, found by name.

A command is a module of a command package: the first paragraph of its docstring is its help, ``add_arguments(parser)``
declares its arguments and ``run(arguments) -> int`` executes it and returns the exit status (0 only on success).
With ``--json`` (``arguments.json``) it prints one JSON object as its last line. ``arguments.program`` are the words
that start this command line in another process. This package holds the commands that need no Blender;
``blender_addon.commands`` passes its own package to ``main`` to add the others.
"""

from __future__ import annotations

import argparse
import importlib
import pkgutil
import sys
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType

from spectral_core import __version__
from spectral_core.cli.shared import terminal
from spectral_core.cli.shared.parser import CommandParser, by_option
from spectral_core.cli.shared.report import print_json
from spectral_core.errors import RenderCancelled, SpectralError, UnknownNameError


def command_packages(packages: Sequence[str] = ()) -> dict[str, str]:
    """Name of each command, in alphabetical order, and the module that implements it.

    Parameters
    ----------
    packages : dotted names of command packages beside this one, such as ``"blender_addon.commands"``.
    """
    modules = {}
    for package in (__name__, *packages):
        found = pkgutil.iter_modules(importlib.import_module(package).__path__)
        modules.update(
            {
                info.name.replace("_", "-"): f"{package}.{info.name}"
                for info in found
                if not (info.ispkg or info.name.startswith("_"))
            }
        )
    return dict(sorted(modules.items()))


def _load(module: str) -> ModuleType:
    return importlib.import_module(module)


def _parsed(given: list[str], packages: Sequence[str]) -> tuple[argparse.Namespace, CommandParser]:
    """The arguments of a command line and its command's parser; a faulty line ends the program with status 2.

    A command's module may have a function ``unused`` from the arguments to the options that it would ignore, with the
    reason of each: they are refused. It may have a mapping ``NAMED`` from the library's names of numbers to the options
    that give them: errors name the options.
    """
    modules = command_packages(packages)
    name = given[0] if given else ""
    parser, commands = _parser(name, packages)
    if not name:
        parser.error(f"no command is given; expected one of: {', '.join(modules)}")
    if not name.startswith("-") and name not in modules:
        parser.error(str(UnknownNameError.among("command", name, modules)))
    parsed, others = parser.parse_known_args(given)
    if others:
        commands[parsed.command].refuse(others)
    return parsed, commands[parsed.command]


def _parser(name: str, packages: Sequence[str]) -> tuple[CommandParser, dict[str, CommandParser]]:
    """Parser of all commands, or of one alone, so that only its module is imported; and that of each command."""
    parser = CommandParser(prog="spectral-scene", description="Design and render spectral scenes.")
    parser.add_argument("--version", action="version", version=f"spectral-scene {__version__}")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", required=True)
    modules = command_packages(packages)
    for known in [name] if name in modules else modules:
        module = _load(modules[known])
        summary = " ".join((module.__doc__ or "").strip().split("\n\n")[0].split())
        sub = commands.add_parser(known, help=summary, description=module.__doc__)
        sub.formatter_class = argparse.RawDescriptionHelpFormatter
        sub.add_argument("--json", action="store_true", help="print one JSON object as the last line")
        module.add_arguments(sub)
        sub.set_defaults(run=module.run, unused=getattr(module, "unused", None), named=getattr(module, "NAMED", {}))
    return parser, commands.choices


def main(
    arguments: Sequence[str] | None = None, packages: Sequence[str] = (), program: Sequence[str] | None = None
) -> int:
    """Run one command and return its exit status; an error of this project is printed as one line.

    Parameters
    ----------
    arguments : the words after the program's name; by default those of this process.
    packages : dotted names of further command packages, see ``command_packages``.
    program : words that start this command line, with the same packages, in another process; by default
        those of ``python -P -m spectral_core.cli``.
    """
    given = list(sys.argv[1:] if arguments is None else arguments)
    # -P: other processes may begin in any folder, and its files are not to be imported
    words = list(program or (sys.executable, "-P", "-m", __name__))
    return terminal.completed(lambda: _run(given, packages, words), "spectral-scene")


def _run(given: list[str], packages: Sequence[str], program: list[str]) -> int:
    parsed, parser = _parsed(given, packages)
    parsed.program = program
    try:
        if parsed.unused is not None:
            parser.refuse_unused(parsed, parsed.unused(parsed))
        return int(parsed.run(parsed))
    except RenderCancelled as error:  # by Ctrl-C, which the renderer has received as well
        return _failed(parsed, error, str(error), terminal.STOPPED)
    except SpectralError as error:
        return _failed(parsed, error, by_option(str(error), parsed.named))
    except MemoryError as error:
        return _failed(parsed, error, f"not enough memory; use smaller settings ({error})")
    except BrokenPipeError:
        raise
    except OSError as error:
        if error.filename is None and not terminal.takes_output():
            raise  # `completed` names the output
        return _failed(parsed, error, _reason(error))
    except KeyboardInterrupt:
        print(f"spectral-scene {parsed.command}: stopped", file=sys.stderr)
        return terminal.STOPPED


def _reason(error: OSError) -> str:
    """What the system refused, with the file's name if it states one."""
    if error.filename is not None:
        return f"{error.filename}: {error.strerror or error}"
    try:
        Path.cwd()
    except FileNotFoundError:
        return "the current folder is deleted; change to another one"
    return error.strerror or str(error)


def _failed(parsed: argparse.Namespace, error: Exception, message: str, status: int = 1) -> int:
    """Print the reason in one line, and as JSON if requested; returns the exit status."""
    print(f"spectral-scene {parsed.command}: {terminal.one_line(message)}", file=sys.stderr)
    if parsed.json:
        print_json({"error": message, "kind": type(error).__name__})
    return status

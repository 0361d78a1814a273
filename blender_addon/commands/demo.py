# SPDX-License-Identifier: GPL-3.0-or-later
"""Build a still life, design two glazes for it, render it under two lights, and write pictures and a report.

The demo is a script that a reader can learn from, ``examples/demo`` of the source checkout.
"""

from __future__ import annotations

import argparse
import importlib
import sys
from pathlib import Path
from types import ModuleType

from spectral_core.errors import MissingDependencyError

CHECKOUT = Path(__file__).resolve().parents[2]


def _demo() -> ModuleType | None:
    """The demo's own command, or None if this package is installed without the checkout's ``examples``."""
    if not (CHECKOUT / "examples" / "demo" / "command.py").is_file():
        return None
    if str(CHECKOUT) not in sys.path:
        sys.path.append(str(CHECKOUT))
    return importlib.import_module("examples.demo.command")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    demo = _demo()
    if demo is not None:
        demo.add_arguments(parser)


def run(arguments: argparse.Namespace) -> int:
    """Make the demo."""
    demo = _demo()
    if demo is None:
        raise MissingDependencyError(
            "the demo is in the source checkout, not in the installed package; get the checkout and run `make demo`"
        )
    return int(demo.run(arguments))

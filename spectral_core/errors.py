# SPDX-License-Identifier: GPL-3.0-or-later
"""The error tree of the library.

::

    SpectralError
    ├── InvalidInputError (also ValueError)   a value from outside: what was given, expected, what to do
    │   ├── GridMismatchError                 two spectra on different wavelength grids
    │   ├── UnknownNameError                  a name that no catalogue has; suggests similar ones
    │   └── FileFormatError                   a file that is truncated, edited or of another type
    ├── FileWriteError                        a file could not be written; the earlier file is unchanged
    ├── MissingDependencyError                an optional package or library; names the remedy
    ├── SolveError                            a solver's answer that failed its check and had no fallback
    └── RenderError                           the renderer stopped
        └── RenderCancelled                   the user stopped it
"""

from __future__ import annotations

import difflib
import sys
from collections.abc import Iterable
from importlib.util import find_spec
from itertools import islice


class SpectralError(Exception):
    """Base of all errors that this project raises on purpose; its text can be shown to a user."""


def first_of(names: Iterable[object], count: int, most: int = 8) -> str:
    """The first ``most`` of ``count`` names, for a message, and how many more there are."""
    listed = ", ".join(str(name) for name in islice(names, most))
    return listed + (f" and {count - most} more" if count > most else "")


def counted(count: float, noun: str, plural: str = "", *, form: str = "") -> str:
    """A number of things, for a message: 1 sample, 2 samples. ``plural``: of a noun that takes more than an s.

    ``form`` writes the number, which may be no whole one.
    """
    number = format(count, form)
    return f"{number} {noun if number == '1' else plural or f'{noun}s'}"


class InvalidInputError(SpectralError, ValueError):
    """A value from outside is wrong; the message says what was given, what was expected and what to do."""


class GridMismatchError(InvalidInputError):
    """Two spectra have different wavelength grids."""


class UnknownNameError(InvalidInputError):
    """A name is in no catalogue."""

    @classmethod
    def among(cls, kind: str, given: str, known: Iterable[str]) -> UnknownNameError:
        """Build the message that lists the known names, the most similar first."""
        names = sorted(known)
        near = difflib.get_close_matches(str(given), names, n=3, cutoff=0.4)
        shown = [name or "'' (without a name)" for name in names[:20]]
        listed = first_of(shown, len(names), 20)
        hint = f"did you mean {' or '.join(map(repr, near))}?" if near else f"known: {listed}"
        if near and len(names) <= 8:  # few enough to list all of them
            hint += f" Known: {listed}"
        return cls(f"no {kind} is named {given!r}; {hint}")


class FileFormatError(InvalidInputError):
    """A file cannot be read in the expected format."""


class FileWriteError(SpectralError):
    """A file could not be written; the earlier one is unchanged."""


class MissingDependencyError(SpectralError):
    """An optional part is needed but missing; the message states how to install it."""

    @classmethod
    def package(cls, package: str, purpose: str, extra: str) -> MissingDependencyError:
        """Message for a Python package that an extra of this distribution installs."""
        return cls(f"{purpose} needs the Python package {package!r}; {how_to_install(package, extra)}")


CARRIED = frozenset(
    {
        "mitsuba", "drjit", "OpenEXR", "scipy", "daqp", "piqp", "threadpoolctl", "colour-science",
        "pynrrd", "nibabel", "tifffile", "mido", "python-osc",
    }
)  # fmt: skip
"""Packages that Blender's extension contains; a test compares them with the build."""


def how_to_install(package: str, extra: str = "") -> str:
    """Instruction for a missing Python package, for the Python that runs.

    ``extra``: the extra of this distribution that installs it; empty if none does. Blender's extension is no
    distribution of pip, and its user has no pip of Blender's Python at hand.
    """
    if not _in_extension():
        return "install it with: pip install " + (f"'spectral-scene[{extra}]'" if extra else package)
    if package in CARRIED:
        return "it is a part of this extension: install the extension again in Preferences ▸ Get Extensions"
    return f"install it with: {this_python()} -m pip install {package}, and start Blender again"


def this_python() -> str:
    """The running Python in a command line; within Blender it may be known by Blender's own name only."""
    return sys.executable if "python" in sys.executable.lower() else "the Python that Blender carries"


def _in_extension() -> bool:
    """True in Blender's extension and its processes: there this package came alone, without the add-on beside it."""
    return "blender_addon" not in sys.modules and find_spec("blender_addon") is None


class SolveError(SpectralError):
    """No engine gave an answer that passed its own check."""


class RenderError(SpectralError):
    """The renderer stopped before the picture was done."""


class RenderCancelled(RenderError):
    """The user stopped the render."""

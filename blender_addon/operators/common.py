# SPDX-License-Identifier: GPL-3.0-or-later
"""Functions that several operators share."""

import functools
from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy
from bpy.types import Context, Operator, PropertyGroup

from spectral_core.errors import InvalidInputError, SpectralError

Execute = Callable[[Any, Context], set[str] | None]
"""``execute`` of an operator; None where it finished."""
UNDOABLE = {"REGISTER", "UNDO"}


def reporting(execute: Execute) -> Callable[[Any, Context], set[str]]:
    """Report an error of this project as one line to the artist, and cancel the operator."""

    @functools.wraps(execute)
    def reported(self: Operator, context: Context) -> set[str]:
        try:
            return execute(self, context) or {"FINISHED"}
        except (SpectralError, OSError) as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}

    return reported


def palette_in(context: Context) -> PropertyGroup:
    """The palette of the scene in the window."""
    return context.scene.spectral.palette


def require_index(what: str, index: int, count: int) -> int:
    """``index`` when 0 <= index < count; else InvalidInputError."""
    if not 0 <= index < count:
        raise InvalidInputError(f"there is no {what} {index}; the palette has {count}, counted from 0")
    return index


def chosen_path(filepath: str) -> Path:
    """The path that an operator was given. Raises InvalidInputError if it was given none."""
    if not filepath.strip():
        raise InvalidInputError("no file is chosen; give its path as filepath=…")
    return Path(bpy.path.abspath(filepath))

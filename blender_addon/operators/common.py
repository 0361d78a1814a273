# SPDX-License-Identifier: GPL-3.0-or-later
"""What the operators of this extension share."""

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
    """An error that this project raises on purpose becomes one line for the artist, and the operator is cancelled."""

    @functools.wraps(execute)
    def reported(self: Operator, context: Context) -> set[str]:
        try:
            return execute(self, context) or {"FINISHED"}
        except (SpectralError, OSError) as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}

    return reported


def palette_in(context: Context) -> PropertyGroup:
    """The palette of the scene that is being looked at."""
    return context.scene.spectral.palette


def require_index(what: str, index: int, count: int) -> int:
    """``index`` when 0 <= index < count; else InvalidInputError."""
    if not 0 <= index < count:
        raise InvalidInputError(f"there is no {what} {index}; the palette has {count}, counted from 0")
    return index


def chosen_path(filepath: str) -> Path:
    """The file that an operator was told. Raises InvalidInputError where it was told none."""
    if not filepath.strip():
        raise InvalidInputError("no file is chosen; give its path as filepath=…")
    return Path(bpy.path.abspath(filepath))

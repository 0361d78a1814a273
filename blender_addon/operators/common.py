# SPDX-License-Identifier: GPL-3.0-or-later
"""Functions that several operators share."""

import functools
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import bpy
from bpy.types import Context, Event, Operator, PropertyGroup, Scene

from spectral_core.errors import InvalidInputError, SpectralError

from .. import compat
from ..editing import waiting
from ..editing.apart import STOPPABLE
from ..translate.spectra.stored import library_of

Execute = Callable[[Any, Context], set[str] | None]
"""``execute`` of an operator; returns None if it finished."""
UNDOABLE = {"REGISTER", "UNDO"}


def ends_drag(event: Event) -> bool:
    """True if the left button was released, or if another program has the mouse now: the release may go there."""
    return event.type == "WINDOW_DEACTIVATE" or (event.type == "LEFTMOUSE" and event.value == "RELEASE")


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


def with_menu_entry(
    classes: Sequence[type], draw_menu: Callable[[Any, Context], None]
) -> tuple[Callable[[], None], Callable[[], None]]:
    """``register`` and ``unregister`` of operators with an entry in the context menu of every control."""
    register_classes, unregister_classes = bpy.utils.register_classes_factory(classes)

    def register() -> None:
        register_classes()
        bpy.types.UI_MT_button_context_menu.append(draw_menu)

    def unregister() -> None:
        bpy.types.UI_MT_button_context_menu.remove(draw_menu)
        unregister_classes()

    return register, unregister


def palette_shown(context: Context) -> PropertyGroup:
    """The palette of the scene in the window, to read it."""
    return context.scene.spectral.palette


def palette_in(context: Context) -> PropertyGroup:
    """The palette of the scene in the window, to change it. Raises InvalidInputError if the scene is linked."""
    require_kept(context.scene, "palette")
    return palette_shown(context)


def require_kept(scene: Scene, what: str) -> None:
    """Raise InvalidInputError if a scene is linked: Blender does not keep changes of such a scene."""
    if not compat.is_editable(scene):
        source = bpy.path.basename(library_of(scene).filepath)
        raise InvalidInputError(
            f"scene {scene.name!r} is linked from {source}, and Blender does not keep changes of its {what}; open "
            f"{source}, or press New Scene ▸ Full Copy and work in the copy"
        )


def require_index(what: str, index: int, count: int) -> int:
    """``index`` if 0 <= index < count; else raises InvalidInputError."""
    if not 0 <= index < count:
        raise InvalidInputError(f"there is no {what} {index}; there are {count}, counted from 0")
    return index


def add_or_remove(rows: Any, index: int, what: str) -> None:
    """Add a row to a collection if ``index`` is -1, else remove that row. Raises InvalidInputError for an invalid
    index.
    """
    if index < 0:
        rows.add()
    else:
        rows.remove(require_index(what, index, len(rows)))


def chosen_path(filepath: str) -> Path:
    """The path argument of an operator. Raises InvalidInputError if it is empty, or beside a .blend without a place."""
    if not filepath.strip():
        raise InvalidInputError("no file is chosen; give its path as filepath=…")
    if filepath.startswith("//") and not bpy.data.filepath:
        raise InvalidInputError(
            f"{filepath} is beside the .blend file, which was never saved; save it first, or give a full path"
        )
    return Path(bpy.path.abspath(filepath)).absolute()  # Blender itself cannot write to a path of the current folder


def register() -> None:
    """Nothing to add: operators that wait note themselves when they begin."""


def unregister() -> None:
    """End the operators that wait, while their classes are still registered, and the processes of their work."""
    waiting.end_all()
    STOPPABLE.end()

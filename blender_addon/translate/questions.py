# SPDX-License-Identifier: GPL-3.0-or-later
"""Questions about data that Blender's reports do not tie to the items that read them: files, texts, other settings.

A part of a translation that asks one (``Translation.ask``) is made again when the answer is another.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import bpy

from .context import Translation


@dataclass(frozen=True)
class StateOfFile:
    """Time and size of the file at a path; None without it."""

    path: str

    def __call__(self, _translation: Translation) -> tuple[int, int] | None:
        return state_of_file(self.path)


def state_of_file(path: str) -> tuple[int, int] | None:
    """Time and size of a file; None without it."""
    try:
        state = Path(path).stat()
    except (OSError, ValueError):
        return None
    return state.st_mtime_ns, state.st_size


@dataclass(frozen=True)
class ContentOfText:
    """A number that differs between contents of the text data-block with a session number; None without it."""

    session_uid: int

    def __call__(self, _translation: Translation) -> int | None:
        found = next((text for text in bpy.data.texts if text.session_uid == self.session_uid), None)
        return None if found is None else hash(found.as_string())


def distance_of_world(translation: Translation) -> float:
    """The distance of ambient occlusion of the scene's world, 0 without a world."""
    world = translation.scene.world
    return 0.0 if world is None else float(world.light_settings.distance)

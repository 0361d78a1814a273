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


@dataclass(frozen=True)
class IsWhatRenders:
    """True if the UV map for rendering has this name on every mesh with the material."""

    uv_map: str
    material: str

    def __call__(self, translation: Translation) -> bool:
        return translation.answer(maps_that_render).get(self.material, frozenset()) <= {self.uv_map}


def maps_that_render(_translation: Translation) -> dict[str, frozenset[str]]:
    """By the name of a material, the UV maps for rendering of the meshes that have it, "" for a mesh without one."""
    found: dict[str, set[str]] = {}
    for mesh in bpy.data.meshes:
        if len(mesh.materials):
            renders = next((layer.name for layer in mesh.uv_layers if layer.active_render), "")
            for material in mesh.materials:
                if material is not None:
                    found.setdefault(material.name, set()).add(renders)
    return {name: frozenset(maps) for name, maps in found.items()}


def distance_of_world(translation: Translation) -> float:
    """The distance of ambient occlusion of the scene's world, 0 without a world."""
    world = translation.scene.world
    return 0.0 if world is None else float(world.light_settings.distance)

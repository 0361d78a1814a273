# SPDX-License-Identifier: GPL-3.0-or-later
"""What of a translation serves the next one: everything that no edit has touched."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Any, TypeVar

from spectral_core.scene import Mesh, Note

from ..context import Translation

Value = TypeVar("Value")

KNOWN = frozenset(
    ("Object", "Mesh", "Material", "World", "Scene", "Camera", "PointLight", "SunLight", "SpotLight", "AreaLight")
)
"""Blender's names of data whose edits touch nothing but what was made from it. Any other edit drops all but meshes."""


@dataclass(frozen=True, slots=True, eq=False)
class Part:
    """One kept piece. ``makers``: session numbers of what it was made from. ``state``: what else it depends on."""

    value: Any
    makers: frozenset[int]
    state: Any
    notes: tuple[Note, ...]


@dataclass
class Kept:
    """Pieces of the translations of one viewport.

    ``meshes``: by evaluated data and what is read of it, each with the session numbers of what it was made from.
    ``parts``: materials, objects, lamps and worlds, by their kind and session number. ``images``: as ``Translation``
    has them.
    """

    meshes: dict[Any, tuple[Mesh | None, frozenset[int]]] = field(default_factory=dict)
    parts: dict[Any, Part] = field(default_factory=dict)
    images: dict[Any, Any] = field(default_factory=dict)

    def clear(self) -> None:
        """Drop everything, where nobody says what has changed: after an undo, or another frame."""
        self.meshes.clear()
        self.parts.clear()
        self.images.clear()

    def forget(self, updates: Iterable[Any]) -> None:
        """Drop what the edits of a depsgraph have touched (``depsgraph.updates``)."""
        touched: set[int] = set()
        reshaped: set[int] = set()
        for update in updates:
            block = update.id.original
            kind = block.bl_rna.identifier
            if kind == "Image":
                self.images.clear()
            if kind not in KNOWN and not (kind == "ShaderNodeTree" and block.is_embedded_data):
                self.parts.clear()
            if update.is_updated_geometry:
                reshaped.add(block.session_uid)
            only_shading = update.is_updated_shading and not (update.is_updated_geometry or update.is_updated_transform)
            if kind != "Object" or not only_shading:  # each material's edit lists all objects that it is on
                touched.add(block.session_uid)
        self.drop(touched)
        if reshaped:
            self.meshes = {key: kept for key, kept in self.meshes.items() if not kept[1] & reshaped and kept[1]}

    def drop(self, makers: set[int]) -> None:
        """Drop what was made from any of these (session numbers)."""
        if makers:
            self.parts = {key: part for key, part in self.parts.items() if part.makers.isdisjoint(makers)}

    def mesh(self, key: Any, makers: frozenset[int], make: Callable[[], Mesh | None]) -> Mesh | None:
        """The mesh of a key, made where none is kept."""
        if key not in self.meshes:
            self.meshes[key] = make(), makers
        return self.meshes[key][0]


def kept_or_made(
    kept: Kept | None,
    translation: Translation,
    key: tuple[str, Any],
    makers: frozenset[int],
    state: Any,
    make: Callable[[], Value],
) -> Value:
    """What ``make`` returns, with its notes; where nothing has changed since it was made, without making it.

    ``key``: kind and session number. ``state``: compared with what it was; for what Blender tells of no change.
    """
    if kept is None:
        return make()
    found = kept.parts.get(key)
    if found is not None and found.state == state:
        for note in found.notes:
            translation.note(note.subject, note.message)
        return found.value
    with translation.listening() as heard:
        value = make()
    kept.parts.pop(key, None)
    if not heard.reads_elsewhere:
        kept.parts[key] = Part(value, makers, state, heard.notes)
    return value

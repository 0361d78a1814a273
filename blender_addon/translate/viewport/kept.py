# SPDX-License-Identifier: GPL-3.0-or-later
"""What of a translation serves the next one: meshes and images that no edit has touched."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Any

from spectral_core.scene import Mesh


@dataclass
class Kept:
    """Meshes and images of the translations of one viewport.

    ``meshes``: by evaluated data and what is read of it, each with the session numbers of what it was made from.
    ``images``: as ``Translation`` has them.
    """

    meshes: dict[Any, tuple[Mesh | None, frozenset[int]]] = field(default_factory=dict)
    images: dict[Any, Any] = field(default_factory=dict)

    def forget(self, updates: Iterable[Any]) -> None:
        """Drop what the edits of a depsgraph have touched (``depsgraph.updates``)."""
        touched: set[int] = set()
        for update in updates:
            block = update.id.original
            if update.is_updated_geometry:
                touched.add(block.session_uid)
            if block.bl_rna.identifier == "Image":
                self.images.clear()
        if touched:
            self.meshes = {key: kept for key, kept in self.meshes.items() if not kept[1] & touched and kept[1]}

    def mesh(self, key: Any, makers: frozenset[int], make: Callable[[], Mesh | None]) -> Mesh | None:
        """The mesh of a key, made where none is kept."""
        if key not in self.meshes:
            self.meshes[key] = make(), makers
        return self.meshes[key][0]

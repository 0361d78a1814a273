# SPDX-License-Identifier: GPL-3.0-or-later
"""A copy of a mesh that is split along its sharp edges, as Blender splits meshes for Cycles."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from .measures import READ, has_sharp_edges


@contextmanager
def split_as_for_cycles(obj: Any, reads: frozenset[str]) -> Iterator[Any]:
    """The split copy of an evaluated object's mesh, with the same faces and corners; None if ``reads`` has no number
    that the split changes: islands, pointiness, and attributes of edges.
    """
    source = obj.data
    is_split = source.normals_domain == "CORNER" and (source.has_custom_normals or has_sharp_edges(source))
    if not is_split or not any(splits(source, name) for name in reads):
        yield None
        return
    try:
        copy = obj.to_mesh()
        copy.split_faces()
        yield copy
    finally:
        obj.to_mesh_clear()


def splits(source: Any, name: str) -> bool:
    """True if a program's input ``name`` depends on the vertices of the split mesh."""
    if name.startswith(READ):
        return True
    found = source.attributes.get(name.partition(":")[2])
    return found is not None and found.domain == "EDGE"

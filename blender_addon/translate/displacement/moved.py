# SPDX-License-Identifier: GPL-3.0-or-later
"""Displaced meshes: the vertices of an object moved by its materials' displacement, as Cycles moves them.

Cycles evaluates the displacement once at each vertex, with its smooth normal, and adds no vertices of its own.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from enum import Enum, auto
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.scene import Mesh
from spectral_core.scene.geometry import Attribute

from ... import compat
from ..meshes.measures import has_sharp_edges
from ..meshes.tangents import SPACE
from ..shading.attributes import UNDISPLACED, object_info
from ..viewport.kept import kept_or_made
from .offset import Displacement

Array = NDArray[Any]


def displaced(found: Any, obj: Any, instance: Any, mesh: Mesh, materials: Sequence[Any]) -> Mesh:
    """The mesh of an object as its materials (``TranslatedMaterial``) displace it; the same mesh if none does."""
    moves = [item.displacement for item in materials]
    if not any(moves):
        return mesh
    matrix = np.array(instance.matrix_world, dtype=np.float64)
    numbers = object_info(obj, instance)
    for name in sorted(_unread(mesh, moves, numbers)):
        words = name.replace("_", " ")
        found.translation.note(obj.name, f"its displacement depends on the {words}, unknown at vertices here")
    if mesh.normals is None and any(move is not None and not move.bends for move in moves):
        message = "Displacement and Bump shades flat faces differently from Cycles; shade the mesh smooth"
        found.translation.note(obj.name, message)
    # objects of one mesh share its displaced form, as in Cycles
    key = ("displaced", mesh.name, *(item.material.name for item in materials))
    if key not in found.meshes:
        edges = Edges.SMOOTH
        if obj.type == "MESH" and has_sharp_edges(obj.data):
            edges = Edges.APART if compat.is_before_5_2() else Edges.TOGETHER
        make, number = partial(moved_mesh, mesh, moves, matrix, numbers, edges), obj.original.session_uid
        state = (mesh, tuple(moves), matrix.tobytes(), tuple(numbers.items()), edges.name)
        made = kept_or_made(found.kept, found.translation, ("displaced", number), frozenset((number,)), state, make)
        found.meshes[key] = replace(made, name=found.unique("mesh", f"{mesh.name} displaced"))
        found.settle_names()
    return found.meshes[key]


class Edges(Enum):
    """What Cycles makes of sharp edges: there are none; up to Blender 5.1 the faces beside them move apart; from 5.2 on
    they stay together, and a vertex moves along the normal of its first corner.
    """

    SMOOTH = auto()
    APART = auto()
    TOGETHER = auto()


AT_VERTICES = frozenset({"position", "normal", "true_normal", "incoming", "uv", "world_transform", "object_transform"})
"""Inputs of programs that a vertex has."""
OF_STRANDS = "attribute_strand"
"""Beginning of inputs that hair alone has; they are 0 at the vertices of a mesh."""
NAMED = ("attribute:", "attribute_uv:")
"""Beginnings of attributes by name, which are 0 on a mesh that lacks them."""
ZERO = ("ray:", "attribute_alpha", "attribute_factor", "backfacing")
"""Beginnings of inputs that are 0 at a vertex in Cycles, too; ``note_missing`` names attributes that a mesh lacks."""


def _unread(mesh: Mesh, moves: Sequence[Displacement | None], numbers: Mapping[str, Any]) -> set[str]:
    """Inputs of the displacement that vertices do not have."""
    asked = {name for move in moves if move is not None for name in move.offset.program.inputs}
    known = AT_VERTICES | set(numbers) | {attribute.name for attribute in mesh.attributes}
    return {name for name in asked - known if not name.startswith((*ZERO, OF_STRANDS, *SPACE, *NAMED))}


def moved_mesh(
    mesh: Mesh,
    moves: Sequence[Displacement | None],
    matrix: Array,
    numbers: Mapping[str, tuple[float, ...]] | None = None,
    edges: Edges = Edges.SMOOTH,
) -> Mesh:
    """A mesh with moved vertices.

    Parameters
    ----------
    mesh : the mesh.
    moves : displacement of each material slot.
    matrix : (4, 4) world from object.
    numbers : what the Object Info node gives, by the input's name.
    edges : its sharp edges.
    """
    positions = mesh.positions.astype(np.float64)
    alike = positions if edges is not Edges.APART or mesh.normals is None else np.hstack([positions, mesh.normals])
    _, first, welded = np.unique(alike, axis=0, return_index=True, return_inverse=True)
    welded = welded.reshape(-1)
    slots = np.zeros(len(mesh.triangles), int) if mesh.material_indices is None else mesh.material_indices.astype(int)
    slots = np.minimum(slots, len(moves) - 1)
    normals = _smooth_normals(positions, mesh.triangles, welded, len(first))[welded]
    if edges is Edges.TOGETHER and mesh.normals is not None:
        normals = mesh.normals.astype(np.float64)
    backward = np.linalg.pinv(matrix[:3, :3])
    offsets = np.zeros((len(first), 3))
    done = np.zeros(len(first), bool)
    corners, of_slot = mesh.triangles.reshape(-1), np.repeat(slots, 3)
    for slot, move in enumerate(moves):
        chosen = corners[of_slot == slot]
        if move is None or len(chosen) == 0:
            continue
        vertices, at = np.unique(welded[chosen], return_index=True)
        fresh = ~done[vertices]
        vertices, places = vertices[fresh], chosen[at[fresh]]
        done[vertices] = True
        read = _Reading(mesh, matrix, positions, normals, places, numbers or {})
        found = np.nan_to_num(move.offset.program.evaluate(read, transform=read.transform), posinf=0.0, neginf=0.0)
        offsets[vertices] = np.broadcast_to(found.reshape(len(found), -1), (len(vertices), 3)) @ backward.T
    before, positions = positions, positions + offsets[welded]
    bent = np.array([move is not None and move.bends for move in moves])[slots]
    shaded: Array | None = mesh.normals
    if shaded is not None and edges is Edges.TOGETHER:  # corners turn as the normals of their vertices do
        turned, kept = (_vertex_normals(at, mesh.triangles, welded, len(first)) for at in (positions, before))
        shaded = shaded.astype(np.float64)
        shaded = _unit(shaded + (turned - kept)[welded], shaded)
    elif shaded is not None and bent.any():
        sums = _vertex_normals(positions, mesh.triangles[bent], welded, len(first))
        touched = np.unique(mesh.triangles[bent])
        shaded = shaded.astype(np.float64).copy()
        shaded[touched] = _unit(sums[welded[touched]], shaded[touched])
    normals_out = None if shaded is None else np.asarray(shaded, np.float32)
    attributes = mesh.attributes
    if any(move is not None and not move.bends for move in moves):
        attributes = (*attributes, Attribute(UNDISPLACED, mesh.positions))
    return replace(mesh, positions=positions.astype(np.float32), normals=normals_out, attributes=attributes)


class _Reading:
    """Inputs of a program at chosen vertices of a mesh, ``places``."""

    def __init__(
        self,
        mesh: Mesh,
        matrix: Array,
        positions: Array,
        normals: Array,
        places: Array,
        numbers: Mapping[str, tuple[float, ...]],
    ) -> None:
        self._mesh, self._matrix, self._places, self._numbers = mesh, matrix, places, numbers
        self._positions, self._normals = positions, normals
        turning = np.linalg.pinv(matrix[:3, :3]).T
        self._position = positions[places] @ matrix[:3, :3].T + matrix[:3, 3]
        self._normal = _unit(normals[places] @ turning.T, normals[places])

    def __call__(self, name: str, shift: int) -> Any:
        zero = np.zeros(len(self._places))
        if name == "position":
            return tuple(self._position.T)
        if name in ("normal", "true_normal", "incoming"):  # as in Cycles, each vertex is seen along its normal
            return tuple(self._normal.T)
        if name == "uv":
            uvs = np.zeros((len(self._mesh.positions), 2)) if self._mesh.uvs is None else self._mesh.uvs
            return (*uvs[self._places].astype(np.float64).T, zero)
        if name in self._numbers:
            parts = tuple(zero + part for part in self._numbers[name])
            return parts if len(parts) > 1 else parts[0]
        for attribute in self._mesh.attributes:
            if attribute.name == name:
                values = tuple(attribute.values[self._places].astype(np.float64).T)
                return values[0] if name.startswith(("attribute_alpha", "attribute_factor")) else values
        if name.startswith(ZERO):
            return zero
        return (zero, zero, zero)

    def transform(self, vector: Any, kind: str, space: str, inverse: bool) -> Any:
        """From the world to the object's space, or back; the camera's space counts as the world's."""
        if space != "OBJECT":
            return vector
        matrix = self._matrix if inverse else np.linalg.pinv(self._matrix)
        rows = np.stack(np.broadcast_arrays(*vector), axis=-1)
        turning = np.linalg.pinv(matrix[:3, :3]).T if kind == "NORMAL" else matrix[:3, :3]
        turned = rows @ turning.T + (matrix[:3, 3] if kind == "POINT" else 0.0)
        return tuple(turned.T)


def _face_normals(positions: Array, triangles: Array) -> Array:
    first, second, third = (positions[triangles[:, k]] for k in range(3))
    crossed = np.cross(second - first, third - first)
    return _unit(crossed, np.zeros_like(crossed))


def _vertex_normals(positions: Array, triangles: Array, welded: Array, count: int) -> Array:
    """Normal (count, 3) of each welded vertex of some triangles, each of which counts once; 0 without any."""
    faces, sums = _face_normals(positions, triangles), np.zeros((count, 3))
    for k in range(3):
        np.add.at(sums, welded[triangles[:, k]], faces)
    return _unit(sums, np.zeros_like(sums))


def _smooth_normals(positions: Array, triangles: Array, welded: Array, count: int) -> Array:
    """Normal (count, 3) of each welded vertex: of its faces, weighted by their angles there, as Blender's."""
    faces, sums = _face_normals(positions, triangles), np.zeros((count, 3))
    for k in range(3):
        here, after, before = (positions[triangles[:, (k + j) % 3]] for j in range(3))
        one, other = (_unit(side - here, np.zeros_like(here)) for side in (after, before))
        angle = np.arccos(np.clip(np.sum(one * other, axis=1), -1, 1))
        np.add.at(sums, welded[triangles[:, k]], faces * angle[:, None])
    return _unit(sums, np.broadcast_to((0.0, 0.0, 1.0), sums.shape))


def _unit(vectors: Array, fallback: Array) -> Array:
    lengths = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.where(lengths > 1e-30, vectors / np.maximum(lengths, 1e-30), fallback)

# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes as Mitsuba shapes: one per material, in world space, or shared as a shape group if used more than once."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.render.mitsuba_scene.context import Context
from spectral_core.render.plugins.numbers import aligned, own_copy
from spectral_core.render.plugins.paints.tables import attribute_name
from spectral_core.render.plugins.placing import cofactors, crossed
from spectral_core.scene.geometry import Attribute, Mesh


@dataclass(frozen=True, slots=True, eq=False)
class Part:
    """Triangles of one material, ready for Mitsuba: float32 (v, 3), uint32 (t, 3), and their attributes."""

    name: str
    positions: NDArray[np.float32]
    triangles: NDArray[np.uint32]
    normals: NDArray[np.float32] | None
    uvs: NDArray[np.float32] | None
    attributes: tuple[Attribute, ...] = ()


_FEW = 4096
"""Triangles that are examined together."""


def split_by_material(mesh: Mesh) -> dict[int, Part]:
    """Material index -> its triangles; triangles without area are omitted, because they can be neither hit nor
    sampled.
    """
    solid = np.any(_doubled_areas(mesh.positions, mesh.triangles) != 0, axis=1)
    indices = np.zeros(len(mesh.triangles), np.uint16) if mesh.material_indices is None else mesh.material_indices
    used = np.unique(indices[solid])
    if used.size == 1 and solid.all():
        return {int(used[0]): Part(mesh.name, mesh.positions, mesh.triangles, mesh.normals, mesh.uvs, mesh.attributes)}
    return {int(index): _subset(mesh, mesh.triangles[solid & (indices == index)], int(index)) for index in used}


def _subset(mesh: Mesh, triangles: NDArray[np.uint32], index: int) -> Part:
    """The part of a mesh that some of its triangles use, vertices renumbered."""
    used = np.zeros(len(mesh.positions), bool)
    used[triangles.ravel()] = True
    renumbered = (np.cumsum(used) - 1).astype(np.uint32)
    pick = lambda values: None if values is None else values[used]  # noqa: E731
    attributes = tuple(Attribute(item.name, item.values[used]) for item in mesh.attributes)
    name = f"{mesh.name}.{index}"
    return Part(name, mesh.positions[used], renumbered[triangles], pick(mesh.normals), pick(mesh.uvs), attributes)


def transformed(part: Part, matrix: NDArray[np.float64]) -> Part:
    """The part in world space. A mirroring matrix reverses the order of corners, so that the front stays the front."""
    linear = matrix[:3, :3]
    positions = (part.positions.astype(np.float64) @ linear.T + matrix[:3, 3]).astype(np.float32)
    turning, determinant = cofactors(linear)
    mirrored = determinant < 0
    triangles = np.ascontiguousarray(part.triangles[:, ::-1]) if mirrored else part.triangles
    normals = part.normals
    if normals is not None:
        # normals are transformed by the cofactors: the inverse transpose times the determinant, finite even if it is 0
        turned = normals.astype(np.float64) @ turning.T * (-1.0 if mirrored else 1.0)
        lengths = np.linalg.norm(turned, axis=1, keepdims=True)
        normals = np.divide(turned, lengths, out=np.zeros_like(turned), where=lengths > 0).astype(np.float32)
    return Part(part.name, positions, triangles, normals, part.uvs, part.attributes)


def mesh_shape(context: Context, part: Part, children: dict[str, Any]) -> Any:
    """Mitsuba mesh of a part, with its BSDF, emitter and media (``children``, by any name)."""
    mi = context.mitsuba
    properties = mi.Properties()
    for name, child in children.items():
        properties[name] = child
    if part.normals is None:
        properties["face_normals"] = True
    mesh = mi.Mesh(
        part.name,
        vertex_count=len(part.positions),
        face_count=len(part.triangles),
        has_vertex_normals=part.normals is not None,
        has_vertex_texcoords=part.uvs is not None,
        props=properties,
    )
    for attribute in part.attributes:
        mesh.add_attribute(attribute_name(attribute.name), 3, attribute.values.ravel())
    parameters = mi.traverse(mesh)
    arrays = {"vertex_positions": part.positions, "faces": part.triangles}
    if part.normals is not None:
        arrays["vertex_normals"] = part.normals
    if part.uvs is not None:
        arrays["vertex_texcoords"] = part.uvs
    for name, array in arrays.items():
        kind = type(parameters[name])
        parameters[name] = own_copy(kind, array) if context.movable else kind(aligned(array))
    parameters.update()
    return mesh


def fill(mi: Any, mesh: Any, old: Part, new: Part, *, faces: bool) -> bool:
    """Write the vertices of ``new`` into a Mitsuba mesh that was made of ``old``; False if the two do not match.

    ``faces``: write the corners of its triangles, too, which may be others in the same number: an edit of a vertex lets
    Blender divide quadrilaterals along the other diagonal.
    Mitsuba's scene must be updated afterward (``parameters_changed``), before anything is traced.
    """
    optional = ((old.normals, new.normals), (old.uvs, new.uvs))
    if any((before is None) != (after is None) for before, after in optional):
        return False
    if len(old.triangles) != len(new.triangles) or len(old.positions) != len(new.positions):
        return False
    arrays = {"vertex_normals": new.normals, "vertex_texcoords": new.uvs}
    arrays |= {attribute_name(item.name): item.values for item in new.attributes}
    # Mitsuba computes its own normals for new positions, so ours are written after it
    shape = {"vertex_positions": new.positions} | ({"faces": new.triangles} if faces else {})
    for group in (shape, arrays):
        parameters = mi.traverse(mesh)
        for name, array in group.items():
            if array is not None:
                parameters[name] = own_copy(type(parameters[name]), array)
        parameters.update()
    return True


def polygon(corners: NDArray[np.float64], name: str) -> Part:
    """A flat convex polygon (n, 3), fanned into triangles; its front sees the corners counterclockwise."""
    count = len(corners)
    fan = np.array([[0, k, k + 1] for k in range(1, count - 1)], np.uint32)
    return Part(name, corners.astype(np.float32), fan, None, None)


def area_of(part: Part) -> float:
    """Sum of the triangles' areas."""
    return float(np.linalg.norm(_doubled_areas(part.positions, part.triangles), axis=1).sum() / 2)


def has_area(part: Part) -> bool:
    """True if any triangle has an area; usually one of the first has."""
    return any(
        bool(np.any(_doubled_areas(part.positions, part.triangles[first : first + _FEW])))
        for first in range(0, len(part.triangles), _FEW)
    )


def _doubled_areas(positions: NDArray[np.float32], triangles: NDArray[np.uint32]) -> NDArray[np.float64]:
    """Normals (t, 3) of triangles, as long as twice their areas."""
    first, second, third = (positions[triangles[:, corner]].astype(np.float64) for corner in range(3))
    return crossed(second - first, third - first)

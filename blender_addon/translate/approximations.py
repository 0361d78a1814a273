# SPDX-License-Identifier: GPL-3.0-or-later
"""Notes that depend on the whole scene: materials, shapes and light paths that together differ from Cycles."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.scene import (
    Glass,
    Glossy,
    Instance,
    Mesh,
    Metal,
    Principled,
    Scene,
    Sheen,
    Subsurface,
    Surface,
    Translucent,
    leaves,
)
from spectral_core.scene.geometry import placed, placed_boxes

from .context import Translation
from .meshes.triangles import OUTPUTS, uv_layer

Array = NDArray[np.float64]

FEW = 0.01
"""Largest share of corners whose normals point to the other side of their faces."""
MOST_TRIANGLES, MOST_PLANES = 20_000, 32
"""Triangles of a mesh, and planes of its largest faces, that are compared with those of other meshes."""
MOST_COMPARED = 1_000_000
"""Triangles of other meshes that are compared in one scene, so that thousands of instances do not delay a render."""
LARGE_FACE = 0.01
"""Share of a mesh's area from which a triangle is compared."""
RAY_STEP = 1e-4
"""Distance to a surface from which rays start, relative to the coordinates plus 1."""


def note_approximations(translation: Translation, scene: Scene, *, is_render: bool) -> None:
    """Add one note per object, light or scene; in a viewport without those on faces that coincide."""
    surfaces = {material.name: material.surface for material in scene.materials}
    meshes = {mesh.name: mesh for mesh in scene.meshes}
    enters = {name for name, surface in surfaces.items() if _enters(surface)}
    turned: dict[str, bool] = {}
    for instance in scene.instances:
        if not enters.intersection(instance.materials):
            continue
        if instance.mesh not in turned:
            turned[instance.mesh] = _is_turned(meshes[instance.mesh])
        if turned[instance.mesh]:
            message = (
                "faces of its smooth-shaded mesh point both outward and inward: translucent, subsurface and sheen "
                "light differs from Cycles there; Mesh > Normals > Recalculate Outside mends the mesh"
            )
            translation.note(instance.name, message)
    if is_render:
        passes = enters | {name for name, surface in surfaces.items() if _refracts(surface)}
        for name, other in _coincident(scene, meshes, passes):
            message = (
                f"faces of it coincide with faces of {other!r}: Cycles loses light between them, and here it is kept; "
                "move it by a thousandth of its size"
            )
            translation.note(name, message)
    film = scene.film
    if film.transparent and film.transparent_glass:
        for name, surface in surfaces.items():
            if _refracts(surface) and any(getattr(leaf, "roughness", 0.0) != 0 for leaf in leaves(surface)):
                message = "Transparent Glass applies to smooth glass; this rough glass covers the background"
                translation.note(name, message)
    if not any(_is_mixed(surface) for surface in surfaces.values()):
        return
    limits = scene.settings.light_paths
    if not (limits.reflective_caustics and limits.refractive_caustics):
        message = "caustics are off: a surface that is partly diffuse keeps the caustics of its glossy part"
        translation.note(translation.scene.name, message)


def _refracts(surface: Surface | None) -> bool:
    return any(
        isinstance(leaf, Glass) or (isinstance(leaf, Principled) and leaf.transmission != 0) for leaf in leaves(surface)
    )


def _enters(surface: Surface | None) -> bool:
    return any(
        isinstance(leaf, (Translucent, Subsurface, Sheen))
        or (isinstance(leaf, Principled) and (leaf.subsurface_weight != 0 or leaf.sheen_weight != 0))
        for leaf in leaves(surface)
    )


def _is_mixed(surface: Surface | None) -> bool:
    """True if a surface scatters both diffusely and like a mirror."""
    kinds = {isinstance(leaf, (Glossy, Metal, Glass)) for leaf in leaves(surface)}
    return len(kinds) == 2 or any(isinstance(leaf, Principled) for leaf in leaves(surface))


def _is_turned(mesh: Mesh) -> bool:
    """True if interpolated normals point to the other side of their faces."""
    if mesh.normals is None:
        return False
    faces = np.cross(*_edges(mesh.positions[mesh.triangles].astype(np.float64)))
    size = np.linalg.norm(faces, axis=1)
    kept = size > 0
    normals = mesh.normals[mesh.triangles[kept]].astype(np.float64)
    cosines = np.einsum("tci,ti->tc", normals, faces[kept] / size[kept, None])
    return bool((cosines < 0.0).mean() > FEW) if cosines.size else False


def _edges(triangles: Array) -> tuple[Array, Array]:
    return triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]


def _coincident(scene: Scene, meshes: dict[str, Mesh], materials: set[str]) -> Iterator[tuple[str, str]]:
    """Names of instances with some of the materials, each with one that a large face of it lies on."""
    chosen = [item for item in scene.instances if materials.intersection(item.materials)]
    if not chosen:
        return
    counts = {name: len(mesh.triangles) for name, mesh in meshes.items()}
    boxes = np.array([_ends(box) for box in placed_boxes(scene.meshes, scene.instances)])
    places = {item.name: place for place, item in enumerate(scene.instances)}
    left = MOST_COMPARED
    for item in chosen:
        left -= len(boxes)
        if left <= 0:
            return
        if not 0 < counts[item.mesh] <= MOST_TRIANGLES:
            continue
        own = boxes[places[item.name]]
        meet = np.flatnonzero(np.all((own[0] <= boxes[:, 1]) & (boxes[:, 0] <= own[1]), axis=1))
        planes: list[tuple[Array, float, Array]] = []
        for other in (scene.instances[place] for place in meet if place != places[item.name]):
            if counts[other.mesh] > MOST_TRIANGLES or left <= 0:
                continue
            left -= counts[other.mesh]
            planes = planes or _planes(_triangles(meshes[item.mesh], item))
            if _lies_on(planes, _triangles(meshes[other.mesh], other)):
                yield item.name, other.name
                break
        else:
            if _lies_on_itself(_triangles(meshes[item.mesh], item)):
                yield item.name, item.name


def _triangles(mesh: Mesh, item: Instance) -> Array:
    """Corners (t, 3, 3) in the world."""
    return placed(mesh.positions.astype(np.float64), item.world_from_object)[mesh.triangles]


def _ends(points: Array) -> Array:
    """Lowest and highest coordinates (2, 3) of points, with the distance from which rays start."""
    if not len(points):
        return np.array([(np.inf,) * 3, (-np.inf,) * 3])
    step = RAY_STEP * (1.0 + np.abs(points).max())
    return np.array([points.min(axis=0) - step, points.max(axis=0) + step])


def _meet(one: Array, other: Array) -> bool:
    return bool(np.all(one[0] <= other[1]) and np.all(other[0] <= one[1]))


def _planes(triangles: Array) -> list[tuple[Array, float, Array]]:
    """Normal, offset, and the ends of the faces on it, of the planes of the largest faces."""
    normals = np.cross(*_edges(triangles))
    area = np.linalg.norm(normals, axis=1)
    large = np.argsort(-area)[: 2 * MOST_PLANES]
    large = large[area[large] > LARGE_FACE * area.sum()]
    found: list[tuple[Array, float, Array]] = []
    for corners, normal in zip(triangles[large], normals[large] / area[large, None], strict=True):
        if len(found) < MOST_PLANES:
            found.append((normal, float(normal @ corners[0]), _ends(corners)))
    return found


def _lies_on(planes: list[tuple[Array, float, Array]], triangles: Array) -> bool:
    """True if a face of other triangles lies on one of the planes, beside a face of the first ones."""
    for normal, offset, ends in planes:
        step = RAY_STEP * (1.0 + np.abs(ends).max())
        on = (np.abs(triangles @ normal - offset) < step).all(axis=1)
        if any(_meet(ends, _ends(face)) for face in triangles[on]):
            return True
    return False


def _lies_on_itself(triangles: Array) -> bool:
    """True if two of the largest faces of a mesh lie on each other, back to back."""
    planes = _planes(triangles)
    normals = np.cross(*_edges(triangles))
    for normal, offset, ends in planes:
        step = RAY_STEP * (1.0 + np.abs(ends).max())
        on = (np.abs(triangles @ normal - offset) < step).all(axis=1) & (normals @ normal < 0.0)
        least = LARGE_FACE * (ends[1] - ends[0]).max()
        shared = np.minimum(triangles[on].max(axis=1), ends[1]) - np.maximum(triangles[on].min(axis=1), ends[0])
        if np.any((shared > least).sum(axis=1) >= 2):
            return True
    return False


def note_missing(translation: Translation, obj: Any, reads: frozenset[str]) -> None:
    """Name the UV maps and attributes that materials read but the mesh lacks: they read as 0, as in Blender."""
    if "uv" in reads and uv_layer(obj.data, "") is None:
        translation.note(obj.name, "it has no UV map for the images on it; they show their corner pixel")
    undeformed = getattr(obj.original, "data", None)
    count = len(getattr(undeformed, "vertices", ())) if obj.original.type == "MESH" else len(obj.data.vertices)
    if "generated" in reads and count != len(obj.data.vertices) and not obj.data.is_editmode:
        translation.note(obj.name, "its generated coordinates are those of the mesh after its modifiers")
    for name in sorted(reads):
        kind, _, attribute = name.partition(":")
        missing = attribute not in obj.data.attributes and attribute not in obj.vertex_groups
        if kind in OUTPUTS and attribute and missing:
            translation.note(obj.name, f"it has no UV map or attribute {attribute!r}; its materials read 0")

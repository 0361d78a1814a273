# SPDX-License-Identifier: GPL-3.0-or-later
"""Evaluated Blender meshes to triangles: arrays are copied whole, and a vertex is split only if its corners differ."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.scene.geometry import Attribute, Mesh

from . import velocities
from .apart import split_as_for_cycles, splits
from .edges import at_vertices
from .measures import READ, corner_vertices, floats, measure, normals_of
from .splits import split_corners
from .tangents import SPACE, smooth_normals, tangent_space

Array = NDArray[Any]

READS_UV = frozenset(("uv",))
"""Inputs of shading programs that need the UV map of the render."""


def object_mesh(name: str, obj: Any, reads: frozenset[str] = frozenset()) -> Mesh | None:
    """Mesh of an evaluated object, as ``translate_mesh``.

    In Edit Mode Blender keeps the vertices in its editor, and the object's own data are empty: a copy contains them.
    """
    undeformed = getattr(obj.original, "data", None) if obj.original.type == "MESH" else None
    if undeformed is not None and undeformed.is_editmode:
        undeformed = None
    if not obj.data.is_editmode:
        with split_as_for_cycles(obj, reads) as apart:
            return translate_mesh(name, obj.data, reads, undeformed, obj.vertex_groups, apart)
    try:
        return translate_mesh(name, obj.to_mesh(), reads, undeformed)
    finally:
        obj.to_mesh_clear()


def translate_mesh(
    name: str,
    source: Any,
    reads: frozenset[str] = frozenset(),
    undeformed: Any = None,
    groups: Any = None,
    apart: Any = None,
) -> Mesh | None:
    """Mesh of a ``bpy.types.Mesh``, None if it has no faces.

    ``reads``: inputs of its materials' programs; corners are split along the seams of these only. ``undeformed``: the
    mesh before modifiers, whose box defines generated coordinates. ``groups``: vertex groups of the object. ``apart``:
    the mesh split along its sharp edges, from which measures and attributes of edges are read.
    """
    source.calc_loop_triangles()
    count = len(source.loop_triangles)
    if count == 0:
        return None
    positions = floats(source.attributes["position"].data, "vector", len(source.vertices), 3)
    corners = corner_vertices(source)
    triangle_corners = np.empty(count * 3, dtype=np.int32)
    source.loop_triangles.foreach_get("loops", triangle_corners)
    triangle_corners = triangle_corners.reshape(-1, 3)

    uvs = _corner_uvs(source, corners) if reads & READS_UV else None
    extra: dict[str, Array] = {}
    for item in sorted(reads - READS_UV):
        of = source if apart is None or not splits(source, item) else apart
        values = _attribute(of, item, corners if of is source else corner_vertices(apart), undeformed, groups)
        if of is not source and values is not None and len(values) != len(corners):
            values = np.take(values, corner_vertices(apart), axis=0)
        if values is not None:
            extra[item] = values
    normals = normals_of(source)
    if any(name.startswith(SPACE) for name in reads):  # corners of flat triangles differ within a face
        order, shading = triangle_corners.ravel(), smooth_normals(source, normals, corners)
        known, take = partial(_uvs_of_tangents, source, corners, order), partial(_taken, order, corners)
        places, shading = np.take(positions, corners[order], axis=0), None if shading is None else take(shading)
        uvs, normals = (None if values is None else take(values) for values in (uvs, normals))
        extra = {n: take(values) for n, values in extra.items()}
        corners, triangle_corners = corners[order], np.arange(len(order)).reshape(-1, 3)
        extra.update(tangent_space(places, shading, reads, known))
    keys = [array for array in (uvs, normals, *extra.values()) if array is not None and len(array) == len(corners)]
    vertex_of_corner, corner_of_vertex = corners, None
    if keys:
        vertex_of_corner, corner_of_vertex = split_corners(corners, np.concatenate(keys, axis=1), len(positions))
        # np.take moves whole rows several times faster than indexing does
        vertex = np.take(corners, corner_of_vertex)
        positions = np.take(positions, vertex, axis=0)
        uvs = None if uvs is None else np.take(uvs, corner_of_vertex, axis=0)
        if normals is not None:
            normals = np.take(normals, corner_of_vertex if len(normals) == len(corners) else vertex, axis=0)
        extra = {
            n: np.take(a, corner_of_vertex if len(a) == len(corners) else vertex, axis=0) for n, a in extra.items()
        }
    elif corner_of_vertex is None:
        extra = {n: a for n, a in extra.items() if len(a) == len(positions)}
    return Mesh(
        name,
        positions,
        np.take(vertex_of_corner, triangle_corners).astype(np.uint32),
        normals=normals,
        uvs=uvs,
        material_indices=_material_indices(source, count),
        attributes=tuple(Attribute(item, values) for item, values in extra.items()),
        has_uv_map=uv_layer(source, "") is not None,
    )


def _corner_uvs(source: Any, corners: Array, uv_map: str = "") -> Array:
    """UV of each corner, (c, 2); zero if the mesh has no such map, as in Blender, or no finite value."""
    layer = uv_layer(source, uv_map)
    if layer is None:
        return np.zeros((len(corners), 2), dtype=np.float32)
    uvs = floats(layer.uv, "vector", len(corners), 2)
    return np.where(np.isfinite(uvs), uvs, np.float32(0))


def _uvs_of_tangents(source: Any, corners: Array, order: Array, uv_map: str) -> Array | None:
    """UV (n, 2) of chosen corners, None if the mesh has no map of the name."""
    return None if uv_layer(source, uv_map) is None else _corner_uvs(source, corners, uv_map)[order]


def _taken(order: Array, corners: Array, values: Array) -> Array:
    """Values of corners in another ``order``; values of vertices as they are, told apart from those of corners."""
    return np.take(values, order, axis=0) if len(values) == len(corners) else _told_apart(values, corners[order])


def _attribute(source: Any, name: str, corners: Array, undeformed: Any, groups: Any) -> Array | None:
    """Values (n, 3) of the program input ``name``, per vertex or per corner; None if there is none."""
    positions = floats(source.attributes["position"].data, "vector", len(source.vertices), 3)
    if name == "generated":
        return _told_apart(_generated(source, positions, undeformed), corners)
    if name.startswith(READ):
        edges = np.empty(2 * len(source.edges), dtype=np.int32)
        source.edges.foreach_get("vertices", edges)
        normals = floats(source.vertex_normals, "vector", len(positions), 3)
        return _told_apart(measure(name[len(READ) :], positions, normals, edges.reshape(-1, 2)), corners)
    if name == velocities.READ:
        stored = source.attributes.get(velocities.NAME)
        return None if stored is None else _values(source, stored, corners, "attribute")
    kind, _, attribute = name.partition(":")
    if kind not in OUTPUTS:
        return None
    if not attribute:  # a Color Attribute node without a name reads the one for rendering
        active = source.color_attributes
        index = active.render_color_index
        attribute = active[index].name if 0 <= index < len(active) else ""
    elif attribute in OF_CYCLES and kind != OF_UV_MAP:
        return None
    if attribute in source.uv_layers:
        uvs = _corner_uvs(source, corners, attribute)
        return output_of(np.concatenate([uvs, np.zeros((len(uvs), 1), np.float32)], axis=1), 2, kind)
    found = source.attributes.get(attribute)
    if found is not None:
        return _values(source, found, corners, kind)
    return None if groups is None or attribute not in groups else _weights(source, groups[attribute].index, corners)


OF_UV_MAP = "attribute_uv"
"""Prefix of a UV map that the node UV Map reads although its name is in ``OF_CYCLES``, as it does in Cycles."""


OUTPUTS = ("attribute", "attribute_alpha", "attribute_alpha_color", "attribute_factor", OF_UV_MAP)
"""Prefixes of the names by which a program reads an attribute: its color or vector, its alpha, that of the node Color
Attribute, its one number. On a mesh without the attribute they are 0, but ``attribute_alpha`` is 1, as in Cycles.
"""


OF_CYCLES = frozenset(
    ("N", "tangent", "tangent_sign", "vertex_color", "undeformed", "undisplaced", "motion_P", "motion_N", "particle",
     "curve_intercept", "curve_length", "curve_random", "point_random", "ptex_face_id", "ptex_uv",
     "shadow_transparency", "density", "color", "flame", "heat", "temperature", "velocity")
)  # fmt: skip
"""Names that Cycles keeps for data of its own, such as the grids of a volume: no other attribute is found by them, and
no UV map by the nodes Attribute and Color Attribute.
Those of which every mesh has data are in ``nodes.coordinates.ALWAYS_THERE``.
"""


def output_of(values: Array, width: int, kind: str) -> Array:
    """Values (n, 3) of an output for an attribute (n, 4 or less) of ``width`` numbers, as Cycles gives them."""
    if kind.startswith("attribute_alpha"):
        column = values[:, 3] if width == 4 else np.ones(len(values), np.float32)
    elif kind == "attribute_factor":
        column = values[:, 0] if width < 3 else values[:, :3].mean(axis=1)
    else:
        return np.repeat(values, 3, axis=1) if width == 1 else values[:, :3]
    return np.repeat(column[:, None], 3, axis=1)


def _weights(source: Any, group: int, corners: Array) -> Array:
    """Weight (n, 3) of each vertex in a vertex group."""
    found = [next((each.weight for each in vertex.groups if each.group == group), 0.0) for vertex in source.vertices]
    return _told_apart(np.repeat(np.array(found, np.float32)[:, None], 3, axis=1), corners)


COMPONENTS = {
    "FLOAT": ("value", 1), "INT": ("value", 1), "BOOLEAN": ("value", 1), "INT8": ("value", 1), "FLOAT2": ("vector", 2),
    "FLOAT_VECTOR": ("vector", 3), "FLOAT_COLOR": ("color", 4), "BYTE_COLOR": ("color", 4),
    "QUATERNION": ("value", 4),
}  # fmt: skip


def values_of(attribute: Any, kind: str) -> Array | None:
    """Values (n, 3) of an output for each element of an attribute's domain; None if its type has none."""
    values = stored_in(attribute)
    return None if values is None else _output(attribute, values, kind)


def stored_in(attribute: Any, *, exact: bool = False) -> Array | None:
    """The numbers (n, k) of an attribute; None if its type has none. ``exact``: also those that are not finite, which
    are 0 and the largest numbers else.
    """
    if attribute.data_type not in COMPONENTS:
        return None
    field, width = COMPONENTS[attribute.data_type]
    raw = np.empty(len(attribute.data) * width, dtype=np.float32)
    if attribute.data_type in ("INT", "INT8", "BOOLEAN"):
        whole = np.empty(len(attribute.data), dtype=bool if attribute.data_type == "BOOLEAN" else np.int32)
        attribute.data.foreach_get(field, whole)
        raw[:] = whole
    else:
        attribute.data.foreach_get(field, raw)
    return raw.reshape(-1, width) if exact else np.nan_to_num(raw.reshape(-1, width))


def _output(attribute: Any, values: Array, kind: str) -> Array:
    width = COMPONENTS[attribute.data_type][1]
    if width == 2:
        values = np.concatenate([values, np.zeros((len(values), 1), np.float32)], axis=1)
    return output_of(values, width, kind)


def _values(source: Any, attribute: Any, corners: Array, kind: str) -> Array | None:
    """Values (n, 3) of an output for a mesh attribute, per vertex or per corner."""
    stored = stored_in(attribute)
    if stored is None:
        return None
    if attribute.domain == "EDGE":
        stored = at_vertices(source, stored, attribute.data_type)
    values = _output(attribute, stored, kind)
    if attribute.domain == "FACE":
        face = np.empty(len(source.polygons), dtype=np.int32)
        source.polygons.foreach_get("loop_total", face)
        values = np.repeat(values, face, axis=0)
    elif attribute.domain in ("POINT", "EDGE"):
        values = _told_apart(values, corners)
    elif attribute.domain != "CORNER":
        return None
    return np.ascontiguousarray(values, dtype=np.float32)


def _told_apart(values: Array, corners: Array) -> Array:
    """Values per vertex; per corner if there are as many vertices as corners, which could be confused with corners."""
    return np.take(values, corners, axis=0) if len(values) == len(corners) else values


def _generated(source: Any, positions: Array, undeformed: Any) -> Array:
    """Position (v, 3) of each vertex in the texture space, before modifiers.

    Blender keeps these positions through modifiers for renders; in a view only modifiers that keep the vertices do.
    """
    base, before = source, floats(source.vertices, "undeformed_co", len(positions), 3)
    if not np.array_equal(before, positions):
        positions = before
    elif undeformed is not None and len(undeformed.vertices) == len(positions):
        base = undeformed
        positions = floats(undeformed.attributes["position"].data, "vector", len(positions), 3)
    center, half = (
        np.array(base_value[:], dtype=np.float64) for base_value in (base.texspace_location, base.texspace_size)
    )
    half = np.where(half == 0, 1.0, half)
    return np.nan_to_num((positions - center) / (2 * half) + 0.5).astype(np.float32)


def uv_layer(source: Any, uv_map: str) -> Any:
    """UV layer of that name, for "" the one marked for rendering; None if the mesh has none.

    Before Blender 5.2 a mesh whose UV maps are all from geometry nodes may have none that is marked: the mark is on a
    layer without a name, as of a primitive's UV output, which Cycles does not see and ``uv_layers.active`` returns.
    """
    if uv_map:
        return source.uv_layers.get(uv_map)
    return next((layer for layer in source.uv_layers if layer.active_render), None)


def _material_indices(source: Any, count: int) -> Array | None:
    attribute = source.attributes.get("material_index")  # absent while all faces have the first material
    if attribute is None or attribute.domain != "FACE":
        return None
    of_face = np.empty(len(source.polygons), dtype=np.int32)
    attribute.data.foreach_get("value", of_face)
    face = np.empty(count, dtype=np.int32)
    source.loop_triangle_polygons.foreach_get("value", face)
    return of_face[face].clip(0, 65535).astype(np.uint16)

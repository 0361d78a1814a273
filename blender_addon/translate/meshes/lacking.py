# SPDX-License-Identifier: GPL-3.0-or-later
"""Notes on UV maps and attributes that materials read and a mesh lacks, or that Cycles reads in another way."""

from __future__ import annotations

from typing import Any

from spectral_core.scene.shading import UV_TANGENT

from ... import compat
from ..context import Translation
from .triangles import COMPONENTS, OF_CYCLES, OF_UV_MAP, OUTPUTS, uv_layer


def note_missing(translation: Translation, obj: Any, reads: frozenset[str]) -> None:
    """Name the UV maps and attributes that materials read but the mesh lacks: they read as 0, as in Blender."""
    if "uv" in reads and uv_layer(obj.data, "") is None:
        words = "it has no UV map for the images on it; they show their corner pixel"
        if len(obj.data.uv_layers):
            words = "no UV map that its geometry nodes store is for rendering; images show their corner pixel, as in "
            words += "Cycles, unless a UV Map node names one"
        translation.note(obj.name, words)
    undeformed = getattr(obj.original, "data", None)
    count = len(getattr(undeformed, "vertices", ())) if obj.original.type == "MESH" else len(obj.data.vertices)
    in_view = translation.depsgraph.mode == "VIEWPORT"
    if in_view and "generated" in reads and count != len(obj.data.vertices) and not obj.data.is_editmode:
        message = "its generated coordinates are those of the mesh after its modifiers; renders have those before them"
        translation.note(obj.name, message)
    _note_tangents(translation, obj, reads)
    if _reads_map_of_normals(obj.data, reads):
        translation.note(obj.name, "Cycles keeps the name 'N' for normals and reads no UV map of this name: rename it")
    for name in sorted(reads):
        kind, _, attribute = name.partition(":")
        missing = attribute not in obj.data.attributes and attribute not in obj.vertex_groups
        if kind in OUTPUTS and attribute in OF_CYCLES and kind != OF_UV_MAP:
            words = "Cycles keeps the attribute name {!r} for data of its own; its materials read 0: rename it"
            translation.note(obj.name, words.format(attribute))
        elif kind in OUTPUTS and attribute and missing:
            value = 1 if kind == "attribute_alpha" else 0
            translation.note(obj.name, f"it has no UV map or attribute {attribute!r}; its materials read {value}")
        elif kind in OUTPUTS and not attribute and not len(obj.data.color_attributes):
            translation.note(obj.name, "it has no color attribute; its materials read 0")
        elif kind == "attribute" and attribute in _no_colors(obj.data) & _read_as_colors(obj):
            words = (
                "attribute {!r} is no color: Color Attribute shows other data in Cycles; read it by the node Attribute"
            )
            translation.note(obj.name, words.format(attribute))


def _reads_map_of_normals(mesh: Any, reads: frozenset[str]) -> bool:
    """True if materials read a UV map named N."""
    names, active = {f"{OF_UV_MAP}:N", f"{UV_TANGENT}:N"}, uv_layer(mesh, "")
    if active is not None and active.name == "N":
        names |= {"uv", f"{UV_TANGENT}:"}
    return "N" in mesh.uv_layers and not names.isdisjoint(reads)


def _no_colors(mesh: Any) -> set[str]:
    """Names of the attributes of one or two numbers, UV maps among them."""
    widths = {item.name: COMPONENTS.get(item.data_type, ("", 4))[1] for item in mesh.attributes}
    return {name for name, width in widths.items() if width < 3}


def _read_as_colors(obj: Any) -> set[str]:
    """Names that the nodes Color Attribute of an object's materials have."""
    trees = [compat.node_tree(item) for item in obj.data.materials if item is not None]
    trees += [compat.node_tree(slot.material) for slot in obj.material_slots if slot.material is not None]
    names, seen = set(), set()
    while trees:
        tree = trees.pop()
        if tree is None or tree.as_pointer() in seen:
            continue
        seen.add(tree.as_pointer())
        names |= {node.layer_name for node in tree.nodes if node.type == "VERTEX_COLOR"}
        trees += [node.node_tree for node in tree.nodes if node.type == "GROUP"]
    return names


def _note_tangents(translation: Translation, obj: Any, reads: frozenset[str]) -> None:
    """Name the UV maps whose tangents materials read but the mesh lacks."""
    for uv_map in sorted({name.partition(":")[2] for name in reads if name.startswith(f"{UV_TANGENT}:")}):
        if uv_layer(obj.data, uv_map) is not None:
            continue
        if uv_map:
            translation.note(obj.name, f"it has no UV map {uv_map!r} for normal maps and tangents; they have no effect")
        else:
            words = "its normal maps and tangents turn around its origin, and differ from Cycles' at the poles there"
            translation.note(obj.name, f"it has no UV map; {words}")

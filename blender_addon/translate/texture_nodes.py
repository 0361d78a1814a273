# SPDX-License-Identifier: GPL-3.0-or-later
"""Images on surfaces, where they lie, and stand-ins for patterns that are not understood."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .fields import Field
from .images import image_of_node
from .meshes import GENERATED
from .nodes import Input, Output, linked
from .reader import NEUTRAL, Reader, evaluator


@evaluator("TEX_IMAGE")
def _image(reader: Reader, output: Output) -> Field:
    node = output.node
    texture = image_of_node(reader.translation, node, reader.owner, output.socket.name)
    if texture is None:
        return 1.0 if output.socket.name == "Alpha" else np.full(3, NEUTRAL)
    if node.projection != "FLAT":
        reader.note(f"{output.label!r} is projected as {node.projection.lower()}; it was laid flat on the UV map")
    uv_map, uv_from_mesh_uv = coordinates(reader, output.input("Vector"))
    if uv_map not in reader.uv_maps:
        reader.uv_maps.append(uv_map)
    return replace(texture, uv_from_mesh_uv=uv_from_mesh_uv)


def coordinates(reader: Reader, place: Input | None) -> tuple[str, NDArray[np.float64]]:
    """UV map ("" for the one that renders) and the (3, 3) map from its coordinates to the image's."""
    source = linked(place)
    if source is None:
        return "", np.eye(3)
    node = source.node
    if node.type == "MAPPING":
        uv_map, before = coordinates(reader, source.input("Vector"))
        return uv_map, flattened(mapping_matrix(reader, source)) @ before
    if node.type == "UVMAP":
        return node.uv_map, np.eye(3)
    if node.type == "ATTRIBUTE" and source.socket.name == "Vector":
        return node.attribute_name, np.eye(3)  # a name that is no UV map reads as zero, as in Blender
    if node.type == "TEX_COORD" and source.socket.name in ("UV", "Generated"):
        return ("" if source.socket.name == "UV" else GENERATED), np.eye(3)
    what = f"{source.label} ({source.socket.name})"
    reader.note(f"the texture coordinates {what!r} are not understood; the UV map was used")
    return "", np.eye(3)


def mapping_matrix(reader: Reader, mapping: Output) -> NDArray[np.float64]:
    """Affine map (4, 4) that a Mapping node does to a point or direction."""
    location = reader.vector(mapping.input("Location"), 0.0)
    turn = _rotation(reader.vector(mapping.input("Rotation"), 0.0))
    stretch = np.diag(reader.vector(mapping.input("Scale"), 1.0))
    kind = mapping.node.vector_type
    matrix = np.eye(4)
    if kind == "TEXTURE":  # the texture itself is moved, so a point goes the other way
        scale = np.diag(stretch)
        inverse = np.diag(np.divide(1.0, scale, out=np.zeros(3), where=scale != 0)) @ turn.T
        matrix[:3, :3], matrix[:3, 3] = inverse, -inverse @ location
    elif kind == "NORMAL":
        scale = np.diag(stretch)
        matrix[:3, :3] = turn @ np.diag(np.divide(1.0, scale, out=np.zeros(3), where=scale != 0))
    else:
        matrix[:3, :3] = turn @ stretch
        matrix[:3, 3] = location if kind == "POINT" else 0.0
    return matrix


def flattened(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """What an affine map of space (4, 4) does to the plane z = 0, as (3, 3)."""
    plane = matrix[np.ix_([0, 1, 3], [0, 1, 3])].copy()
    plane[2] = (0, 0, 1)
    return plane


def _rotation(angles: NDArray[np.float64]) -> NDArray[np.float64]:
    """Euler XYZ as Blender applies it: about x, then y, then z."""
    (cx, cy, cz), (sx, sy, sz) = np.cos(angles), np.sin(angles)
    about_x = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    about_y = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    about_z = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
    return np.asarray(about_z @ about_y @ about_x)


@evaluator("TEX_CHECKER")
def _checker(reader: Reader, output: Output) -> Field:
    reader.note(f"the pattern {output.label!r} is not drawn; the mean of its two colors was used")
    if output.socket.name != "Color":
        return NEUTRAL
    first, second = reader.fields(output, "Color1", "Color2")
    return reader.mix(0.5, first, second)


PATTERNS = (
    "TEX_NOISE", "TEX_VORONOI", "TEX_WAVE", "TEX_MAGIC", "TEX_GRADIENT", "TEX_BRICK", "TEX_WHITE_NOISE", "TEX_MUSGRAVE",
    "TEX_GABOR", "TEX_SKY", "TEX_IES", "TEX_POINTDENSITY", "SCRIPT",
)  # fmt: skip


@evaluator(*PATTERNS)
def _pattern(reader: Reader, output: Output) -> Field:
    reader.note(f"the pattern {output.label!r} is not drawn; a neutral gray was used")
    return np.full(3, NEUTRAL) if output.socket.type == "RGBA" else NEUTRAL


@evaluator("ATTRIBUTE", "VERTEX_COLOR", "PARTICLE_INFO", "HAIR_INFO", "POINT_INFO", "VOLUME_INFO", "WIREFRAME", "BEVEL")
def _attribute(reader: Reader, output: Output) -> Field:
    name = getattr(output.node, "attribute_name", "") or getattr(output.node, "layer_name", "")
    what = f"{output.label} ({name})" if name else output.label
    reader.note(f"{what!r} is not read; a neutral gray was used")
    fallback: Any = np.full(3, NEUTRAL) if output.socket.type in ("RGBA", "VECTOR") else NEUTRAL
    return fallback

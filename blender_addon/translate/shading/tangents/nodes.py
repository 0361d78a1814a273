# SPDX-License-Identifier: GPL-3.0-or-later
"""Tangents, and the nodes that use them: Tangent, Normal Map."""

from __future__ import annotations

from typing import Any

import numpy as np

from spectral_core.scene import STRAND_PLACE, STRAND_TANGENT
from spectral_core.scene.shading import SMOOTH_NORMAL, UV_SIGN, UV_TANGENT

from ..fields import Value
from ..reader import Reader, evaluator
from ..tree import Output


def is_meshless(reader: Reader) -> bool:
    """True in the nodes of a lamp or a world."""
    return reader.in_world or hasattr(reader, "lamp")


def round_tangent(reader: Reader, axis: str = "Z") -> Value:
    """The tangential direction around an axis of the object (Cycles' radial tangent)."""
    place = reader.point("position" if is_meshless(reader) else "generated")
    around = reader.emit("around_axis", place, settings=(axis,))
    return _on_surface(reader, around)


def tangent_of_geometry(reader: Reader) -> Value:
    """Tangent of the Geometry node: that around the object's Z axis; on hair the direction of the strand."""
    around, length = round_tangent(reader), reader.emit("component", reader.point(STRAND_PLACE), settings=(1,))
    along = reader.emit("transformed", reader.point(STRAND_TANGENT), settings=("VECTOR", "OBJECT", "WORLD"))
    is_strand = reader.emit("math", length, 0.0, 0.0, settings=("GREATER_THAN",))
    return reader.emit("blend", is_strand, around, reader.emit("normalize", along), settings=("MIX",))


def _on_surface(reader: Reader, along: Value) -> Value:
    """A direction of the object's space as Cycles' tangents become those of the world: like normals."""
    along = reader.emit("transformed", along, settings=("NORMAL", "OBJECT", "WORLD"))
    return reader.emit("along_surface", along, reader.point("normal"))


def of_uv_map(reader: Reader, uv_map: str) -> tuple[Value, Value]:
    """Tangent of a UV map in the space of the object, and the sign of its bitangent; "": the map that renders."""
    with reader.shifted(0):  # neither has a slope in Cycles
        sign = reader.emit("component", reader.point(f"{UV_SIGN}:{uv_map}"), settings=(0,))
        return reader.point(f"{UV_TANGENT}:{uv_map}"), sign


@evaluator("TANGENT")
def _tangent(reader: Reader, output: Output) -> Any:
    if output.node.direction_type == "UV_MAP":
        return _on_surface(reader, of_uv_map(reader, output.node.uv_map)[0])
    return round_tangent(reader, output.node.axis)


@evaluator("NORMAL_MAP")
def _normal_map(reader: Reader, output: Output) -> Any:
    node = output.node
    color, strength = reader.read(output, "Color"), reader.read(output, "Strength", 1.0)
    if getattr(node, "convention", "OPENGL") == "DIRECTX":  # from Blender 5.2 on: green points down
        color = reader.emit("vector_math", color, np.array((1.0, -1.0, 1.0)), np.array((0.0, 1.0, 0.0)), 0.0,
                            settings=("MULTIPLY_ADD",))  # fmt: skip
    if node.space == "TANGENT":
        bent = reader.emit("normal_map", color, strength, _of_face(reader), *of_uv_map(reader, node.uv_map))
        bent = reader.emit("transformed", bent, settings=("NORMAL", "OBJECT", "WORLD"))
        return reader.emit("on_side", bent, reader.point("backfacing", 1), reader.smooth_normal())
    direction = reader.emit("vector_math", color, np.full(3, 2.0), np.full(3, -1.0), 0.0, settings=("MULTIPLY_ADD",))
    if node.space.startswith("BLENDER"):  # baked by Blender's old renderer: y and z have the opposite sign
        direction = reader.emit("vector_math", direction, np.array((1.0, -1, -1)), 0.0, 0.0, settings=("MULTIPLY",))
    if node.space.endswith("OBJECT"):
        direction = reader.emit("transformed", direction, settings=("NORMAL", "OBJECT", "WORLD"))
    normal = reader.point("normal")
    direction = reader.emit("on_side", direction, reader.point("backfacing", 1), normal)
    return reader.emit("normal_blend", direction, strength, normal)


def _of_face(reader: Reader) -> Value:
    """The normal of the front in the space of the object: of a smooth face between those of its corners, as it is."""
    true = reader.emit("on_side", reader.point("true_normal"), reader.point("backfacing", 1), np.zeros(3))
    true = reader.emit("transformed", true, settings=("NORMAL", "WORLD", "OBJECT"))
    with reader.shifted(0):
        return reader.emit("or_else", reader.point(SMOOTH_NORMAL), true)

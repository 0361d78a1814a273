# SPDX-License-Identifier: GPL-3.0-or-later
"""Tangents, and the nodes that use them: Tangent, Normal Map."""

from __future__ import annotations

from typing import Any

import numpy as np

from spectral_core.scene import STRAND_PLACE, STRAND_TANGENT

from ...questions import IsWhatRenders
from ..fields import Value
from ..reader import Reader, evaluator
from ..tree import Output

TO_OBJECT = ("VECTOR", "WORLD", "OBJECT")


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


def uv_axes(reader: Any, uv_map: str) -> tuple[Any, Any]:
    """Tangent and bitangent of a UV map, "" for the one that renders."""
    if not uv_map or reader.translation.ask(IsWhatRenders(uv_map, reader.owner)):
        return reader.point("tangent"), reader.point("bitangent")
    places = []
    for shift in range(3):
        with reader.shifted(shift):
            places.append(reader.point(f"attribute:{uv_map}"))
    steps = reader.point("step_x"), reader.point("step_y")
    tangent = reader.emit("uv_tangent", *places, *steps, reader.smooth_normal())
    return tangent, reader.emit("uv_bitangent", *places, *steps, reader.smooth_normal())


def axes_of_object(reader: Reader, normal: Value, uv_map: str) -> tuple[Value, Value, Value]:
    """Normal, tangent and bitangent in the space of the object, where Cycles applies normal maps and displacement."""
    normal = reader.emit("transformed", normal, settings=("NORMAL", "WORLD", "OBJECT"))
    along, across = (reader.emit("transformed", axis, settings=TO_OBJECT) for axis in uv_axes(reader, uv_map))
    tangent = reader.emit("along_surface", along, normal)
    return normal, tangent, reader.emit("across_surface", across, tangent, normal)


@evaluator("TANGENT")
def _tangent(reader: Reader, output: Output) -> Any:
    if output.node.direction_type == "UV_MAP":
        along = reader.emit("transformed", uv_axes(reader, output.node.uv_map)[0], settings=TO_OBJECT)
        return _on_surface(reader, along)
    return round_tangent(reader, output.node.axis)


@evaluator("NORMAL_MAP")
def _normal_map(reader: Reader, output: Output) -> Any:
    node = output.node
    color, strength = reader.read(output, "Color"), reader.read(output, "Strength", 1.0)
    if getattr(node, "convention", "OPENGL") == "DIRECTX":  # from Blender 5.2 on: green points down
        color = reader.emit("vector_math", color, np.array((1.0, -1.0, 1.0)), np.array((0.0, 1.0, 0.0)), 0.0,
                            settings=("MULTIPLY_ADD",))  # fmt: skip
    if node.space == "TANGENT":
        bent = reader.emit("normal_map", color, strength, *axes_of_object(reader, reader.smooth_normal(), node.uv_map))
        return reader.emit("transformed", bent, settings=("NORMAL", "OBJECT", "WORLD"))
    direction = reader.emit("vector_math", color, np.full(3, 2.0), np.full(3, -1.0), 0.0, settings=("MULTIPLY_ADD",))
    if node.space.startswith("BLENDER"):  # baked by Blender's old renderer: y and z have the opposite sign
        direction = reader.emit("vector_math", direction, np.array((1.0, -1, -1)), 0.0, 0.0, settings=("MULTIPLY",))
    if node.space.endswith("OBJECT"):
        direction = reader.emit("transformed", direction, settings=("NORMAL", "OBJECT", "WORLD"))
    return reader.emit("normal_blend", direction, strength, reader.point("normal"))

# SPDX-License-Identifier: GPL-3.0-or-later
"""Nodes that displace a surface, and the normal of a surface whose displacement bends its normals alone."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..shading.fields import Value
from ..shading.nodes.coordinates import normal_of
from ..shading.reader import Reader, evaluator
from ..shading.tangents.nodes import of_uv_map
from ..shading.tree import Input, Output, linked


@evaluator("DISPLACEMENT")
def _displacement(reader: Reader, output: Output) -> Any:
    raised = reader.emit("math", reader.read(output, "Height"), reader.read(output, "Midlevel", 0.5), 0.0,
                         settings=("SUBTRACT",))  # fmt: skip
    raised = reader.emit("math", raised, reader.read(output, "Scale", 1.0), 0.0, settings=("MULTIPLY",))
    normal = normal_of(reader, output.input("Normal"))
    if output.node.space == "WORLD":
        return reader.emit("vector_math", normal, raised, 0.0, 0.0, settings=("MULTIPLY",))
    inside = reader.emit("transformed", normal, settings=("NORMAL", "WORLD", "OBJECT"))
    moved = reader.emit("vector_math", inside, raised, 0.0, 0.0, settings=("MULTIPLY",))
    return reader.emit("transformed", moved, settings=("VECTOR", "OBJECT", "WORLD"))


@evaluator("VECTOR_DISPLACEMENT")
def _vector_displacement(reader: Reader, output: Output) -> Any:
    moved = reader.emit("vector_math", reader.read(output, "Vector"), reader.read(output, "Midlevel"), 0.0, 0.0,
                        settings=("SUBTRACT",))  # fmt: skip
    moved = reader.emit("vector_math", moved, reader.read(output, "Scale", 1.0), 0.0, 0.0, settings=("MULTIPLY",))
    if output.node.space == "WORLD":
        return moved
    if output.node.space == "TANGENT":
        total: Any = np.zeros(3)
        normal = reader.emit("transformed", reader.point("normal"), settings=("NORMAL", "WORLD", "OBJECT"))
        tangent, sign = of_uv_map(reader, "")
        bitangent = reader.emit("bitangent", normal, tangent, sign)
        for number, axis in enumerate((tangent, normal, bitangent)):  # in the order of Cycles
            share = reader.emit("component", moved, settings=(number,))
            part = reader.emit("vector_math", axis, share, 0.0, 0.0, settings=("MULTIPLY",))
            total = reader.emit("vector_math", total, part, 0.0, 0.0, settings=("ADD",))
        moved = total
    return reader.emit("transformed", moved, settings=("VECTOR", "OBJECT", "WORLD"))


def raised_normal(reader: Reader, place: Input, *, moved: bool = False) -> Value | None:
    """The normal of a displaced surface; None if nothing is linked.

    As in Cycles, the surface is displaced by the component along its normal, and where its vertices are ``moved`` too
    the heights are those of the positions before that.
    """
    if linked(place) is None:
        return None
    heights, places = [], []
    for shift in range(3):
        with reader.shifted(shift), reader.before_displacement(moved):
            offset = reader.as_value(reader.field(place))
            places.append(reader.point("position"))
        heights.append(reader.emit("vector_number", offset, reader.point("normal"), settings=("DOT_PRODUCT",)))
    steps = [reader.point(f"step_{axis}") for axis in "xy"]
    if moved:
        steps = [reader.emit("vector_math", end, places[0], 0.0, 0.0, settings=("SUBTRACT",)) for end in places[1:]]
    return reader.emit("bump", reader.point("normal"), 1.0, 1.0, *heights, *steps)

# SPDX-License-Identifier: GPL-3.0-or-later
"""A world's program along rays: it reads their direction alone, all else in a view of the world is a number."""

from __future__ import annotations

from typing import Any

import numpy as np

from spectral_core.scene.shading import Builder, Program

from ..shading.attributes import ALPHA, hashed_pair
from .directions import Array, Look

CHUNK, MOST_VALUES = 1 << 18, 1 << 25
"""Directions that are computed together, and values of all instructions for them."""
DIRECTION, OPPOSITE = ("position", "generated"), ("normal", "true_normal", "incoming")
"""What a world's nodes read of a ray: its direction, and the opposite one."""

WITHOUT_OBJECT = {
    "parametric": (1.0, 0.0, 0.0),
    "object_attribute:PARTICLE:Random": (hashed_pair(0, 0) / 0xFFFFFFFF,) * 3,
}
"""What Cycles gives a world of the data of objects, where it is not 0."""


def along_rays(program: Program, look: Look) -> Program:
    """``program`` for rays of any direction in the view of ``look``."""
    builder, made = Builder(), list[int]()
    for instruction in program.instructions:
        inputs, settings = tuple(made[k] for k in instruction.inputs), instruction.settings
        if instruction.values:
            made.append(builder.number(instruction.values))
        elif instruction.operation.endswith("_input"):
            made.append(_input(builder, str(settings[0]), instruction.width, look))
        elif instruction.operation == "transformed":
            made.append(_transformed(builder, inputs[0], settings, look))
        else:
            made.append(builder.add(instruction.operation, inputs, *settings, data=instruction.data))
    return builder.program(builder.as_width(made[-1], 3))


def color(program: Program, directions: Array) -> Array:
    """Linear sRGB (n, 3) of a program of ``along_rays`` along directions (n, 3)."""
    size = min(CHUNK, max(MOST_VALUES // len(program.instructions), 1 << 12))
    starts = range(0, len(directions), size)
    return np.concatenate([_evaluated(program, directions[start : start + size]) for start in starts])


def _evaluated(program: Program, directions: Array) -> Array:
    along = tuple(directions.T)

    def read(name: str, shift: int) -> Any:
        return along if name in DIRECTION else tuple(-part for part in along)

    found = np.nan_to_num(program.evaluate(read))
    return np.broadcast_to(found.reshape(len(found), -1), (len(directions), 3))


def _input(builder: Builder, name: str, width: int, look: Look) -> int:
    """What a direction has of the data of a hit; 0 for the rest."""
    if name in DIRECTION:
        return builder.add("vector_input", (), DIRECTION[0], 0)
    if name in OPPOSITE:
        return builder.add("vector_input", (), "incoming", 0)
    if name == "window":
        return _window(builder, look)
    if name in WITHOUT_OBJECT:
        return builder.number(WITHOUT_OBJECT[name])
    if name.startswith("attribute_alpha:") or (name.startswith("object_attribute:") and f"{ALPHA}:" in name):
        return builder.number(np.ones(width))
    if not name.startswith("ray:"):
        return builder.number(np.zeros(width))
    return builder.add("number_input", (), name, 0) if look.asks_rays else builder.number(look.sees(name))


def _transformed(builder: Builder, vector: int, settings: tuple[Any, ...], look: Look) -> int:
    """A vector in another space; only the camera's differs from the world's, by its rotation."""
    kind, source, target = settings
    turn = look.camera_from_world[:3, :3]
    if source == "CAMERA":
        vector = _turned(builder, vector, turn.T)
    if target == "CAMERA":
        vector = _turned(builder, vector, turn)
    return builder.add("normalize", (vector,)) if kind == "NORMAL" else vector


def _turned(builder: Builder, vector: int, turn: Array) -> int:
    return builder.add("affine", (vector, *(builder.number(row) for row in turn)))


def _window(builder: Builder, look: Look) -> int:
    """Place in the frame of a direction."""
    width, height, shift_x, shift_y, perspective = look.window
    there = _turned(builder, builder.add("vector_input", (), DIRECTION[0], 0), look.camera_from_world[:3, :3])
    x, y, z = (builder.add("component", (there,), axis) for axis in range(3))
    depth = builder.number(1.0)
    if perspective:  # behind the camera the frame is mirrored, as in Cycles
        far = _math(builder, "MAXIMUM", _math(builder, "ABSOLUTE", z), builder.number(1e-3))
        depth = _math(builder, "MULTIPLY", _math(builder, "SIGN", z), far)
    parts = []
    for part, size, shift in ((x, width, shift_x), (y, height, shift_y)):
        share = _math(builder, "DIVIDE", part, _math(builder, "MULTIPLY", depth, builder.number(size)))
        parts.append(_math(builder, "ADD", share, builder.number(0.5 - shift)))
    return builder.add("joined", (*parts, builder.number(0.0)))


def _math(builder: Builder, name: str, first: int, second: int | None = None) -> int:
    zero = builder.number(0.0)
    return builder.add("math", (first, zero if second is None else second, zero), name)

# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's world to surroundings of the scene."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.scene import Color, ImageTexture, MixedPaint, Paint, World, gray

from .. import compat
from . import spectra, surfaces  # noqa: F401  (surfaces brings the nodes that Reader knows)
from .context import Translation
from .fields import mean_color
from .images import image_of_node
from .nodes import Input, Output, linked, surface_output
from .reader import Reader, evaluator
from .texture_nodes import mapping_matrix


def translate_world(translation: Translation, world: Any) -> World:
    """Surroundings of a ``bpy.types.World``; None is black, as in Blender."""
    if world is None:
        return World()
    group = getattr(world.original, "lightgroup", "")  # Blender does not tell the evaluated copy of a change
    reader = Reader(translation, world.name)
    tree = compat.node_tree(world)
    color: Paint = Color(translation.linear_rgb(world.color))
    strength, turn = 1.0, np.eye(4)
    if tree is not None:
        color, strength, turn = _background(reader, tree)
    spectrum = spectra.spectrum_of(translation, world)
    if spectrum is not None:
        color, strength = spectrum, strength * spectra.strength_of(world)
    return World(color=color, strength=strength, world_from_environment=turn, group=group)


def _background(reader: Reader, tree: Any) -> tuple[Paint, float, NDArray[np.float64]]:
    """Color, strength and turn of the world's Background node."""
    nothing = Color(np.zeros(3)), 0.0, np.eye(4)
    output = surface_output(tree, "OUTPUT_WORLD")
    if output is None:
        return nothing
    if linked(Input(output.inputs["Volume"])) is not None:
        reader.note("a volume in the world is left out")
    source = _first_background(reader, linked(Input(output.inputs["Surface"])))
    if source is None:
        return nothing
    strength = max(reader.number(source.input("Strength"), 1.0), 0.0)
    spectrum = spectra.spectrum_of(reader.translation, source.node)
    if spectrum is not None:
        return spectrum, strength * spectra.strength_of(source.node), np.eye(4)
    place = source.input("Color")
    color = gray(1.0) if place is None else reader.paint(place, gray(1.0))
    if isinstance(color, MixedPaint):
        reader.note("two mixed colors or images surround the scene; their mean was used")
        color = Color(np.broadcast_to(mean_color(reader.field(place)), (3,)))  # type: ignore[arg-type]
    return color, strength, _turn(reader, place) if isinstance(color, ImageTexture) else np.eye(4)


def _first_background(reader: Reader, source: Output | None) -> Output | None:
    """The Background (or Emission) node that counts; of two that are mixed the stronger, of two added the first."""
    if source is None or source.node.type in ("BACKGROUND", "EMISSION"):
        return source
    shaders = [linked(Input(socket, source.groups)) for socket in source.node.inputs if socket.type == "SHADER"]
    if source.node.type == "MIX_SHADER":
        factor = reader.number(source.input("Fac") or source.input("Factor"), 0.5)
        if 0 < factor < 1:
            reader.note(f"of the two surroundings that {source.label!r} mixes, the stronger was used alone")
        return _first_background(reader, shaders[1 if factor > 0.5 else 0])
    reader.note(f"the world's shader {source.label!r} is not understood; the first background in it was used")
    return next((found for shader in shaders if shader and (found := _first_background(reader, shader))), None)


@evaluator("TEX_ENVIRONMENT")
def _environment(reader: Reader, output: Output) -> Any:
    if getattr(output.node, "projection", "EQUIRECTANGULAR") != "EQUIRECTANGULAR":
        reader.note(f"{output.label!r}: a mirror ball is read as if it were equirectangular")
    texture = image_of_node(reader.translation, output.node, reader.owner, output.socket.name)
    return np.full(3, 0.5) if texture is None else replace(texture, extension="repeat")


def _turn(reader: Reader, place: Input | None) -> NDArray[np.float64]:
    """World from environment (4, 4): the inverse of what a Mapping node before the image does to a direction."""
    image = _find(linked(place), "TEX_ENVIRONMENT")
    source = None if image is None else linked(image.input("Vector"))
    if source is None:
        if image is None:
            reader.note("an image that is no environment texture surrounds the scene as if it were one")
        return np.eye(4)
    if source.node.type == "TEX_COORD":
        if source.socket.name not in ("Generated", "Normal", "Object"):
            reader.note(f"the coordinates {source.socket.name!r} of the surroundings are not understood")
        return np.eye(4)
    if source.node.type != "MAPPING":
        reader.note(f"{source.label!r} before the environment image is not understood")
        return np.eye(4)
    linear = mapping_matrix(reader, source)[:3, :3]
    rotation, stretch = _polar(linear)
    if not np.allclose(stretch, stretch[0, 0] * np.eye(3), atol=1e-6):
        reader.note("stretched surroundings are shown turned, but not stretched")
    turn = np.eye(4)
    turn[:3, :3] = rotation.T
    return turn


def _polar(matrix: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Nearest orthogonal matrix, and what is left: matrix = rotation @ stretch."""
    left, lengths, right = np.linalg.svd(matrix)
    return left @ right, right.T @ np.diag(lengths) @ right


def _find(source: Output | None, kind: str, depth: int = 0) -> Output | None:
    """The first node of a type that feeds an output."""
    if source is None or depth > 50 or source.node.type == kind:
        return source if depth <= 50 else None
    below = (linked(Input(socket, source.groups)) for socket in source.node.inputs)
    return next((found for output in below if output and (found := _find(output, kind, depth + 1))), None)

# SPDX-License-Identifier: GPL-3.0-or-later
"""A world's node tree as radiance by direction, and the views of a world that it is computed for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..shading.fields import Value, value_of
from ..shading.reader import Reader
from ..shading.tree import Input, Output, linked
from ..shading.walks.shaders import folded, is_sum, shader_inputs
from .light_inputs import color_of_own_spectrum

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Look:
    """A view of the world: the space of the camera, and the type of its rays: the camera's, or those that light the
    scene.
    """

    camera_from_world: Array
    camera: bool = False
    window: tuple[float, ...] = (1.0, 1.0, 0.0, 0.0, 1.0)
    """Frame of the camera, as ``Camera.window`` gives it."""
    asks_rays: bool = False
    """True if the type of a ray is read when the ray meets the world."""

    def sees(self, name: str) -> float:
        """Outputs of the Light Path node for this look's rays."""
        return of_light_path(name.removeprefix("ray:"), camera=self.camera)


def of_light_path(name: str, *, camera: bool) -> float:
    """An output of the Light Path node in a world; rays that light the scene count as diffuse."""
    of_light = ("Is Diffuse Ray", "Is Reflection Ray", "Ray Depth", "Diffuse Depth")
    return float(name in (("Is Camera Ray", "Ray Depth") if camera else of_light))


def shining(reader: Reader, place: Input) -> Value:
    """Linear sRGB of a world's shader, as a result of the reader's program."""
    black = reader.literal(np.zeros(3))

    def made(source: Output, parts: list[Value]) -> Value:
        kind = source.node.type
        if kind in ("BACKGROUND", "EMISSION"):
            own = color_of_own_spectrum(reader, source)
            color = _value(reader, source.input("Color"), 1.0) if own is None else reader.literal(own)
            strength = _value(reader, source.input("Strength"), 1.0).as_number()
            return reader.emit("vector_math", color, strength, 0.0, 0.0, settings=("MULTIPLY",))
        if kind == "MIX_SHADER":
            share = reader.share(source.input("Fac") or source.input("Factor"), 0.5)
            return reader.emit("mix_vector", share, *parts)
        if kind == "ADD_SHADER":
            return reader.emit("vector_math", *parts, 0.0, 0.0, settings=("ADD",))
        note_unsupported(reader, source)
        return parts[0] if parts else black

    return folded(linked(place), made, black, shaders_of_world)


def shaders_of_world(source: Output) -> list[Input]:
    """The shaders that a node of a world shows: those of a mix or sum, the first one that is linked of another node."""
    places = shader_inputs(source)
    return places if is_sum(source) else [place for place in places if linked(place) is not None][:1]


def note_unsupported(reader: Reader, source: Output) -> None:
    """Note a shader that is no background, mix or sum."""
    reader.note(f"the world's shader {source.label!r} is not supported; the first background in it was used")


def _value(reader: Reader, place: Input | None, other: float) -> Value:
    """A socket's value; ``other`` if this Blender's node has no such input."""
    return reader.literal(other) if place is None else value_of(reader.field(place), reader.builder)

# SPDX-License-Identifier: GPL-3.0-or-later
"""A world's node tree evaluated along directions: patterns, skies and mixes become an environment image."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.scene import ImageTexture
from spectral_core.scene.shading import Program

from ..shading.fields import Field, value_of
from ..shading.reader import Reader
from ..shading.tree import Input, linked
from .light_inputs import color_of_own_spectrum

Array = NDArray[np.float64]
CHUNK = 1 << 18
"""Directions that are computed together."""


@dataclass(frozen=True, eq=False)
class Look:
    """Directions (n, 3) of a view of the world, and the type of its rays: the camera's, or those that light the scene.

    ``swaps``: replacements of images, by their ``id``: a sky with its sun's disk in place of one without.
    """

    directions: Array
    camera_from_world: Array
    camera: bool = False
    swaps: dict[int, ImageTexture] | None = None
    window: tuple[float, ...] = (1.0, 1.0, 0.0, 0.0, 1.0)
    """Frame of the camera, as ``Camera.window`` gives it."""
    heard: list[Any] | None = None
    """Takes note of the shaders, programs and spectra that are evaluated: equal ones give equal radiances."""

    def value(self, field: Field, width: int) -> Array:
        """A field along every direction, (n, width)."""
        value = value_of(field)
        program = value.program(width)
        if self.heard is not None:
            self.heard.append(program)
        if self.swaps:
            program = Program(tuple(replace(i, data=self.swaps.get(id(i.data), i.data)) for i in program.instructions))
        parts = [
            self._evaluated(program, self.directions[start : start + CHUNK], width)
            for start in range(0, len(self.directions), CHUNK)
        ]
        return np.concatenate(parts)

    def _evaluated(self, program: Program, directions: Array, width: int) -> Array:
        along = tuple(directions.T)
        back = tuple(-part for part in along)
        zero = np.zeros(len(directions))

        def read(name: str, shift: int) -> Any:
            if name.startswith("ray:"):
                return zero + self.sees(name)
            if name in ("normal", "true_normal", "incoming"):
                return back
            if name in ("position", "generated"):
                return along
            if name == "window":
                return self._window(transform(along, "VECTOR", "CAMERA", False))
            return zero if name in NUMBERS else (zero, zero, zero)

        def transform(vector: Any, kind: str, space: str, inverse: bool) -> Any:
            if space != "CAMERA":
                return vector
            turn = self.camera_from_world[:3, :3]
            turn = turn.T if inverse else turn
            return tuple(sum(turn[i, j] * vector[j] for j in range(3)) for i in range(3))

        found = np.nan_to_num(program.evaluate(read, transform=transform))
        return np.broadcast_to(found.reshape(len(found), -1), (len(directions), width))

    def _window(self, there: tuple[Array, ...]) -> tuple[Array, ...]:
        """Place in the frame of directions in the camera's space."""
        x, y, z = there
        width, height, shift_x, shift_y, perspective = self.window
        # behind the camera the frame is mirrored, as in Cycles
        depth = np.where(z < 0, -1.0, 1.0) * np.maximum(np.abs(z), 1e-3) if perspective else np.ones_like(z)
        return x / (depth * width) + 0.5 - shift_x, y / (depth * height) + 0.5 - shift_y, np.zeros_like(x)

    def sees(self, name: str) -> float:
        """Outputs of the Light Path node for this look's rays."""
        return of_light_path(name.removeprefix("ray:"), camera=self.camera)


def of_light_path(name: str, *, camera: bool) -> float:
    """An output of the Light Path node in a world; rays that light the scene count as diffuse."""
    of_light = ("Is Diffuse Ray", "Is Reflection Ray", "Ray Depth", "Diffuse Depth")
    return float(name in (("Is Camera Ray",) if camera else of_light))


NUMBERS = ("backfacing", "random", "object_alpha", "object_index", "object_random")


def radiance(reader: Reader, place: Input, look: Look) -> Array:
    """Linear sRGB (n, 3) of a world's shader along directions."""
    source = linked(place)
    if source is None:
        return np.zeros((len(look.directions), 3))
    kind = source.node.type
    if look.heard is not None:
        look.heard.append(kind)
    field: Callable[[Any, float], Field] = lambda of, other: reader.literal(other) if of is None else reader.field(of)  # noqa: E731
    if kind in ("BACKGROUND", "EMISSION"):
        own = color_of_own_spectrum(reader, source)
        if look.heard is not None:
            look.heard.append(own)
        color = look.value(field(source.input("Color"), 1.0), 3) if own is None else own
        return np.asarray(color * look.value(field(source.input("Strength"), 1.0), 1))
    places = [Input(socket, source.groups) for socket in source.node.inputs if socket.type == "SHADER"]
    if kind == "MIX_SHADER":
        share = np.clip(look.value(field(source.input("Fac") or source.input("Factor"), 0.5), 1), 0.0, 1.0)
        first, second = (radiance(reader, item, look) for item in places)
        return np.asarray((1 - share) * first + share * second)
    if kind == "ADD_SHADER":
        return np.asarray(sum(radiance(reader, item, look) for item in places))
    reader.note(f"the world's shader {source.label!r} is not supported; the first background in it was used")
    places = [item for item in places if linked(item) is not None][:1]
    return radiance(reader, places[0], look) if places else np.zeros((len(look.directions), 3))

# SPDX-License-Identifier: GPL-3.0-or-later
"""The node tree of a lamp: coordinates of a point of the lamp, as Cycles sets them up for its emission."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..shading.fields import Value
from ..shading.reader import Reader

Array = NDArray[np.float64]

SHARP_SUN = 2e-5
"""Angle (radian) of a sun below which its light has one direction."""


@dataclass
class LampReader(Reader):
    """Reads the tree of a lamp. ``lamp``: Blender's; ``matrix``: world from object, with its scale; ``info``: what the
    Object Info node gives, by name.
    """

    lamp: Any = None
    matrix: Array = field(default_factory=lambda: np.eye(4))
    info: Mapping[str, tuple[float, ...]] = field(default_factory=dict)

    def point(self, name: str, width: int = 3) -> Value:
        """A quantity of the point of the lamp that emits."""
        if name in ("uv", "parametric"):
            return self._parametric()
        if name == "generated":
            return self.emit("transformed", self.point("position"), settings=("POINT", "WORLD", "OBJECT"))
        if name.startswith("ray:Is ") or name == "backfacing":
            return self.literal(0.0)  # Cycles does not tell the rays to a lamp apart
        if name.startswith("ray:") and name.endswith(" Depth"):
            self.note(
                f"{name.removeprefix('ray:')!r} is 0 in a lamp's nodes; Cycles counts the bounces up to the surface"
            )
            return self.literal(0.0)
        if name.startswith("object_"):
            if name in self.info:
                value = self.info[name]
                return self.literal(np.array(value) if len(value) > 1 else value[0])
            self.note(f"{name.rpartition(':')[2]!r} is not read in a lamp's nodes; 0 was used")
        if name.startswith(("object_", "attribute", "step_")):
            return self.literal(np.zeros(3) if width == 3 else 0.0)
        if self.is_far and self.lamp.angle < SHARP_SUN and name in ("position", "normal", "true_normal", "incoming"):
            return self.literal(self._travels())
        return super().point(name, width)

    def _travels(self) -> Array:
        """Direction in which a sun's light travels."""
        down = -self.matrix[:3, 2]
        return np.asarray(down / max(float(np.linalg.norm(down)), 1e-30))

    def emit(self, operation: str, *inputs: Any, settings: tuple[Any, ...] = (), data: Any = None) -> Value:
        """Result of an operation; the lamp's own space is that of its matrix."""
        if operation != "transformed" or "OBJECT" not in settings[1:]:
            return super().emit(operation, *inputs, settings=settings, data=data)
        kind, source, target = settings
        value = self.as_value(inputs[0])
        if source == "OBJECT":
            value = self._moved(value, kind, self.matrix)
        elif source != "WORLD":
            value = super().emit("transformed", value, settings=(kind, source, "WORLD"))
        if target == "OBJECT":
            return self._moved(value, kind, np.linalg.pinv(self.matrix))
        return value if target == "WORLD" else super().emit("transformed", value, settings=(kind, "WORLD", target))

    def _moved(self, value: Value, kind: str, matrix: Array) -> Value:
        turning = np.linalg.pinv(matrix[:3, :3]).T if kind == "NORMAL" else matrix[:3, :3]
        turned = super().emit("affine", value, *turning)
        if kind == "NORMAL":
            return super().emit("normalize", turned)
        return turned if kind == "VECTOR" else self._plus(turned, matrix[:3, 3])

    def _plus(self, value: Any, shift: Any) -> Value:
        return super().emit("vector_math", value, shift, 0.0, 0.0, settings=("ADD",))

    def _parametric(self) -> Value:
        """Coordinates of a lamp (Cycles: light/point.h, spot.h, area.h and distant.h), which are its UV map, too."""
        lamp, inverse = self.lamp, np.linalg.pinv(self.matrix[:3, :3])
        flat, middle = np.array((1.0, 1.0, 0.0)), np.array((0.5, 0.5, 0.0))
        if lamp.type == "AREA":
            axes = self.matrix[:3, :2].T
            sizes = lamp.size, lamp.size_y if lamp.shape in ("RECTANGLE", "ELLIPSE") else lamp.size
            rows = [
                axis / max(float(axis @ axis), 1e-30) / max(float(size), 1e-30)
                for axis, size in zip(axes, sizes, strict=True)
            ]
            shift = middle - np.append(np.array(rows) @ self.matrix[:3, 3], 0.0)
            return self._plus(super().emit("affine", self.point("position"), *rows, np.zeros(3)), shift)
        if lamp.type == "SPOT":
            local = super().emit("affine", self.point("incoming"), *inverse)
            down = super().emit("math", self._component(local, 2), -1.0, 0.0, settings=("MULTIPLY",))
            share = 0.5 / float(np.tan(lamp.spot_size / 2))
            factor = super().emit("math", share, down, 0.0, settings=("DIVIDE",))
        elif lamp.type == "SUN":
            half = float(np.sin(0.5 * lamp.angle / 2))
            incoming = self.point("incoming")
            both = self._plus(incoming, self._travels())
            off = super().emit("vector_number", both, both, settings=("LENGTH",))
            factor = super().emit("math", -0.5 / half if half else 0.0, off, 0.0, settings=("DIVIDE",))
            local = super().emit("affine", incoming, *inverse)
        else:
            normal = super().emit("affine", self.point("normal"), *inverse)
            centered = super().emit("vector_math", normal, np.full(3, 0.5), np.full(3, 0.5), 0.0,
                                    settings=("MULTIPLY_ADD",))  # fmt: skip
            return super().emit("round_coordinates", centered, settings=("SPHERE",))
        placed = super().emit("vector_math", local, factor, 0.0, 0.0, settings=("MULTIPLY",))
        return super().emit("vector_math", placed, flat, middle, 0.0, settings=("MULTIPLY_ADD",))

    def _component(self, value: Value, index: int) -> Value:
        return super().emit("component", value, settings=(index,))

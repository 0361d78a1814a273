# SPDX-License-Identifier: GPL-3.0-or-later
"""What the inputs of a closure hold, and a closure as a description: its name, its inputs, its fixed choices."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

Kind = Literal["number", "color", "vector", "table"]
"""What a closure reads from an input: ``eval_1``, ``eval``, ``eval_3``, or a table of albedos."""


@dataclass(frozen=True, eq=False)
class Number:
    """A plain number."""

    value: float
    kind: Kind = "number"


@dataclass(frozen=True, eq=False)
class Tint:
    """A reflectance of linear sRGB (3,), in [0, 1]."""

    rgb: NDArray[np.float64]
    kind: Kind = "color"


@dataclass(frozen=True, eq=False)
class Albedos:
    """A table of ``closures.albedo`` over roughness and cosine."""

    values: NDArray[np.float64]
    kind: Kind = "table"


@dataclass(frozen=True, eq=False)
class Programmed:
    """What a shading program computes."""

    program: Any
    kind: Kind


@dataclass(frozen=True, eq=False)
class Textured:
    """What a texture of Mitsuba, or of ours, shows."""

    texture: Any
    kind: Kind


Source = Number | Tint | Albedos | Programmed | Textured


@dataclass(frozen=True, eq=False)
class Lobe:
    """A closure by the ``name`` of its class. ``parts``: sources, closures within it, and fixed choices."""

    name: str
    parts: dict[str, Any]

    @property
    def sources(self) -> list[Source]:
        """Every input once, in order."""
        found: dict[int, Source] = {}
        for value in self._values():
            found.setdefault(id(value), value)
        return list(found.values())

    def _values(self) -> Iterator[Source]:
        for part in self.parts.values():
            if isinstance(part, Lobe):
                yield from part._values()
            elif isinstance(part, Source):
                yield part

    def build(self, places: dict[int, int] | None = None) -> tuple[Any, ...]:
        """Equal for closures that the same code computes: they differ in what their inputs hold."""
        if places is None:
            places = {id(source): number for number, source in enumerate(self.sources)}
        parts: list[Any] = []
        for name, part in self.parts.items():
            if isinstance(part, Lobe):
                parts.append((name, part.build(places)))
            elif isinstance(part, Source):
                parts.append((name, part.kind, places[id(part)]))
            else:
                parts.append((name, part))
        return (self.name, *parts)

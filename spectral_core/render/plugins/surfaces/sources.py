# SPDX-License-Identifier: GPL-3.0-or-later
"""Inputs of a closure, and the description of a closure: its name, its inputs, its fixed choices."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from spectral_core.spectra.spectrum import Spectrum

Kind = Literal["number", "color", "bright", "vector", "table"]
"""Type of an input: ``eval_1``, ``eval`` of a reflectance in [0, 1] or of any color, ``eval_3``, or a table of albedos.
"""


@dataclass(frozen=True, eq=False)
class Number:
    """A plain number."""

    value: float
    kind: Kind = "number"


@dataclass(frozen=True, eq=False)
class Tint:
    """A reflectance of linear sRGB (3,), in [0, 1] unless its type is ``bright``."""

    rgb: NDArray[np.float64]
    kind: Kind = "color"


@dataclass(frozen=True, eq=False)
class Albedos:
    """A table of ``closures.albedo`` over roughness and cosine."""

    values: NDArray[np.float64]
    kind: Kind = "table"


@dataclass(frozen=True, eq=False)
class Programmed:
    """Value of a shading program."""

    program: Any
    kind: Kind


@dataclass(frozen=True, eq=False)
class Sampled:
    """A spectrum with its knots at whole nm, in spectral transport."""

    spectrum: Spectrum
    kind: Kind


@dataclass(frozen=True, eq=False)
class Textured:
    """Value of a texture of Mitsuba or of a plugin."""

    texture: Any
    kind: Kind


Source = Number | Tint | Albedos | Programmed | Sampled | Textured


@dataclass(frozen=True, eq=False)
class Lobe:
    """A closure by the ``name`` of its class. ``parts``: sources, nested closures and fixed choices."""

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
        """Key that is equal for closures with the same code, which differ only in the contents of their inputs."""
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

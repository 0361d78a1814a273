# SPDX-License-Identifier: GPL-3.0-or-later
"""What shines in a scene, as the loader meets it: plain rows of numbers, before they become tables.

A *source* is what an artist calls a light: a lamp, a glowing object, the world. An *item* is what is drawn: a lamp, one
triangle of a glowing mesh, the world.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.scene import Photometry
from spectral_core.spectra.observer import xyz_of
from spectral_core.spectra.spectrum import Spectrum

Array = NDArray[np.float64]

BALL, PANEL, TRIANGLE, SUN, WORLD = range(5)
"""Kinds of items, in their order: points, balls and spots; flat lamps; triangles of glowing meshes; suns; the world."""


@dataclass(frozen=True, slots=True, eq=False)
class Source:
    """A light: what it emits (linear RGB (3,) or a spectrum), the group that switches it, and a Mitsuba emitter.

    ``emitted`` is None where only ``emitter`` knows, because it varies over its surface or its directions.
    """

    emitted: Array | Spectrum | None
    group: str
    emitter: Any | None = None
    camera_visible: bool = False

    @property
    def brightness(self) -> float:
        """What a picture gets of what is emitted, all channels alike; 1 where only the emitter knows."""
        if self.emitted is None:
            return 1.0
        seen = xyz_of(self.emitted) if isinstance(self.emitted, Spectrum) else np.maximum(self.emitted, 0.0)
        return max(float(np.mean(seen)), 0.0)


@dataclass(frozen=True, slots=True, eq=False)
class Beam:
    """What shapes a ball's light by direction. ``axes``: (3, 3) own, scaled axes from world, the third along the beam.

    ``cosine``, ``softness``: of a spot's edge, -2 for none. ``photometry``: a measured luminaire.
    """

    axes: Array = field(default_factory=lambda: np.eye(3))
    cosine: float = -2.0
    softness: float = 1e-6
    photometry_axes: Array = field(default_factory=lambda: np.eye(3))
    photometry: Photometry | None = None

    @property
    def is_even(self) -> bool:
        """Whether the light is the same in every direction."""
        return self.cosine < -1 and self.photometry is None


@dataclass(frozen=True, slots=True, eq=False)
class Ball:
    """A point (radius 0) or a ball; the source's ``emitted`` is its radiant intensity."""

    source: int
    center: Array
    radius: float
    softening: float
    beam: Beam
    falloff: tuple[int, float]


@dataclass(frozen=True, slots=True, eq=False)
class Panel:
    """A flat lamp: ``half_axes`` (3, 2) from its center; it shines to the side of ``normal``; emits radiance.

    ``spread``: tangent of the half angle that its light ends at and the gain that keeps its power, (0, 1) for none.
    """

    source: int
    center: Array
    half_axes: Array
    normal: Array
    ellipse: bool
    spread: tuple[float, float]
    falloff: tuple[int, float]

    @property
    def area(self) -> float:
        """Area of the lamp."""
        full = 4.0 * float(np.linalg.norm(np.cross(self.half_axes[:, 0], self.half_axes[:, 1])))
        return full * np.pi / 4 if self.ellipse else full


@dataclass(frozen=True, slots=True, eq=False)
class Sun:
    """A disk at infinity in ``direction`` (towards it); emits radiance, or irradiance where it has no size."""

    source: int
    direction: Array
    half_angle: float


@dataclass(frozen=True, slots=True, eq=False)
class Glow:
    """A glowing mesh: world-space corners (t, 3, 3), UVs (t, 3, 2) or None, and the Mitsuba shape that shows it.

    ``brightness``: (t,) of each triangle, relative to the source's.
    """

    source: int
    corners: NDArray[np.float64]
    uvs: NDArray[np.float32] | None
    shape: Any
    brightness: Array


@dataclass
class LightList:
    """All that shines. ``gains``: one factor per source, which light groups switch to 0."""

    sources: list[Source] = field(default_factory=list)
    balls: list[Ball] = field(default_factory=list)
    panels: list[Panel] = field(default_factory=list)
    suns: list[Sun] = field(default_factory=list)
    glows: list[Glow] = field(default_factory=list)
    world: tuple[int, float] | None = None
    """The surroundings: their source, and the irradiance that they give where nothing hides them."""
    world_is_constant: bool = False
    """Whether the surroundings are equally bright in every direction."""
    even: bool = False
    """Whether every source is asked as if it were as bright as any other, near and far alike: a recording is mixed
    later, and must neither depend on how bright its lights are nor starve one."""
    gains: Array = field(default_factory=lambda: np.ones(0))
    changes: int = 0
    """How often a source was switched: tables are read anew then. A call back would keep the scene in memory."""

    def strengths(self) -> list[float]:
        """Brightness of each source as choices know it."""
        return [1.0 if self.even and source.brightness > 0 else source.brightness for source in self.sources]

    def add_source(self, source: Source) -> int:
        """Enter a source; gives its index. Rules know it by this number plus 1."""
        self.sources.append(source)
        self.gains = np.append(self.gains, 1.0)
        return len(self.sources) - 1

    def switch(self, source: int, on: bool) -> None:
        """Turn a source on or off; what is drawn does not change, so that groups add up."""
        self.gains[source] = 1.0 if on else 0.0
        self.changes += 1

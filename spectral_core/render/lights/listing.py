# SPDX-License-Identifier: GPL-3.0-or-later
"""The lights of a scene as plain rows of numbers, from which tables are built.

A *source* is a light in the artist's sense: a lamp, an emissive object, the world. An *item* is the unit of drawing: a
lamp, one triangle of an emissive mesh, the world.
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
"""Types of items, in their order: points, balls and spots; flat lamps; triangles of emissive meshes; suns; the
world.
"""


@dataclass(frozen=True, slots=True, eq=False)
class Source:
    """A light: its emission (linear RGB (3,) or a spectrum), the group that switches it, and a Mitsuba emitter.

    ``emitted`` is None if the emission varies over the surface or over directions; then only ``emitter`` knows it.
    """

    emitted: Array | Spectrum | None
    group: str
    emitter: Any | None = None
    camera_visible: bool = False
    pattern: Any | None = None
    """Texture of a factor that varies over a lamp, None for none; ``pattern_mean``: its mean magnitude."""
    pattern_mean: float = 1.0

    @property
    def brightness(self) -> float:
        """Mean magnitude of the emission over the channels; 1 if only the emitter knows it."""
        if self.emitted is None:
            return 1.0
        seen = xyz_of(self.emitted) if isinstance(self.emitted, Spectrum) else np.asarray(self.emitted)
        return abs(float(np.mean(seen))) * self.pattern_mean


@dataclass(frozen=True, slots=True, eq=False)
class Beam:
    """Distribution of a ball's light over directions. ``axes``: (3, 3) scaled local axes from world axes, the third
    along the beam.

    ``cosine``, ``softness``: edge of a spot, -2 for no edge. ``photometry``: a measured luminaire.
    """

    axes: Array = field(default_factory=lambda: np.eye(3))
    cosine: float = -2.0
    softness: float = 1e-6
    photometry_axes: Array = field(default_factory=lambda: np.eye(3))
    photometry: Photometry | None = None

    @property
    def is_even(self) -> bool:
        """True if the light is the same in every direction."""
        return self.cosine < -1 and self.photometry is None


@dataclass(frozen=True, slots=True, eq=False)
class Ball:
    """A point (radius 0) or a ball; the source's ``emitted`` is its radiant intensity.

    ``faces_receiver``: True if a disk that faces the receiver takes the place of the ball.
    """

    source: int
    center: Array
    radius: float
    faces_receiver: bool
    beam: Beam
    falloff: tuple[int, float]


@dataclass(frozen=True, slots=True, eq=False)
class Panel:
    """A flat lamp: ``half_axes`` (3, 2) from its center; it emits to the side of ``normal``, as radiance.

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
    """A disk at infinity in ``direction`` (toward it); emits radiance, or irradiance if its size is 0."""

    source: int
    direction: Array
    half_angle: float


@dataclass(frozen=True, slots=True, eq=False)
class EmissiveMesh:
    """An emissive mesh: world-space corners (t, 3, 3), UVs (t, 3, 2) or None, and its Mitsuba shape.

    ``brightness``: (t,) of each triangle, relative to the source's.
    """

    source: int
    corners: NDArray[np.float64]
    uvs: NDArray[np.float32] | None
    shape: Any
    brightness: Array


@dataclass
class LightList:
    """All lights of a scene. ``gains``: one factor per source; light groups are switched off by setting it to 0."""

    sources: list[Source] = field(default_factory=list)
    balls: list[Ball] = field(default_factory=list)
    panels: list[Panel] = field(default_factory=list)
    suns: list[Sun] = field(default_factory=list)
    emissive: list[EmissiveMesh] = field(default_factory=list)
    world: tuple[int, float] | None = None
    """The environment: its source, and the irradiance by which it is chosen."""
    world_is_constant: bool = False
    """True if the environment is equally bright in every direction."""
    even: bool = False
    """True if every source is drawn as if all were equally bright, near or far. Recordings need it: their lights are
    mixed later, so sampling must neither depend on the brightness of a light nor neglect one.
    """
    only_weighs: bool = False
    """True if Mitsuba's emitters give the light, and the list only the weights of their choice."""
    gains: Array = field(default_factory=lambda: np.ones(0))
    changes: int = 0
    """Number of switches so far: tables are read again after each. A callback would keep the scene in memory."""

    def strengths(self) -> list[float]:
        """Brightness of each source for the choice of lights."""
        return [1.0 if self.even and source.brightness > 0 else source.brightness for source in self.sources]

    def add_source(self, source: Source) -> int:
        """Add a source; returns its index. Rules know it by this number plus 1."""
        self.sources.append(source)
        self.gains = np.append(self.gains, 1.0)
        return len(self.sources) - 1

    def switch(self, source: int, on: bool) -> None:
        """Turn a source on or off; sampling does not change, so that groups add up."""
        self.gains[source] = 1.0 if on else 0.0
        self.changes += 1

# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights and surroundings, in Blender's units.

A light's ``color`` is a ``Color`` (that tints D65), a measured or designed ``Illuminant`` (normalized so that its
luminance is that of a white light of the same power), or an image for surroundings. Local axes are Blender's: a
light shines along its -Z.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from spectral_core.scene.geometry import affine
from spectral_core.scene.paint import Color, ImageTexture, Paint, gray


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class _Light:
    name: str
    world_from_light: NDArray[np.float64]
    color: Paint = field(default_factory=lambda: gray(1.0))
    group: str = ""
    camera_visible: bool = False
    """Whether the camera sees the light itself; mirrors always do. Blender's lights are not seen by default."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "world_from_light", affine(f"light {self.name!r}", self.world_from_light))


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class PointLight(_Light):
    """``power_w`` in watts as Blender means it: radiant intensity power / 4π, from a ball of ``radius``.

    ``soft_falloff``: Blender's option, on by default: the ball lights like a disk that faces the receiver.
    """

    power_w: float = 10.0
    radius: float = 0.0
    soft_falloff: bool = True


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class SpotLight(_Light):
    """A point light inside a cone: ``cone_angle_rad`` full angle, ``blend`` the soft share of it in [0, 1]."""

    power_w: float = 10.0
    radius: float = 0.0
    cone_angle_rad: float = np.pi / 4
    blend: float = 0.15
    soft_falloff: bool = True


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class SunLight(_Light):
    """``irradiance`` on a surface that faces it (Blender's strength), from a disk of ``angle_rad`` full angle."""

    irradiance: float = 1.0
    angle_rad: float = 0.00918


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class AreaLight(_Light):
    """One-sided: radiance power / (π · area). ``size``: full extent along local x and y; ellipse or rectangle."""

    power_w: float = 10.0
    shape: Literal["rectangle", "ellipse"] = "rectangle"
    size: tuple[float, float] = (1.0, 1.0)
    spread_rad: float = np.pi


Light = PointLight | SpotLight | SunLight | AreaLight


@dataclass(frozen=True, slots=True, eq=False)
class World:
    """Surroundings: ``color · strength`` as radiance from everywhere.

    An ImageTexture is an equirectangular environment, oriented as
    Blender's Environment Texture node does without a mapping (+Z up), then turned by ``world_from_environment`` (4, 4).
    """

    color: Paint = field(default_factory=lambda: Color(np.zeros(3)))
    strength: float = 1.0
    world_from_environment: NDArray[np.float64] = field(default_factory=lambda: np.eye(4))
    group: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "world_from_environment", affine("world", self.world_from_environment))

    @property
    def is_black(self) -> bool:
        """Whether it sheds no light at all."""
        dark = isinstance(self.color, Color) and not np.any(self.color.linear_rgb)
        return self.strength == 0 or dark

    @property
    def is_image(self) -> bool:
        """Whether the light comes from an image."""
        return isinstance(self.color, ImageTexture)

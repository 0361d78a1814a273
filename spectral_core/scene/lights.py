# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights and the environment, in Blender's units.

A light's ``color`` is a ``Color`` (that tints D65), a measured or designed ``Illuminant`` (normalized so that its
luminance is that of a white light of the same power), or an image for the environment. Local axes are Blender's: a
light is emitted along its -Z.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from spectral_core.checks import frozen_array, read_only_when_copied, require_declared, require_range
from spectral_core.errors import InvalidInputError
from spectral_core.scene.geometry import affine
from spectral_core.scene.paint import Color, ImageTexture, Paint, gray, require_paint
from spectral_core.scene.rays import Rays
from spectral_core.scene.shading.program import Computed
from spectral_core.scene.surface import ScatteringMedium
from spectral_core.spectra.spectrum import Spectrum

LARGEST = 1e30
"""Largest power or size; larger numbers overflow in the renderer's 32-bit arithmetic."""


@dataclass(frozen=True, slots=True)
class Falloff:
    """Dependence of strength on the distance d to the receiver, beside the inverse square: dᵖ · d² / (s + d²).

    ``power``: p, 0 is physical, 1 and 2 are Blender's Linear and Constant. ``smooth``: s, softens the center.
    """

    power: int = 0
    smooth: float = 0.0

    def __post_init__(self) -> None:
        require_declared(self)
        require_range("falloff power", self.power, 0, 2)
        require_range("falloff smooth", self.smooth, 0.0, LARGEST)


EVEN = Falloff()
"""The physical falloff: the inverse square alone."""


@read_only_when_copied
@dataclass(frozen=True, slots=True, eq=False)
class Photometry:
    """Strength by direction, the data of measured luminaires (an IES file).

    ``vertical_rad``: (v,) angles from the light's -Z, increasing. ``horizontal_rad``: (h,) angles about it, increasing;
    a single one counts all around. ``strength``: (h, v) factors, interpolated between the angles; 0 outside of them.
    """

    vertical_rad: NDArray[np.float64]
    horizontal_rad: NDArray[np.float64]
    strength: NDArray[np.float64]

    def __post_init__(self) -> None:
        for name in ("vertical_rad", "horizontal_rad"):
            angles = frozen_array(name, getattr(self, name), (None,))
            if len(angles) == 0 or np.any(np.diff(angles) <= 0):
                raise InvalidInputError(f"{name} of a luminaire must increase and not be empty; got {angles.tolist()}")
            object.__setattr__(self, name, angles)
        shape = (len(self.horizontal_rad), len(self.vertical_rad))
        object.__setattr__(self, "strength", frozen_array("strength of a luminaire", self.strength, shape))


@read_only_when_copied
@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class _Light:
    name: str
    world_from_light: NDArray[np.float64]
    color: Paint = field(default_factory=lambda: gray(1.0))
    group: str = ""
    camera_visible: bool = False
    """True if the camera sees the light itself; mirrors always do. The default is Blender's."""
    hidden_from: Rays = Rays.NONE
    """Types of rays that the light does not illuminate (other than the camera's)."""
    max_bounces: int = 1024
    """Number of bounces after which the light no longer counts."""
    casts_shadow: bool = True
    """False if nothing occludes the light where a surface samples it. Scattered rays that would meet the light
    are occluded even so, as in Cycles: of a large lamp beside a surface, a part of the shadow remains.
    """
    is_met: bool = True
    """False if no ray meets the light: mirrors do not show it, nor do lobes of a roughness below about 0.08, and other
    surfaces only sample it, as they do a lamp without Multiple Importance in Cycles.
    """
    falloff: Falloff = EVEN
    pattern: Computed | None = None
    """Factor of the emission, a number or a color, at a point of the light toward a receiver. The program may read the
    point (``position``), the direction toward the receiver (``incoming``), the light's ``normal`` there, which is that
    direction for points, spots and suns unless they are balls, the distance (``ray:Ray Length``) and the camera.
    """
    is_planckian: bool = False
    """True if ``color`` is that of a black body, which three channels represent well."""
    is_in_footage: bool = True
    """True if shadow catchers are lit by it already; what any other light adds to them is not in the picture."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "world_from_light", affine(f"light {self.name!r}", self.world_from_light))
        require_paint(f"the color of light {self.name!r}", self.color)
        require_declared(self)
        require_range(f"light {self.name!r}: max_bounces", self.max_bounces, 0, 1 << 20)
        for name, low, high in _RANGES:
            value = getattr(self, name, None)
            if name in _COUNTS and value is not None and len(value) != _COUNTS[name]:
                raise InvalidInputError(f"light {self.name!r}: {name} is {value}; expected {_COUNTS[name]} numbers")
            for number in value if isinstance(value, tuple) else () if value is None else (value,):
                require_range(f"light {self.name!r}: {name}", number, low, high)


_HALF_TURN = float(np.float32(np.pi))
"""Blender's largest angle of a cone and of a spread, in its own precision."""
_RANGES = (
    ("power_w", -LARGEST, LARGEST), ("radius", 0.0, LARGEST), ("irradiance", -LARGEST, LARGEST),
    ("size", 0.0, LARGEST),
    ("angle_rad", 0.0, 2 * np.pi), ("cone_angle_rad", 0.0, _HALF_TURN), ("blend", 0.0, 1.0),
    ("spread_rad", 0.0, _HALF_TURN), ("cone_scale", 1e-9, LARGEST),
)  # fmt: skip
"""Every number of a light with its range; NaN and infinity are outside every range. A light of negative power removes
light, as in Blender.
"""
_COUNTS = {"size": 2, "cone_scale": 3}
"""Numbers of the lists among them."""


@read_only_when_copied
@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class PointLight(_Light):
    """``power_w`` in watts as defined by Blender: radiant intensity power / 4π, from a ball of ``radius``.

    ``soft_falloff``: Blender's option, on by default: a disk that faces the receiver takes the place of the ball.
    """

    power_w: float = 10.0
    radius: float = 0.0
    soft_falloff: bool = True
    photometry: Photometry | None = None


@read_only_when_copied
@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class SpotLight(_Light):
    """A point light inside a cone: ``cone_angle_rad`` full angle, ``blend`` the soft share of it in [0, 1].

    ``cone_scale``: scale of the light's axes, which stretches the cone's cross-section to an ellipse. Axes that
    are not at right angles shear it.
    """

    power_w: float = 10.0
    radius: float = 0.0
    cone_angle_rad: float = np.pi / 4
    blend: float = 0.15
    soft_falloff: bool = True
    cone_scale: tuple[float, float, float] = (1.0, 1.0, 1.0)
    photometry: Photometry | None = None


@read_only_when_copied
@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class SunLight(_Light):
    """``irradiance`` on a surface that faces it (Blender's strength), from a disk of ``angle_rad`` full angle.

    ``is_of_world``: True for the disk of the sun in the world's sky, whose light is a part of the world's.
    """

    irradiance: float = 1.0
    angle_rad: float = 0.00918
    is_of_world: bool = False


@read_only_when_copied
@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class AreaLight(_Light):
    """One-sided: radiance power / (π · area). ``size``: full extent along local x and y; ellipse or rectangle."""

    power_w: float = 10.0
    shape: Literal["rectangle", "ellipse"] = "rectangle"
    size: tuple[float, float] = (1.0, 1.0)
    spread_rad: float = np.pi


Light = PointLight | SpotLight | SunLight | AreaLight


@read_only_when_copied
@dataclass(frozen=True, slots=True, eq=False)
class World:
    """The environment: ``color · strength`` as radiance from every direction.

    A color or a spectrum of negative strength removes light, as in Cycles; pixels of images have signs of their own.
    An ImageTexture is an equirectangular environment, oriented as in Blender's Environment Texture node without a
    mapping (+Z up), then rotated by ``world_from_environment`` (4, 4). ``hidden_from``: types of rays that it does not
    illuminate. ``camera_view``: the environment that the camera sees, if it differs from the one that lights the scene
    (its own ``camera_view`` is ignored). ``medium``: medium of all space outside of objects.
    """

    color: Paint = field(default_factory=lambda: Color(np.zeros(3)))
    strength: float = 1.0
    world_from_environment: NDArray[np.float64] = field(default_factory=lambda: np.eye(4))
    group: str = ""
    hidden_from: Rays = Rays.NONE
    max_bounces: int = 1024
    camera_view: World | None = None
    medium: ScatteringMedium | None = None
    is_planckian: bool = False
    """True if ``color`` is that of a black body, which three channels represent well."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "world_from_environment", affine("world", self.world_from_environment))
        require_paint("the color of the world", self.color)
        require_declared(self)
        least = -LARGEST if isinstance(self.color, (Color, Spectrum)) else 0.0
        require_range("world: strength", self.strength, least, LARGEST)
        require_range("world: max_bounces", self.max_bounces, 0, 1 << 20)

    @property
    def is_black(self) -> bool:
        """True if it emits no light."""
        dark = isinstance(self.color, Color) and not np.any(self.color.linear_rgb)
        return self.strength == 0 or dark

    @property
    def parts(self) -> tuple[World, ...]:
        """This environment and the one that the camera sees in its place, those that are not black."""
        seen = () if self.camera_view is None else (self.camera_view,)
        return tuple(world for world in (self, *seen) if not world.is_black)

    @property
    def is_image(self) -> bool:
        """True if the light comes from an image."""
        return isinstance(self.color, ImageTexture)

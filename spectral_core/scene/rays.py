# SPDX-License-Identifier: GPL-3.0-or-later
"""Types of rays, their visibility to objects and lights, and limits of paths."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntFlag

from spectral_core.checks import require_declared, require_range


class Rays(IntFlag):
    """Type of a ray, given by the direction in which it left the last surface; a transparent surface does not change
    it.
    """

    NONE = 0
    CAMERA = 1
    DIFFUSE = 2
    GLOSSY = 4
    TRANSMISSION = 8
    VOLUME = 16
    SHADOW = 32
    ALL = 63


UNLIMITED = 1 << 20


FIREFLY_CLAMP = 10.0
"""Blender's default limit of a sample's indirect light; from it on a limit removes only single bright pixels."""


@dataclass(frozen=True, slots=True)
class LightPaths:
    """Limits of paths beside the plan's number of bounces, as in Cycles' settings of the same names.

    ``diffuse``, ``glossy``, ``transmission``, ``volume``: bounces of that kind. ``transparent``: surfaces that a ray
    passes. ``clamp_direct``, ``clamp_indirect``: largest mean of a sample's channels, 0 for no limit; larger values are
    reduced to it. ``reflective_caustics``, ``refractive_caustics``: True if diffusely scattered rays may hit mirrors
    and glass. ``filter_glossy``: Cycles' Filter Glossy, 0 for none: reflections and refractions of light that was
    scattered widely before become blurred, the more, the larger it is.
    """

    diffuse: int = UNLIMITED
    glossy: int = UNLIMITED
    transmission: int = UNLIMITED
    transparent: int = UNLIMITED
    volume: int = UNLIMITED
    clamp_direct: float = 0.0
    clamp_indirect: float = 0.0
    reflective_caustics: bool = True
    refractive_caustics: bool = True
    filter_glossy: float = 0.0

    def __post_init__(self) -> None:
        require_declared(self)
        for name in ("diffuse", "glossy", "transmission", "transparent", "volume"):
            require_range(f"bounces ({name})", getattr(self, name), 0, UNLIMITED)
        for name in ("clamp_direct", "clamp_indirect", "filter_glossy"):
            require_range(name, getattr(self, name), 0.0, 1e30)

    @property
    def clamps(self) -> bool:
        """True if limits on a sample's light remove more than fireflies."""
        return self.clamp_direct > 0 or 0 < self.clamp_indirect < FIREFLY_CLAMP


UNLIMITED_PATHS = LightPaths()
"""No limits beside the plan's."""

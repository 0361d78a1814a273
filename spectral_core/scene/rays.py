# SPDX-License-Identifier: GPL-3.0-or-later
"""Kinds of rays, which of them meet an object or a light, and how long light is followed."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntFlag

from spectral_core.checks import require_range


class Rays(IntFlag):
    """Kind of a ray, given by how it left the last surface; a transparent surface does not change it."""

    NONE = 0
    CAMERA = 1
    DIFFUSE = 2
    GLOSSY = 4
    TRANSMISSION = 8
    VOLUME = 16
    SHADOW = 32
    ALL = 63


UNLIMITED = 1 << 20


@dataclass(frozen=True, slots=True)
class LightPaths:
    """Where paths end beside the plan's own count, as Cycles' settings of the same names say.

    ``diffuse``, ``glossy``, ``transmission``, ``volume``: bounces of that kind. ``transparent``: surfaces that a
    ray passes. ``clamp_direct``, ``clamp_indirect``: largest mean of a sample's channels, 0 for no limit; what is above
    is lost.
    ``reflective_caustics``, ``refractive_caustics``: whether what was scattered diffusely meets mirrors and glass.
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

    def __post_init__(self) -> None:
        for name in ("diffuse", "glossy", "transmission", "transparent", "volume"):
            require_range(f"bounces ({name})", getattr(self, name), 0, UNLIMITED)
        for name in ("clamp_direct", "clamp_indirect"):
            require_range(name, getattr(self, name), 0.0, 1e30)


UNLIMITED_PATHS = LightPaths()
"""No limits beside the plan's."""

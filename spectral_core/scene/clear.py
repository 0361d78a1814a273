# SPDX-License-Identifier: GPL-3.0-or-later
"""Closures that scatter nothing: light passes, goes on elsewhere, or ends."""

from __future__ import annotations

from dataclasses import dataclass, field

from spectral_core.scene.paint import Paint, gray
from spectral_core.scene.shading.program import Computed


@dataclass(frozen=True, slots=True, eq=False)
class Transparent:
    """Transmits light without refraction, times ``color``."""

    color: Paint = field(default_factory=lambda: gray(1.0))


@dataclass(frozen=True, slots=True, eq=False)
class Holdout:
    """Emits and scatters nothing; where the camera sees it, the picture is transparent."""


@dataclass(frozen=True, slots=True, eq=False)
class RayPortal:
    """Rays go on elsewhere, times ``color``: from ``position`` along ``direction`` in the world.

    Without a position they go on from the point that they hit, without a direction or with a zero one straight on.
    """

    color: Paint = field(default_factory=lambda: gray(1.0))
    position: Computed | None = None
    direction: Computed | None = None

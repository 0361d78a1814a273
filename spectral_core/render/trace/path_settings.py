# SPDX-License-Identifier: GPL-3.0-or-later
"""How far the path integrator follows light."""

from __future__ import annotations

from dataclasses import dataclass

from spectral_core.scene import UNLIMITED_PATHS, LightPaths

ROULETTE_BOUNCES = 5
"""Bounces from which on Russian roulette may end a path."""
MOST_LAYERS = 1024
"""Surfaces that a ray may pass straight through, whatever the scene allows."""


@dataclass(frozen=True)
class PathSettings:
    """``bounces`` after the first surface; ``transparency``: whether shadow rays ask surfaces what they let through.

    ``white``: radiance of a white of strength 1 in the transport's own unit, which clamping is relative to.
    """

    bounces: int
    transparency: bool
    limits: LightPaths = UNLIMITED_PATHS
    white: float = 1.0

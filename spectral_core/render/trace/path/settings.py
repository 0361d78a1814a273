# SPDX-License-Identifier: GPL-3.0-or-later
"""Limits of the path integrator."""

from __future__ import annotations

from dataclasses import dataclass

from spectral_core.scene import UNLIMITED_PATHS, LightPaths

ROULETTE_BOUNCES = 3
"""Number of bounces from which Russian roulette may end a path."""
ROULETTE_SHARE = 1.3
"""Chance that a path goes on, over the square root of its throughput. It gives the least variance for the time in
rooms, hair and glass; with the throughput itself many bright paths ended, which made noise.
"""
ROULETTE_SURE = 16
"""Number of bounces up to which paths of full throughput go on for sure; then they end, too, in closed white rooms."""
MOST_LAYERS = 1024
"""Most surfaces that a ray may pass straight, whatever the scene allows."""


@dataclass(frozen=True)
class PathSettings:
    """``bounces`` after the first surface; ``transparency``: True if shadow rays pass transparent surfaces.

    ``white``: radiance of a white of strength 1 in the unit of the transport, to which clamping is relative.
    ``clear_glass``: True if the environment is not visible through smooth glass, and the picture is transparent there.
    """

    bounces: int
    transparency: bool
    limits: LightPaths = UNLIMITED_PATHS
    white: float = 1.0
    clear_glass: bool = False

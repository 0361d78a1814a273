# SPDX-License-Identifier: GPL-3.0-or-later
"""Sampling and decisions that the artist made, from the scene's properties."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from spectral_core.scene import RenderSettings


@dataclass(frozen=True)
class Sampling:
    """Samples per pixel, and the seed of their random numbers."""

    samples: int = 64
    seed: int = 0


def sampling_of(scene: Any) -> Sampling:
    """Samples and seed of a Blender scene."""
    settings = getattr(scene, "spectral", None)
    if settings is None:
        return Sampling()
    return Sampling(settings.samples, settings.seed)


def settings_of(scene: Any) -> RenderSettings:
    """What the artist fixed; what is left at AUTO is the plan's to decide."""
    settings = getattr(scene, "spectral", None)
    if settings is None:
        return RenderSettings()
    return RenderSettings()

# SPDX-License-Identifier: GPL-3.0-or-later
"""Sampling and decisions that the artist made, from the scene's properties."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from spectral_core.scene import RenderSettings


@dataclass(frozen=True)
class Sampling:
    """Samples per pixel, and the seed of their random numbers."""

    samples: int
    seed: int


def sampling_of(scene: Any) -> Sampling:
    """Samples and seed of a Blender scene; an animated seed is the artist's own affair."""
    settings = scene.spectral.render
    return Sampling(settings.samples, settings.seed)


def settings_of(scene: Any) -> RenderSettings:
    """What the artist fixed; what is left automatic is the plan's to decide."""
    settings = scene.spectral.render
    chosen = overrides_of(settings)
    transport = chosen.pop("transport", None)
    return RenderSettings(
        transport=transport,  # type: ignore[arg-type]
        tolerance_delta_e=settings.tolerance,
        overrides=tuple(sorted(chosen.items())),
    )


def overrides_of(settings: Any) -> dict[str, str]:
    """Effect → value that the artist chose instead of the plan's."""
    chosen = {each.name: each.value for each in settings.overrides}
    if settings.transport != "AUTO":
        chosen["transport"] = settings.transport.lower()
    return chosen

# SPDX-License-Identifier: GPL-3.0-or-later
"""Sampling and the artist's decisions, from the scene's properties."""

from __future__ import annotations

from collections.abc import Callable, Set
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from spectral_core.scene import UNLIMITED_PATHS, LightPaths, RenderSettings

from ..properties.render import RENDER_FIELDS
from .context import finite


@dataclass(frozen=True)
class Sampling:
    """Samples per pixel, and the seed of their random numbers."""

    samples: int
    seed: int


def sampling_of(scene: Any) -> Sampling:
    """Samples and seed of a Blender scene; an animated seed is used as the artist set it."""
    return Sampling(**_stated(scene.spectral.render, Sampling))


def settings_of(scene: Any) -> RenderSettings:
    """The artist's fixed settings; automatic ones are decided by the plan. Raises InvalidInputError for NaN."""
    settings = scene.spectral.render
    chosen = {each.name: each.value for each in settings.overrides if each.name != "transport"}
    cycles = getattr(scene, "cycles", None)
    unused = {name for name, goal in (("target_error", "ERROR"), ("time_budget_s", "TIME")) if settings.goal != goal}
    stated = _stated(settings, RenderSettings, unused)
    return RenderSettings(
        **stated,
        overrides=tuple(sorted(chosen.items())),
        light_paths=UNLIMITED_PATHS if cycles is None else _light_paths(cycles),
        scene_bounces=None if cycles is None else int(cycles.max_bounces),
    )


def _stated(settings: Any, kind: type, unused: Set[str] = frozenset()) -> dict[str, Any]:
    """Arguments of ``kind`` by the declaration of each setting, without those that are ``unused``."""
    known = {each.name for each in fields(kind)} - unused
    named = {core: field.name for field in RENDER_FIELDS.values() for core in field.core if core in known}
    return {
        core: _READ[core](getattr(settings, name)) if core in _READ else _value(settings, name)
        for core, name in named.items()
    }


def _value(settings: Any, name: str) -> Any:
    """A setting. Blender holds numbers in single precision, where the least error that the panel allows, 0.02, is a
    little less: the shortest decimal number of the same bits is what was stated.
    """
    if not isinstance(getattr(settings, name), float):
        return getattr(settings, name)
    return float(str(np.float32(finite(settings, name, "of the render settings"))))


_READ: dict[str, Callable[[Any], Any]] = {"transport": lambda name: None if name == "AUTO" else name.lower()}
"""Functions that read an attribute whose value differs from the property's."""


def overrides_of(settings: Any) -> dict[str, str]:
    """Effect → value of the artist's overrides of the plan."""
    chosen = {each.name: each.value for each in settings.overrides}
    if settings.transport != "AUTO":
        chosen["transport"] = settings.transport.lower()
    return chosen


def _light_paths(cycles: Any) -> LightPaths:
    """Cycles' limits on paths, which files use with any engine."""
    return LightPaths(
        diffuse=cycles.diffuse_bounces,
        glossy=cycles.glossy_bounces,
        transmission=cycles.transmission_bounces,
        transparent=cycles.transparent_max_bounces,
        volume=cycles.volume_bounces,
        clamp_direct=cycles.sample_clamp_direct,
        clamp_indirect=cycles.sample_clamp_indirect,
        reflective_caustics=cycles.caustics_reflective,
        refractive_caustics=cycles.caustics_refractive,
        filter_glossy=cycles.blur_glossy,
    )

# SPDX-License-Identifier: GPL-3.0-or-later
"""Sampling and the artist's decisions, from the scene's properties."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Any

from spectral_core.scene import UNLIMITED_PATHS, LightPaths, RenderSettings

from ..properties.render import RENDER_FIELDS


@dataclass(frozen=True)
class Sampling:
    """Samples per pixel, and the seed of their random numbers."""

    samples: int
    seed: int


def sampling_of(scene: Any) -> Sampling:
    """Samples and seed of a Blender scene; an animated seed is used as the artist set it."""
    return Sampling(**_stated(scene.spectral.render, Sampling))


def settings_of(scene: Any) -> RenderSettings:
    """The artist's fixed settings; automatic ones are decided by the plan."""
    settings = scene.spectral.render
    chosen = {each.name: each.value for each in settings.overrides if each.name != "transport"}
    cycles = getattr(scene, "cycles", None)
    stated = _stated(settings, RenderSettings)
    for name, goal in (("target_error", "ERROR"), ("time_budget_s", "TIME")):
        stated[name] = stated.get(name) if settings.goal == goal else None
    return RenderSettings(
        **stated,
        overrides=tuple(sorted(chosen.items())),
        light_paths=UNLIMITED_PATHS if cycles is None else _light_paths(cycles),
        scene_bounces=None if cycles is None else int(cycles.max_bounces),
    )


def _stated(settings: Any, kind: type) -> dict[str, Any]:
    """Arguments of ``kind`` by the declaration of each setting."""
    known = {each.name for each in fields(kind)}
    named = {core: field.name for field in RENDER_FIELDS.values() for core in field.core if core in known}
    return {core: _READ.get(core, _same)(getattr(settings, name)) for core, name in named.items()}


def _same(value: Any) -> Any:
    return value


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

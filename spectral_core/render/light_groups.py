# SPDX-License-Identifier: GPL-3.0-or-later
"""Sources of a scene by light group: lamps, the environment, surfaces and media that emit light."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from spectral_core.scene import (
    Color,
    Emission,
    Light,
    Material,
    Principled,
    ScatteringMedium,
    Scene,
    SunLight,
    World,
    weighted_leaves,
)
from spectral_core.spectra.spectrum import Spectrum


def light_groups(scene: Scene) -> tuple[str, ...]:
    """Names of the light groups of all sources, sorted."""
    names = {light.group for light in scene.lights}
    if world_paints(scene.world):
        names.add(scene.world.group)
    emissive = emissive_materials(scene)
    names |= {instance.group for instance in scene.instances if emissive.intersection(instance.materials)}
    return tuple(sorted(names))


def group_text(name: str) -> str:
    """A light group in a message; lights without one are in a group whose name is empty."""
    return repr(name) if name else "'' (lights without a group)"


def emissive_materials(scene: Scene) -> set[str]:
    """Names of the materials whose surface or medium emits light."""
    return {material.name for material in scene.materials if any(True for _ in emitted_paints(material))}


def emits_from_surface(material: Material) -> bool:
    """True if the surface of a material emits light."""
    return any(True for _ in _surface_paints(material))


def emitted_paints(material: Material) -> Iterator[Any]:
    """Paint of each emission of a material's surface and medium; none of those that are dark."""
    yield from _surface_paints(material)
    if material.medium is not None and emits(material.medium):
        yield medium_paint(material.medium)


def _surface_paints(material: Material) -> Iterator[Any]:
    for weight, closure in weighted_leaves(material.surface):
        if isinstance(closure, Emission):
            color, strength = closure.color, closure.strength
        elif isinstance(closure, Principled):
            color, strength = closure.emission_color, closure.emission_strength
            weight = weight.times(closure.alpha)
        else:
            continue
        is_dark = weight.constant == 0 or (isinstance(strength, (int, float)) and strength == 0)
        if not is_dark and not is_black(color):
            yield color


def emits(medium: ScatteringMedium) -> bool:
    """True if a medium emits light."""
    return medium.emission_strength > 0 and not is_black(medium_paint(medium))


def medium_paint(medium: ScatteringMedium) -> Any:
    """Paint of a medium's emission; the grid if that has colors, which filter white."""
    has_colors = medium.grid is not None and medium.grid.emission is not None and medium.grid.emission.ndim == 4
    return medium.grid if has_colors else medium.emission_color


def shines(light: Light) -> bool:
    """True if a lamp emits light: neither its power nor its color is 0."""
    power = light.irradiance if isinstance(light, SunLight) else light.power_w
    return power != 0 and not is_black(light.color)


def is_black(paint: Any) -> bool:
    """True for a color of zeros."""
    return isinstance(paint, Color) and not np.any(paint.linear_rgb)


def world_paints(world: World) -> list[Any]:
    """Paints of the environment, of the one that the camera sees, and of the world's medium; none of those that are
    dark.
    """
    paints = [part.color for part in world.parts]
    return [*paints, medium_paint(world.medium)] if world.medium is not None and emits(world.medium) else paints


def is_of_world(light: Light) -> bool:
    """True for the sun of the world's sky."""
    return isinstance(light, SunLight) and light.is_of_world


def world_varies(scene: Scene) -> bool:
    """True if the light of the world has several colors: a sky and its sun, or as ``has_several_colors`` says."""
    has_sun = any(is_of_world(light) and shines(light) for light in scene.lights)
    return has_sun or has_several_colors(scene.world)


def has_several_colors(world: World) -> bool:
    """True if the environment, the camera's view of it and the world's medium emit several colors, none of them given
    as a spectrum.
    """
    first, *others = world_paints(world) or [None]
    if not others or any(isinstance(paint, Spectrum) for paint in (first, *others)):
        return False
    return not all(_same_color(first, paint) for paint in others)


def _same_color(first: Any, second: Any) -> bool:
    both = isinstance(first, Color) and isinstance(second, Color)
    return both and np.array_equal(first.linear_rgb, second.linear_rgb)

# SPDX-License-Identifier: GPL-3.0-or-later
"""Limits of lamps that Cycles applies to a part of their light alone, beside rough glass."""

from __future__ import annotations

from typing import Any

from spectral_core.scene import Glass, Light, Principled, Rays, Scene, Surface, leaves

from ..context import Translation

HIDDEN = ((Rays.GLOSSY, "glossy"), (Rays.TRANSMISSION, "transmission"))
"""Types of rays that a lamp may be hidden from, and whose light Cycles samples nevertheless, at rough glass."""


def note_lamps_beside_rough_glass(translation: Translation, scene: Scene) -> None:
    """Note the lamps of a scene with rough glass that are hidden from some rays, or whose bounces are limited."""
    glass = [material.name for material in scene.materials if _is_rough_glass(material.surface)]
    for light in scene.lights if glass else ():
        kinds = [name for rays, name in HIDDEN if light.hidden_from & rays]
        if kinds:
            message = (
                f"it is hidden from {' and '.join(kinds)} rays: of its light on the rough glass {glass[0]!r}, Cycles "
                "takes away only that of rays which hit the lamp, here all is taken away"
            )
            translation.note(light.name, message)
        if _is_limited(light, scene.settings.scene_bounces):
            message = (
                f"its Max Bounces is {light.max_bounces}: beside the rough glass {glass[0]!r}, Cycles does not count "
                "the bounces of rays that hit the lamp, here they count"
            )
            translation.note(light.name, message)


def _is_limited(light: Light, of_scene: int | None) -> bool:
    """True if a lamp's light ends before that of the scene; 1024 is Blender's default."""
    return light.max_bounces < (1024 if of_scene is None else min(of_scene, 1024))


def _is_rough_glass(surface: Surface | None) -> bool:
    """True for glass and transmission that scatter."""
    return any(_is_rough(leaf) for leaf in leaves(surface))


def _is_rough(leaf: Any) -> bool:
    transmits = isinstance(leaf, Glass) or (isinstance(leaf, Principled) and leaf.transmission != 0)
    return transmits and leaf.roughness != 0

# SPDX-License-Identifier: GPL-3.0-or-later
"""Lamps whose shadow linking leaves out objects, beside mirrors and smooth glass."""

from __future__ import annotations

from typing import Any

from spectral_core.scene import Glass, Glossy, Metal, Principled, Scene, Surface, leaves

from ..context import Translation

SHINY = Glass, Glossy, Metal, Principled


def note_linked_shadows_beside_mirrors(translation: Translation, scene: Scene) -> None:
    """Note the lamps that mirrors and smooth glass show past objects in Cycles.

    What other surfaces see of such lamps is sampled, past the objects as well.
    """
    left_out = {light: item.name for item in scene.instances for light in item.clear_for}
    shiny = [material.name for material in scene.materials if left_out and _is_smooth(material.surface)]
    for light in scene.lights if shiny else ():
        blocker = left_out.get(light.name)
        if blocker is not None and getattr(light, "radius", 1.0) > 0:  # no ray hits a lamp without size
            message = (
                f"its shadow linking leaves out {blocker!r}, which smooth surfaces such as {shiny[0]!r} show here; in "
                "Cycles they show the lamp past it, and light that enters excluded smooth glass counts again there"
            )
            translation.note(light.name, message)


def _is_smooth(surface: Surface | None) -> bool:
    return any(_is_mirror(leaf) for leaf in leaves(surface))


def _is_mirror(leaf: Any) -> bool:
    return isinstance(leaf, SHINY) and leaf.roughness == 0  # a pattern is not 0

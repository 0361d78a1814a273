# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene that a plan simulates: what the plan leaves out is taken out before the renderer sees it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from spectral_core.render.plan.effects import EffectPlan
from spectral_core.scene import Emission, Glass, Material, Principled, Scene, Surface, World, map_leaves
from spectral_core.scene.surface import Closure
from spectral_core.spectra.spectrum import Spectrum

SODIUM_D_NM = 589.3
"""Where an index of refraction is quoted when it is one number."""


def simulated_scene(scene: Scene, plan: EffectPlan) -> Scene:
    """``scene`` without the effects that are off in ``plan``."""
    changes: dict[str, Any] = {}
    if not plan.is_on("depth_of_field") and scene.camera.aperture_radius > 0:
        changes["camera"] = replace(scene.camera, aperture_radius=0.0)
    if not plan.is_on("environment") and not scene.world.is_black:
        changes["world"] = World()
    if not plan.is_on("volumes") and scene.volumes:
        changes["volumes"] = ()
    materials = tuple(_material(material, plan) for material in scene.materials)
    if any(new is not old for new, old in zip(materials, scene.materials, strict=True)):
        changes["materials"] = materials
    return replace(scene, **changes) if changes else scene


def _material(material: Material, plan: EffectPlan) -> Material:
    surface = material.surface if material.surface is None else _surface(material.surface, plan)
    medium = material.medium if plan.is_on("media") else None
    if surface is material.surface and medium is material.medium:
        return material
    return replace(material, surface=surface, medium=medium)


def _surface(surface: Surface, plan: EffectPlan) -> Surface:
    return map_leaves(surface, lambda leaf: _closure(leaf, plan))


def _closure(surface: Closure, plan: EffectPlan) -> Closure:
    if isinstance(surface, (Glass, Principled)) and isinstance(surface.ior, Spectrum) and not plan.is_on("dispersion"):
        surface = replace(surface, ior=float(surface.ior.at(SODIUM_D_NM)) or 1.5)
    if not plan.is_on("emissive_meshes"):
        if isinstance(surface, Emission):
            return replace(surface, strength=0.0)
        if isinstance(surface, Principled) and surface.emission_strength != 0:
            return replace(surface, emission_strength=0.0)
    return surface

# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene that a plan simulates: omitted effects are removed before rendering."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from spectral_core.render.plan.borders import with_borders_apart
from spectral_core.render.plan.decision import USUAL_BOUNCES, EffectPlan
from spectral_core.render.plan.inventory import media_borders
from spectral_core.scene import (
    Diffuse,
    Emission,
    Fluorescent,
    Glass,
    Light,
    LightPaths,
    Material,
    Metal,
    PointLight,
    Principled,
    Scene,
    SpotLight,
    Surface,
    World,
    map_leaves,
    nominal_ior,
)
from spectral_core.scene.surface import Closure
from spectral_core.spectra.spectrum import Spectrum


def simulated_scene(scene: Scene, plan: EffectPlan) -> Scene:
    """``scene`` without the effects that are off in ``plan``; faces that rays pass share no plane with others."""
    changes: dict[str, Any] = {}
    if not plan.is_on("depth_of_field") and scene.camera.aperture_radius > 0:
        changes["camera"] = replace(scene.camera, aperture_radius=0.0)
    if not plan.is_on("environment") and scene.world.parts:
        changes["world"] = World(medium=scene.world.medium)
    if not plan.is_on("media") and scene.world.medium is not None:
        changes["world"] = replace(changes.get("world", scene.world), medium=None)
    if not plan.is_on("volumes") and scene.volumes:
        changes["volumes"] = ()
    materials = tuple(_material(material, plan) for material in scene.materials)
    if any(new is not old for new, old in zip(materials, scene.materials, strict=True)):
        changes["materials"] = materials
        emptied = media_borders(scene) if not plan.is_on("media") else frozenset()
        if emptied:  # an omitted medium leaves no border behind
            changes["instances"] = tuple(
                item for item in scene.instances if not item.materials or not emptied.issuperset(item.materials)
            )
    lights = tuple(_light(light, plan) for light in scene.lights)
    if any(new is not old for new, old in zip(lights, scene.lights, strict=True)):
        changes["lights"] = lights
    paths = _light_paths(scene.settings.light_paths, plan)
    if paths != scene.settings.light_paths:
        changes["settings"] = replace(scene.settings, light_paths=paths)
    scene = replace(scene, **changes) if changes else scene
    return with_borders_apart(scene)


def _light_paths(paths: LightPaths, plan: EffectPlan) -> LightPaths:
    """Limits by type if they end paths before the limit on all bounces; caustics if any object can cause them.

    The integrator for media has none of these limits.
    """
    if plan.is_on("media"):
        return paths
    changes: dict[str, Any] = {}
    for kind in ("diffuse", "glossy", "transmission"):
        decision = plan[f"{kind}_bounces"]
        most = int(decision.value)
        if most >= USUAL_BOUNCES and decision.source != "artist":
            continue  # no limit: those on all bounces may be further
        if most < min(plan.bounces, getattr(paths, kind)):
            changes[kind] = most
    for name in ("reflective_caustics", "refractive_caustics"):
        decision = plan[name]
        matters = decision.source == "artist" or decision.how != "exact"
        if not decision.is_on and matters and getattr(paths, name):
            changes[name] = False
    return replace(paths, **changes) if changes else paths


def _light(light: Light, plan: EffectPlan) -> Light:
    if isinstance(light, (PointLight, SpotLight)) and light.radius > 0 and not plan.is_on("lamp_bodies"):
        return replace(light, radius=0.0)
    return light


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
        surface = replace(surface, ior=nominal_ior(surface.ior))
    if (
        isinstance(surface, (Glass, Metal, Principled))
        and surface.thin_film_thickness != 0
        and not plan.is_on("thin_film")
    ):
        surface = replace(surface, thin_film_thickness=0.0)
    if isinstance(surface, Fluorescent) and not plan.is_on("fluorescence"):
        return Diffuse(surface.color, normal=surface.normal)
    if not plan.is_on("emissive_meshes"):
        if isinstance(surface, Emission):
            return replace(surface, strength=0.0)
        if isinstance(surface, Principled) and surface.emission_strength != 0:
            return replace(surface, emission_strength=0.0)
    return surface

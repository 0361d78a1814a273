# SPDX-License-Identifier: GPL-3.0-or-later
"""Light groups of a scene: their sources, their spectra, and their changes since a recording."""

from __future__ import annotations

from collections.abc import Container, Mapping
from dataclasses import dataclass, replace
from itertools import count
from typing import Any

import numpy as np

from spectral_core.render.light_groups import (
    emissive_materials,
    emitted_paints,
    is_of_world,
    light_groups,
    shines,
    world_paints,
    world_varies,
)
from spectral_core.render.mitsuba_scene.paint import emitted_spectrum, unit_luminance, white_light
from spectral_core.render.plan.effects import plan_from_data
from spectral_core.scene import Color, Instance, Scene, World, gray, scene_hash
from spectral_core.scene.motion import following
from spectral_core.spectra.spectrum import Spectrum


@dataclass(frozen=True)
class Fingerprint:
    """Data that determine the share of each light group: its own lights, and everything else."""

    rest: str
    """Hash of everything that affects all groups: geometry, materials, camera, film and settings of transport."""
    groups: dict[str, str]
    """Hash of the lamps and the environment of each group."""


def fingerprint(scene: Scene, *, one_per_light: bool = False) -> Fingerprint:
    """Fingerprint of a scene for ``record_transport``."""
    scene = one_group_per_light(scene) if one_per_light else scene
    dark, fog = World(gray(0.0)), World(gray(0.0), medium=scene.world.medium)
    plan = plan_from_data(scene, lights_vary=True)  # as recordings are; a pilot would run Mitsuba in Blender's process
    rest = replace(scene, lights=(), world=fog, notes=())
    own = {}
    for name in light_groups(scene):
        lamps = tuple(light for light in scene.lights if light.group == name)
        own[name] = scene_hash((lamps, scene.world if scene.world.group == name else dark))
    # the first group has the light that volumes emit, see ``RenderJob``
    order = tuple(own) if scene.volumes else ()
    return Fingerprint(scene_hash((rest, plan.is_spectral, plan.bounces, order)), own)


def changed_groups(before: Fingerprint, now: Fingerprint) -> tuple[str, ...] | None:
    """Groups of ``now`` that must be recorded again; None for all, if anything other than lights changed."""
    if before.rest != now.rest:
        return None
    return tuple(name for name, own in now.groups.items() if before.groups.get(name) != own)


def with_light_names(scene: Scene, names: Mapping[str, str]) -> Scene:
    """The scene with other names of lights, by their present names; no other name changes."""
    if not names:
        return scene

    def renamed(instance: Instance) -> Instance:
        linked = (instance.unlit_by, instance.clear_for)
        if not names.keys() & {*linked[0], *linked[1]}:
            return instance
        unlit, clear = (tuple(names.get(name, name) for name in each) for each in linked)
        return replace(instance, unlit_by=unlit, clear_for=clear)

    return replace(
        scene,
        lights=tuple(
            replace(light, name=names[light.name]) if light.name in names else light for light in scene.lights
        ),
        instances=tuple(map(renamed, scene.instances)),
        moments=tuple(replace(each, instances=tuple(map(renamed, each.instances))) for each in scene.moments),
    )


def one_group_per_light(scene: Scene) -> Scene:
    """The scene with every light, emissive object and the environment in a group of its own.

    The suns of the environment's sky are in its group. Objects of equal names stay separate: the second gets a number,
    as in Blender (``Lamp.001``).
    """
    taken: set[str] = set()

    def own(name: str) -> str:
        numbered = (f"{name}.{number:03d}" for number in count(1))
        free = name if name not in taken else next(other for other in numbered if other not in taken)
        taken.add(free)
        return free

    lights = [light if is_of_world(light) else replace(light, group=own(light.name)) for light in scene.lights]
    emissive = emissive_materials(scene)
    instances = tuple(
        replace(instance, group=own(instance.name) if emissive.intersection(instance.materials) else instance.name)
        for instance in scene.instances
    )
    world = own(scene.world.group or "World")
    return replace(
        scene,
        lights=tuple(replace(light, group=world) if is_of_world(light) else light for light in lights),
        instances=instances,
        moments=following(scene.moments, instances),
        world=replace(scene.world, group=world),
    )


def several_colors(scene: Scene) -> frozenset[str]:
    """Names of the emissive materials of objects that shine in several colors, none of them given as a spectrum.

    Their colors filter the light, as those of an image do: no single spectrum is the object's. A material is shared by
    objects, so one in several colors may make those of another object differ.
    """
    paints = {material.name: list(emitted_paints(material)) for material in scene.materials}
    found: frozenset[str] = frozenset()
    while True:
        more = found
        for instance in scene.instances:
            own = {name for name in instance.materials if paints.get(name)}
            shown = [_filtered(paint, name in found) for name in own for paint in paints[name]]
            if not any(isinstance(paint, Spectrum) for paint in shown) and any(paint != shown[0] for paint in shown):
                more |= own
        if more == found:
            return found
        found = more


def _filtered(paint: Any, is_filter: bool) -> Any:
    """What distinguishes the light of a paint: a color or a spectrum, None for those that filter white."""
    if isinstance(paint, Color):
        return None if is_filter else tuple(paint.linear_rgb)
    return paint if isinstance(paint, Spectrum) else None


def group_light(scene: Scene, group: str, filters: Container[str] | None = None) -> Spectrum | None:
    """The single spectrum of all sources of a group, scaled to the luminance of its color; None if they differ.

    Colors tint the scene's white. Sources that emit nothing count only in a group without others. ``filters``: what
    ``several_colors`` returns, whose materials are lit by white; it is called if None.
    """
    white = None if scene.settings.white is None else unit_luminance(scene.settings.white)
    lamps = [light for light in scene.lights if light.group == group and not is_of_world(light)]
    paints: list[Any] = [light.color for light in lamps if shines(light)]
    if scene.world.group == group:
        paints += [None] if world_varies(scene) else world_paints(scene.world)
    paints += _emissive_paints(scene, group, filters)
    paints = paints or [light.color for light in lamps]
    # a varying emission was recorded as a filter of the light: alone it tints white
    tinted = white or white_light()
    spectra = [emitted_spectrum(p, white) if isinstance(p, (Color, Spectrum)) else tinted for p in paints]
    if not spectra:
        return None
    first = spectra[0]
    same = all(s.grid.same_as(first.grid) and np.allclose(s.values, first.values) for s in spectra[1:])
    return first if same else None


def _emissive_paints(scene: Scene, group: str, filters: Container[str] | None) -> list[Any]:
    """Paints of the emission of a group's objects."""
    assigned = {name for instance in scene.instances if instance.group == group for name in instance.materials}
    own = [(each.name, paint) for each in scene.materials if each.name in assigned for paint in emitted_paints(each)]
    known = several_colors(scene) if own and filters is None else filters or ()
    return [None if name in known else paint for name, paint in own]

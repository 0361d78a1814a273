# SPDX-License-Identifier: GPL-3.0-or-later
"""Inventory of a scene for the plan: a walk over lights, materials and paints, without decisions."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from spectral_core.errors import first_of
from spectral_core.render.plan.light.sizes import largest_reflectance, largest_size, paint_parts
from spectral_core.scene import (
    AreaLight,
    Color,
    Computed,
    EllipseHair,
    Emission,
    Fluorescent,
    Glass,
    Glossy,
    Hair,
    HairLobe,
    ImageTexture,
    Material,
    Mesh,
    Metal,
    Principled,
    RayPortal,
    Rays,
    ScatteringMedium,
    Scene,
    SpectralImage,
    SunLight,
    Transparent,
    largest_sum,
    leaves,
    values_of,
)
from spectral_core.spectra.spectrum import Spectrum

_IMAGES = (Computed, ImageTexture, SpectralImage)
SHARP_ROUGHNESS = 0.25
"""Roughness below which a lobe is so narrow that paths may miss a lamp in it."""


@dataclass(frozen=True, slots=True)
class Inventory:
    """Names of items with spectra, dispersion, emission, transparency, …; materials count only if used."""

    spectra: tuple[str, ...]
    dispersive: tuple[str, ...]
    fluorescent: tuple[str, ...]
    films: tuple[str, ...]
    media: tuple[str, ...]
    scattering: tuple[str, ...]
    """Media that scatter or emit light; the others absorb it."""
    emissive: tuple[str, ...]
    transparent: tuple[str, ...]
    refractive: tuple[str, ...]
    glossy: tuple[str, ...]
    strands: tuple[str, ...]
    images: tuple[str, ...]
    light_bodies: tuple[str, ...]
    source_count: int
    surfaces: int
    largest_reflectance: float

    @property
    def bodies_shade(self) -> bool:
        """True if a light with a size could shade another one, where lights are objects of the scene."""
        return bool(self.light_bodies) and self.source_count > 1


def take_inventory(scene: Scene) -> Inventory:
    """Walk over a scene."""
    shown, borders = shown_materials(scene), media_borders(scene)
    materials = [material for material in scene.materials if material.name in shown]
    which = lambda test: tuple(material.name for material in materials if test(material))  # noqa: E731
    spectral_lights = tuple(
        light.name for light in scene.lights if not light.is_planckian and _has_spectrum(light.color)
    )
    is_spectral = any(_has_spectrum(part.color) and not part.is_planckian for part in scene.world.parts)
    fog = scene.world.medium
    is_spectral = is_spectral or (fog is not None and any(map(_has_spectrum, _values_of_medium(fog))))
    world = ("World",) if is_spectral else ()
    spectral_volumes = tuple(volume.name for volume in scene.volumes if volume.transfer.wavelengths_nm is not None)
    emissive = which(lambda m: any(map(_emits, leaves(m.surface))))
    bodies = tuple(light.name for light in scene.lights if isinstance(light, (AreaLight, SunLight)) or light.radius > 0)
    return Inventory(
        spectra=spectral_lights
        + world
        + which(lambda m: any(map(_has_spectrum, _values(m))) or bool(dyed(m)))
        + spectral_volumes,
        dispersive=which(_is_dispersive),
        fluorescent=which(lambda m: bool(dyed(m))),
        films=which(lambda m: any(getattr(leaf, "thin_film_thickness", 0.0) != 0 for leaf in leaves(m.surface))),
        media=which(lambda m: m.medium is not None) + (("World",) if scene.world.medium is not None else ()),
        scattering=which(lambda m: m.medium is not None and _adds_light(m.medium))
        + (("World",) if scene.world.medium is not None and _adds_light(scene.world.medium) else ()),
        emissive=emissive,
        transparent=which(lambda m: m.name not in borders and is_transparent(m)),
        refractive=which(lambda m: any(_refracts(c) for c in leaves(m.surface))),
        glossy=which(lambda m: any(isinstance(c, (Glossy, Metal, Principled)) for c in leaves(m.surface))),
        strands=which(lambda m: any(isinstance(c, (EllipseHair, Hair, HairLobe)) for c in leaves(m.surface))),
        images=which(lambda m: any(isinstance(p, _IMAGES) for v in _values(m) for p in paint_parts(v))),
        light_bodies=bodies,
        source_count=len(scene.lights) + (not scene.world.is_black) + len(emissive),
        surfaces=len(scene.instances),
        largest_reflectance=max(
            [0.8 if not materials else 0.0, *(largest_sum(m.surface, largest_reflectance) for m in materials)]
        ),
    )


def _adds_light(medium: ScatteringMedium) -> bool:
    return largest_size(medium.color) > 0 or medium.emission_strength * largest_size(medium.emission_color) > 0


def media_borders(scene: Scene) -> frozenset[str]:
    """Names of materials that are only the border of a medium, on objects without other materials.

    Paths through media pass them; without the medium there is no object.
    """
    bare = {material.name for material in scene.materials if material.surface is None and material.medium is not None}
    mixed = {
        name
        for item in scene.instances
        if not bare.issuperset(item.materials)
        for name in bare.intersection(item.materials)
    }
    return frozenset(bare - mixed)


def dyed(material: Material) -> list[Fluorescent]:
    """Fluorescent closures of a material."""
    return [
        leaf
        for leaf in leaves(material.surface)
        if isinstance(leaf, Fluorescent) and any(amount > 0 for amount in leaf.amounts)
    ]


def shown_materials(scene: Scene) -> set[str]:
    """Names of the materials that some face of some object shows to some ray."""
    slots = {mesh.name: _used_slots(mesh) for mesh in scene.meshes}
    shown: set[str] = set()
    for instance in scene.instances:
        if not instance.materials or instance.hidden_from == Rays.ALL:
            continue
        last = len(instance.materials) - 1
        # Blender uses the last slot for an index without one
        shown.update(instance.materials[min(slot, last)] for slot in slots[instance.mesh])
    return shown


def _used_slots(mesh: Mesh) -> tuple[int, ...]:
    """Material slots that the faces of a mesh use."""
    if mesh.material_indices is None:
        return (0,) if len(mesh.triangles) else ()
    return tuple(int(slot) for slot in np.flatnonzero(np.bincount(mesh.material_indices)))


def _values(material: Material) -> Iterator[Any]:
    """Every paint and number of a material."""
    yield from values_of(material.surface)
    if material.medium is not None:
        yield from _values_of_medium(material.medium)


def _values_of_medium(medium: ScatteringMedium) -> Iterator[Any]:
    """Every paint and number of a medium."""
    yield from (getattr(medium, name) for name in type(medium).__slots__)


def _has_spectrum(paint: Any) -> bool:
    return any(isinstance(part, (Spectrum, SpectralImage)) for part in paint_parts(paint))


def _is_dispersive(material: Material) -> bool:
    return any(
        isinstance(c, (Glass, Principled)) and isinstance(c.ior, Spectrum) and _refracts(c)
        for c in leaves(material.surface)
    )


def _refracts(closure: Any) -> bool:
    return isinstance(closure, Glass) or (isinstance(closure, Principled) and closure.transmission != 0)


def _emits(closure: Any) -> bool:
    if isinstance(closure, Emission):
        return closure.strength != 0
    if not isinstance(closure, Principled):
        return False
    dark = isinstance(closure.emission_color, Color) and not np.any(closure.emission_color.linear_rgb)
    return closure.emission_strength != 0 and not dark


def is_transparent(material: Material) -> bool:
    """True if light passes a material straight, all or a part of it."""
    if material.surface is None:
        return True
    return any(
        isinstance(c, (EllipseHair, RayPortal, Transparent)) or (isinstance(c, Principled) and c.alpha != 1.0)
        for c in leaves(material.surface)
    )


def is_sharp(leaf: object) -> bool:
    """True for a closure with a lobe so narrow that it shows other things, as mirrors and clear glass do."""
    if isinstance(leaf, Glass):
        return True
    if isinstance(leaf, (Glossy, Metal, Principled)):
        rough = leaf.roughness if isinstance(leaf.roughness, (int, float)) else 0.0  # a texture may be low anywhere
        coated = isinstance(leaf, Principled) and leaf.coat_weight != 0
        clear = isinstance(leaf, Principled) and leaf.transmission != 0
        return rough < SHARP_ROUGHNESS or coated or clear
    return False


def names(items: tuple[str, ...], most: int = 3) -> str:
    """A few names in quotes, and the number of others."""
    return first_of(map(repr, items), len(items), most)

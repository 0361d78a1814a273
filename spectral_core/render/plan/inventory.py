# SPDX-License-Identifier: GPL-3.0-or-later
"""Inventory of a scene for the plan: a walk over lights, materials and paints, without decisions."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from spectral_core.errors import InvalidInputError
from spectral_core.render.mitsuba_scene.paint import emitted_rgb
from spectral_core.scene import (
    AreaLight,
    Color,
    Computed,
    Diffuse,
    DrawnPattern,
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
    MixedPaint,
    Principled,
    RayPortal,
    Rays,
    ScatteringMedium,
    Scene,
    Sheen,
    SpectralImage,
    Subsurface,
    SunLight,
    Toon,
    Translucent,
    Transparent,
    largest_sum,
    leaves,
    values_of,
)
from spectral_core.scene.paint import some_colors
from spectral_core.scene.surface import Closure
from spectral_core.spectra.spectrum import Spectrum

_IMAGES = (Computed, ImageTexture, SpectralImage)
SHARP_ROUGHNESS = 0.25
"""Roughness below which a lobe is so narrow that paths may miss a lamp in it."""
_DIFFUSE = (Diffuse, Sheen, Subsurface, Toon, Translucent)
"""Closures that reflect or transmit light in many directions; those of mirrors and glass have bounces of their own."""


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

    def diffuse_error(self, bounces: int) -> float:
        """Upper bound of the ΔE2000 of a diffuse scene after so many bounces.

        The light after n bounces is at most ρ^(n+1) / (1 - ρ) of the direct light if every path stays inside; half of
        that is assumed for an ordinary room, and ΔE 1 for about 2.5 % of luminance (CIELAB at mid gray).
        """
        rho = min(self.largest_reflectance, 0.98)
        return 0.0 if rho <= 0 else rho ** (bounces + 1) / (1 - rho) / (2 * 0.025)


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
            [0.8 if not materials else 0.0, *(largest_sum(m.surface, _largest_reflectance) for m in materials)]
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


def paint_parts(paint: Any) -> Iterator[Any]:
    """The components of a mixed paint, or the paint itself."""
    if isinstance(paint, MixedPaint):
        for part in (paint.factor, paint.first, paint.second):
            yield from paint_parts(part)
    else:
        yield paint


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


def _largest_reflectance(closure: Closure) -> float:
    """Largest share of light that a closure scatters in many directions."""
    if isinstance(closure, Fluorescent):
        return 1.0
    return max(map(_share, paint_parts(closure.color))) if isinstance(closure, _DIFFUSE) else 0.0


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


def largest_size(paint: Any) -> float:
    """Largest magnitude of a paint in any channel or at any wavelength; at least 1 for a program."""
    if isinstance(paint, MixedPaint):
        return max(map(largest_size, paint_parts(paint)))
    if isinstance(paint, Color):
        return float(np.abs(paint.linear_rgb).max())
    if isinstance(paint, Spectrum):
        return float(paint.values.max())
    if isinstance(paint, ImageTexture) and paint.pixels.dtype != np.uint8:
        least = 1.0 if isinstance(paint, DrawnPattern) else 0.0  # its details may be brighter than its pixels
        return float(np.max(np.abs(paint.pixels[..., :3]), initial=least))
    if isinstance(paint, Computed):
        return max(1.0, float(np.abs(paint.typical).max()))
    return 1.0 if isinstance(paint, _IMAGES) else 0.0


def largest_light(paint: Any) -> float:
    """Largest magnitude of the light that a paint of strength 1 emits, in any channel.

    A spectrum is emitted with Y = 1 whatever the unit of its values.
    """
    if isinstance(paint, MixedPaint):
        return max(map(largest_light, paint_parts(paint)))
    return _largest_channel(paint) if isinstance(paint, Spectrum) else largest_size(paint)


@lru_cache(256)
def _largest_channel(light: Spectrum) -> float:
    """The same of a spectrum; many lamps have one in common. 0 for one without luminance, which no renderer takes."""
    try:
        return float(np.abs(emitted_rgb(light)).max())
    except InvalidInputError:
        return 0.0


def _share(paint: Any) -> float:
    if isinstance(paint, ImageTexture):  # an even white one reflects more than most
        return min(max(0.9, float(some_colors(paint.pixels, paint.color_space).max(axis=1).mean())), 1.0)
    varies = isinstance(paint, (Computed, SpectralImage))
    return min(max(0.9, float(np.max(getattr(paint, "typical", 0.9)))) if varies else largest_size(paint), 1.0)

# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender materials to named materials of the scene."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from typing import Any

from spectral_core.scene import (
    Color,
    Computed,
    Diffuse,
    Emission,
    Material,
    MixSurface,
    Principled,
    Surface,
    Transparent,
    gray,
    leaves,
    mesh_inputs_of,
)
from spectral_core.scene.leaves import inputs_of, operations_of, weighted_leaves

from ... import compat
from .. import spectra
from ..context import Translation
from ..displacement.nodes import raised_normal
from ..displacement.offset import Displacement
from ..visibility import cycles_settings
from . import media
from .aovs import aov_outputs
from .carried.dispersion import with_dispersion
from .carried.dyes import with_dyes
from .carried.spectrum import covers_texture, has_main_color, with_spectrum
from .reader import Reader
from .surfaces import surface_of
from .tree import Input, input_of, linked, searched_once, surface_output

NO_MATERIAL = Material(
    "No material",
    Diffuse(gray(0.8)) if compat.is_before_5_0() else Principled(gray(0.8)),
    shown_as="default_surface",
)
"""Material of an object without one, as in Cycles, with its name in Cycles' cryptomatte."""


@dataclass(frozen=True)
class TranslatedMaterial:
    """A material, and its inputs from the mesh: ``"uv"``, ``"generated"``, ``"attribute:…"``.

    ``filling``: a volume that differs between objects, each of which gets a medium of its own.
    """

    material: Material
    reads: frozenset[str]
    filling: media.Filling | None = None
    displacement: Displacement | None = None


@cache
def default_volume() -> TranslatedMaterial:
    """Material of a Volume object without one."""
    return TranslatedMaterial(Material("No volume material", None), frozenset(), media.default_filling())


CHANCE_RAYS = frozenset(f"ray:Is {kind} Ray" for kind in ("Diffuse", "Glossy", "Reflection", "Transmission"))
"""Types that a ray has only if it hits the light by chance: rays to a sampled light have none of them."""


def translate_material(translation: Translation, material: Any) -> TranslatedMaterial:
    """Material of a ``bpy.types.Material``; None is the plain default."""
    if material is None:
        return TranslatedMaterial(NO_MATERIAL, frozenset())
    with searched_once():
        return _translate(translation, material)


def _translate(translation: Translation, material: Any) -> TranslatedMaterial:
    name = material.name_full
    reader = Reader(translation, material.name, on_surface=True)
    reader.material_index = int(material.pass_index)
    inlined = compat.inlined(material)
    tree = compat.node_tree(material) if inlined is None else inlined.node_tree
    output = surface_output(tree)
    spectrum = spectra.spectrum_of(translation, material)
    is_volume = output is not None and linked(input_of(output, "Surface")) is None
    filling = None if output is None else media.filling_of(reader, output, spectrum if is_volume else None)
    if filling is not None and cycles_settings(material.original, "volume_interpolation", "LINEAR") == "CUBIC":
        filling = replace(filling, is_cubic=True)
    medium = None if filling is None else media.medium_alike(filling)
    displacement: Displacement | None = None
    surface: Surface | None
    if tree is None:
        surface = Diffuse(Color(translation.linear_rgb(material.diffuse_color)))  # the viewport color
    elif output is None:
        reader.note("the material has no output node; it is black")
        surface = surface_of(reader, None)
    else:
        place = input_of(output, "Surface")
        displacement = _displacement(reader, input_of(output, "Displacement"), material.displacement_method)
        surface = None if filling is not None and linked(place) is None else surface_of(reader, place)
    if any(angle > 0 for _, _, angle, _ in reader.skies.values()):
        reader.note("a sky on a surface has no disk of the sun")
    _note_emission(reader, surface)
    if spectrum is not None and surface is not None:
        if not has_main_color(surface):
            translation.note(
                material.name, "its spectrum colors none of its shaders, which reflect and transmit nothing; give an "
                "Emission node a spectrum of its own",
            )  # fmt: skip
        if covers_texture(surface, spectrum):
            translation.note(
                material.name, "its spectrum replaces the texture on its main color; clear the spectrum to "
                "see the texture",
            )  # fmt: skip
        surface = with_spectrum(surface, spectrum)
    surface = with_dispersion(translation, surface, material)
    if surface is not None:
        # dyes lie below gloss, which takes light from them by its index of refraction
        surface = with_dyes(translation, surface, material, spectrum)
        if not getattr(material, "use_transparent_shadow", True):
            surface = _opaque_in_shadows(reader, surface)
    outputs = aov_outputs(reader, tree)
    made = Material(name, surface, medium, int(material.pass_index), outputs, shown_as=material.name)
    reads = mesh_inputs_of(surface) | inputs_of(value for _, value in outputs)
    if displacement is not None:
        reads |= inputs_of((displacement.offset,))
    return TranslatedMaterial(made, reads, filling, displacement)


def _displacement(reader: Reader, place: Input, method: str) -> Displacement | None:
    """The offset of a displaced surface, unless it bends its normals alone; sets the reader's bent normal."""
    if linked(place) is None:
        return None
    offset = None if method == "BUMP" else Computed(reader.as_value(reader.field(place)).program(3))
    if method != "DISPLACEMENT":
        reader.raised = raised_normal(reader, place, moved=method == "BOTH")
    return None if offset is None else Displacement(offset, bends=method == "DISPLACEMENT")


def _note_emission(reader: Reader, surface: Surface | None) -> None:
    """Note emission that differs between light that a renderer samples and light that a ray hits by chance."""
    for weight, leaf in weighted_leaves(surface):
        values: list[Any] = [value for value, _ in weight.varying]
        if isinstance(leaf, Emission):
            values += [leaf.color, leaf.strength]
        elif isinstance(leaf, Principled) and leaf.emission_strength != 0:
            values += [leaf.emission_color, leaf.emission_strength]
        else:
            continue
        for name in sorted(inputs_of(values) & CHANCE_RAYS):
            reader.note(
                f"its emission depends on {name[4:]!r}, which is 0 where a renderer samples the light; Cycles samples "
                "another share of it, so the brightness differs"
            )
        if "bump" in operations_of(values):
            reader.note(
                "its emission depends on a bumped normal, which Cycles replaces by the smooth one where it samples "
                "the light: in the dark the light differs"
            )


def _opaque_in_shadows(reader: Reader, surface: Surface) -> Surface:
    """A surface that lets no light through on the way to a lamp (Transparent Shadows is off)."""
    if not any(isinstance(leaf, Transparent) or getattr(leaf, "alpha", 1.0) != 1.0 for leaf in leaves(surface)):
        return surface
    return MixSurface(Computed(reader.point("ray:Is Shadow Ray", 1).program(1)), surface, Diffuse(gray(0.0)))

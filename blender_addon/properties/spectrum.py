# SPDX-License-Identifier: GPL-3.0-or-later
"""The spectrum of a material, a light, a world or a shader node: its attribute ``spectral``.

The sampled values themselves are stored, so a .blend does not depend on the catalogue, the file or the palette that
they came from, and they survive save, load, append and undo. They are stored as 32-bit floats, as the renderer reads
them.
"""

from typing import Any

import bpy
from bpy.props import CollectionProperty, EnumProperty, FloatProperty, PointerProperty, StringProperty

from ..compat import path_options
from .fields import Field, by_name
from .hooks import Topic, announces, offers

SOURCES = [
    ("NONE", "None", "No spectrum: the color is used, and upsampled where light is spectral", 0),
    ("CATALOGUE", "Named", "A measured lamp or surface by name", 1),
    ("FILE", "File", "Measured values from a .csv, .spdx or .spd file", 2),
    ("DESIGNED", "Palette", "Values that the palette designed", 3),
]


def tag(spectral: bpy.types.PropertyGroup, _context: Any = None) -> None:
    """Notify Blender, which otherwise does not copy a changed property to the evaluated scene; the palette shows its
    originals.
    """
    if not isinstance(spectral.id_data, bpy.types.Scene):
        spectral.id_data.update_tag()


class SpectralSample(bpy.types.PropertyGroup):
    """One point of a sampled spectrum."""

    wavelength_nm: FloatProperty(
        name="Wavelength", description="Wavelength in nanometers", min=0.0, precision=1, update=tag
    )
    value: FloatProperty(
        name="Value", description="Reflectance from 0 to 1, or relative power", precision=4, update=tag
    )


DYE_FIELDS = by_name(
    Field(
        "excitation_nm", FloatProperty, "excitation_nm", name="Absorbs (nm)", default=405.0, min=300.0, max=760.0,
        precision=0, description="Wavelength around which the dye absorbs light; 365 and 405 nm are black lights",
    ),
    Field(
        "emission_nm", FloatProperty, "emission_nm", name="Emits (nm)", default=530.0, min=320.0, max=800.0,
        precision=0, description="Wavelength around which the dye emits light; longer than the one that it absorbs",
    ),
)  # fmt: skip
"""A dye of a palette's material, and of a material in the scene."""


class SpectralCarriedDye(bpy.types.PropertyGroup):
    """A fluorescent dye in a material."""

    excitation_nm: DYE_FIELDS["excitation_nm"].declared(tag)
    emission_nm: DYE_FIELDS["emission_nm"].declared(tag)
    amount: FloatProperty(
        name="Amount", default=0.3, min=0.0, max=1.0, precision=3, update=tag,
        description="Share of the power absorbed at the first wavelength that is emitted at the second. Reflection and "
        "emission together return at most one photon per photon",
    )  # fmt: skip


DISPERSIONS = [
    ("NONE", "None", "The same index of refraction at all wavelengths: that of the shader", 0),
    ("ABBE", "Abbe Number", "The shader's index of refraction is that of yellow light, an Abbe number spreads it", 1),
    ("NAMED", "Named", "The index of refraction of a glass or another clear material, in place of the shader's", 2),
]
CLEAR_MATERIALS = [
    ("BK7", "Crown Glass (N-BK7)", "Index 1.517, Abbe number 64: windows, simple lenses", 0),
    ("F2", "Flint Glass (F2)", "Index 1.620, Abbe number 36: prisms, cut glass", 1),
    ("SF11", "Dense Flint (N-SF11)", "Index 1.785, Abbe number 26: strong colors", 2),
    ("SILICA", "Fused Silica", "Index 1.458, Abbe number 68: laboratory glass", 3),
    ("WATER", "Water", "Index 1.333, Abbe number 56", 4),
    ("SAPPHIRE", "Sapphire", "Index 1.768, Abbe number 72: ruby and sapphire", 5),
    ("DIAMOND", "Diamond", "Index 2.417, Abbe number 55", 6),
]
"""Identifiers as in ``spectral_core.spectra.refraction.NAMED_INDICES``."""


class SpectralDispersion(bpy.types.PropertyGroup):
    """How the index of refraction of a material's glass varies with wavelength."""

    source: EnumProperty(
        name="Dispersion", items=DISPERSIONS, default="NONE", update=tag,
        description="How the index of refraction varies with wavelength, which parts white light into colors",
    )  # fmt: skip
    abbe_number: FloatProperty(
        name="Abbe Number", default=40.0, min=5.0, max=200.0, soft_min=15.0, soft_max=95.0, precision=1, update=tag,
        description="The smaller, the wider the colors part: crown glass 64, flint glass 36, dense flint 26",
    )  # fmt: skip
    material: EnumProperty(
        name="Material", items=CLEAR_MATERIALS, default="F2", update=tag,
        description="Glass or other clear material with a measured index of refraction",
    )  # fmt: skip


class SpectralSpectrum(bpy.types.PropertyGroup):
    """A spectrum, its source, and its values."""

    source: EnumProperty(
        name="Spectrum", items=SOURCES, default="NONE", description="Where the spectrum comes from",
        update=announces(Topic.SPECTRUM_SOURCE),
    )  # fmt: skip
    catalogue_name: StringProperty(
        name="Name", description="A measured spectrum by name; type to search. A light may be 'blackbody 3200'",
        search=offers(Topic.SPECTRUM_NAMES), search_options={"SORT", "SUGGESTION"},
        update=announces(Topic.SPECTRUM_CHOICE),
    )  # fmt: skip
    filepath: StringProperty(
        name="File", subtype="FILE_PATH", description="A .csv, .spdx or .spd file with measured values",
        options=path_options(), update=announces(Topic.SPECTRUM_CHOICE),
    )  # fmt: skip
    file_entry: StringProperty(
        name="Entry", description="Spectrum of the file, if it has several",
        search=offers(Topic.SPECTRUM_ENTRIES), update=announces(Topic.SPECTRUM_CHOICE),
    )  # fmt: skip
    kind: EnumProperty(
        default="OWNER", description="Type of the values", update=tag,
        items=[
            ("OWNER", "By Owner", "The type that its owner needs", 0),
            ("ILLUMINANT", "Illuminant", "Relative power per nm", 1),
            ("REFLECTANCE", "Reflectance", "Share of light from 0 to 1", 2),
        ],
    )  # fmt: skip
    strength: FloatProperty(
        name="Relative Strength", default=1.0, min=0.0, soft_max=4.0, update=tag,
        description="Brightness relative to a white light of the same power",
    )  # fmt: skip
    spectrum_name: StringProperty(name="Spectrum Name", update=tag, description="Name of the stored spectrum")
    origin: StringProperty(name="Origin", update=tag, description="Source of the stored values")
    interpolation: EnumProperty(
        name="Interpolation", default="LINEAR", update=tag,
        description="How values are interpolated between their wavelengths",
        items=[
            ("LINEAR", "Linear", "Straight lines between the values, as the renderer reads them", 0),
            ("SAMPLED", "Sampled", "Each value is constant over its cell", 1),
        ],
    )  # fmt: skip
    samples: CollectionProperty(type=SpectralSample, name="Values")
    dyes: CollectionProperty(type=SpectralCarriedDye, name="Dyes")
    dispersion: PointerProperty(type=SpectralDispersion, name="Dispersion")
    message: StringProperty(name="Message", description="Error of the choice; empty if none")


CLASSES = (SpectralSample, SpectralCarriedDye, SpectralDispersion, SpectralSpectrum)
CARRIERS = ("Material", "Light", "World", "ShaderNode")


def register() -> None:
    """Add ``spectral`` to materials, lights, worlds and shader nodes."""
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    for carrier in CARRIERS:
        getattr(bpy.types, carrier).spectral = PointerProperty(type=SpectralSpectrum, name="Spectrum")


def unregister() -> None:
    """Remove the attribute; stored data stay in the file until it is saved without the extension."""
    for carrier in reversed(CARRIERS):
        delattr(getattr(bpy.types, carrier), "spectral")
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)

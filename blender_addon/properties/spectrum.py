# SPDX-License-Identifier: GPL-3.0-or-later
"""The spectrum that a material, a light, a world or a shader node carries: its attribute ``spectral``.

The sampled values themselves are stored, so a .blend stays whole without the catalogue, the file or the palette that
they came from, and survive save, load, append and undo. Stored as 32-bit floats, which is what a renderer reads.
"""

from collections.abc import Iterator
from contextlib import contextmanager

import bpy
import numpy as np
from bpy.props import CollectionProperty, EnumProperty, FloatProperty, PointerProperty, StringProperty

from spectral_core.errors import InvalidInputError, SpectralError
from spectral_core.spectra.spectrum import SpectralGrid, Spectrum

from . import catalogue, live

SOURCES = [
    ("NONE", "None", "No spectrum: the color is used, and upsampled where light is spectral", 0),
    ("CATALOGUE", "Named", "A measured lamp or surface by name", 1),
    ("FILE", "File", "Measured values from a .csv, .spdx or .spd file", 2),
    ("DESIGNED", "Palette", "Values that the palette designed", 3),
]
OWNERS = (bpy.types.Material, bpy.types.Light, bpy.types.World)
EMITTING_NODES = ("ShaderNodeEmission", "ShaderNodeBackground", "ShaderNodeBlackbody")


def owner_of(spectral):
    """The material, light, world, node or palette entry whose ``spectral`` this is."""
    if isinstance(spectral.id_data, bpy.types.NodeTree):  # Blender gives no path to what a node carries
        return next(node for node in spectral.id_data.nodes if getattr(node, "spectral", None) == spectral)
    holder, _, _ = spectral.path_from_id().rpartition(".")
    return spectral.id_data.path_resolve(holder) if holder else spectral.id_data


def kind_of(owner) -> str:
    """``"illuminant"`` for what emits, ``"reflectance"`` for what reflects or lets through."""
    declared = getattr(type(owner), "SPECTRUM_KIND", None)
    if declared:
        return declared
    emits = isinstance(owner, (bpy.types.Light, bpy.types.World)) or (
        isinstance(owner, bpy.types.Node) and owner.bl_idname in EMITTING_NODES
    )
    return "illuminant" if emits else "reflectance"


def kind_in(spectral) -> str:
    """kind_of() of the owner, without asking Blender for the path to it, which takes milliseconds on a scene."""
    if spectral.kind != "OWNER":
        return spectral.kind.lower()
    block = spectral.id_data
    return kind_of(block if isinstance(block, OWNERS) else owner_of(spectral))


def spectrum_of(owner, attribute: str = "spectral") -> Spectrum | None:
    """The Illuminant or Reflectance that ``owner`` carries, None where its color is meant.

    ``owner``: a Material, Light, World or shader node, original or evaluated. On a material it stands for the main
    color of the surface, on a node for that node's color; the node's comes before the material's. An illuminant is
    relative: ``strength_of(owner)`` tells how bright. ``attribute``: where it is stored.
    Raises InvalidInputError where a spectrum is asked for and none could be read; the message is fit to be shown.
    """
    spectral = getattr(owner, attribute, None)
    if spectral is None or spectral.source == "NONE":
        return None
    if not len(spectral.samples):
        raise InvalidInputError(f"the spectrum of {owner.name!r} is empty: {spectral.message or 'nothing is chosen'}")
    return _stored(spectral, kind_in(spectral), owner.name)


def strength_of(owner) -> float:
    """What the power of ``owner`` is multiplied by, once its spectrum is normalized to the luminance of white.

    1 but for designed lights: a design may ask for one light that is brighter than another.
    """
    spectral = getattr(owner, "spectral", None)
    return 1.0 if spectral is None or spectral.source == "NONE" else spectral.strength


def stored_samples(spectral) -> tuple[np.ndarray, np.ndarray]:
    """Wavelengths (n,) in nm and values (n,) as they are stored; both empty where nothing is."""
    columns = np.empty((2, len(spectral.samples)), dtype=np.float32)
    spectral.samples.foreach_get("wavelength_nm", columns[0])
    spectral.samples.foreach_get("value", columns[1])
    wavelengths, values = columns.astype(np.float64)
    return wavelengths, values


def _stored(spectral, kind: str, fallback_name: str) -> Spectrum:
    wavelengths, values = stored_samples(spectral)
    grid = SpectralGrid(wavelengths, spectral.interpolation.lower())
    return catalogue.KINDS[kind](spectral.spectrum_name or fallback_name, grid, values, source=spectral.origin)


def store_spectrum(
    spectral, spectrum: Spectrum, source: str = "DESIGNED", *, strength: float = 1.0, physical: bool = True
) -> None:
    """Keep ``spectrum`` in the .blend. ``source``: one of SOURCES.

    Raises InvalidInputError where it is not what its owner can have, a reflectance in [0, 1] or a light of no negative
    power, unless ``physical`` is False: then it is kept to be drawn, and reading it with spectrum_of() raises.
    """
    expected = catalogue.KINDS[kind_in(spectral)]
    if physical and type(spectrum) is not expected:
        spectrum = expected(spectrum.name, spectrum.grid, spectrum.values, source=spectrum.source)
    _write_samples(spectral, spectrum)
    with quiet():
        spectral.source = source
    spectral.strength = strength
    spectral.message = ""


def _write_samples(spectral, spectrum: Spectrum) -> None:
    if len(spectral.samples) != spectrum.grid.size:
        spectral.samples.clear()
        for _ in range(spectrum.grid.size):
            spectral.samples.add()
    spectral.samples.foreach_set("wavelength_nm", spectrum.grid.wavelengths_nm.astype(np.float32))
    spectral.samples.foreach_set("value", spectrum.values.astype(np.float32))
    spectral.interpolation = spectrum.grid.interpolation.upper()
    spectral.spectrum_name = spectrum.name
    spectral.origin = spectrum.source
    _tag(spectral)


_quiet = False


@contextmanager
def quiet() -> Iterator[None]:
    """Within it a change of a choice does not read its source again."""
    global _quiet
    before, _quiet = _quiet, True
    try:
        yield
    finally:
        _quiet = before


def _tag(spectral, _context=None) -> None:
    """Blender copies a changed property to the evaluated scene only when told; the palette shows its originals."""
    if not isinstance(spectral.id_data, bpy.types.Scene):
        spectral.id_data.update_tag()


def reload(spectral) -> None:
    """Read the spectrum from its catalogue or file again; on failure the values stay and ``message`` says why."""
    try:
        spectrum = _read(spectral, kind_in(spectral))
    except SpectralError as error:
        spectral.message = str(error)
        return
    if spectrum is not None:
        _write_samples(spectral, spectrum)
        spectral.strength = 1.0
    spectral.message = ""


def _read(spectral, kind: str) -> Spectrum | None:
    if spectral.source == "CATALOGUE":
        return catalogue.named(kind, spectral.catalogue_name)
    if spectral.source == "FILE":
        path = bpy.path.abspath(spectral.filepath, library=spectral.id_data.library)
        return catalogue.from_file(kind, path, spectral.file_entry)[0]
    if spectral.source == "DESIGNED" and not len(spectral.samples):
        raise InvalidInputError("nothing is designed yet; take a spectrum from the palette, or apply the palette")
    return None


def _source_changed(spectral, _context) -> None:
    """Another source: what was stored before belongs to the old one."""
    if _quiet:
        return
    if spectral.source in ("CATALOGUE", "FILE"):
        spectral.samples.clear()
    reload(spectral)
    _tell_palette(spectral)


def _choice_changed(spectral, _context) -> None:
    if not _quiet:
        reload(spectral)
        if spectral.message:
            spectral.samples.clear()  # those of the choice before would pass for this one
        _tell_palette(spectral)


def _tell_palette(spectral) -> None:
    """Another lamp or surface in the palette's table is a reason to solve it again."""
    if isinstance(spectral.id_data, bpy.types.Scene):
        live.edited(spectral)


def _catalogue_search(spectral, _context, typed: str) -> list[str]:
    return [name for name in catalogue.names(kind_in(spectral)) if typed.lower() in name.lower()]


def _entry_search(spectral, _context, typed: str) -> list[str]:
    try:
        from spectral_core.spectra.files import read_spectra

        path = bpy.path.abspath(spectral.filepath, library=spectral.id_data.library)
        known = [spectrum.name for spectrum in read_spectra(path, kind=kind_in(spectral))]
    except (SpectralError, OSError):
        return []  # the message of the property says what is wrong with the file
    return [name for name in known if typed.lower() in name.lower()]


class SpectralSample(bpy.types.PropertyGroup):
    """One point of a sampled spectrum."""

    wavelength_nm: FloatProperty(name="Wavelength", description="Wavelength in nanometres", min=0.0, precision=1)
    value: FloatProperty(name="Value", description="Reflectance from 0 to 1, or relative power", precision=4)


class SpectralSpectrum(bpy.types.PropertyGroup):
    """A spectrum, where it came from, and its values."""

    source: EnumProperty(
        name="Spectrum", items=SOURCES, default="NONE", description="Where the spectrum comes from",
        update=_source_changed,
    )  # fmt: skip
    catalogue_name: StringProperty(
        name="Name", description="A measured spectrum by name; type to search. A light may be 'blackbody 3200'",
        search=_catalogue_search, search_options={"SORT", "SUGGESTION"}, update=_choice_changed,
    )  # fmt: skip
    filepath: StringProperty(
        name="File", subtype="FILE_PATH", description="A .csv, .spdx or .spd file with measured values",
        update=_choice_changed,
    )  # fmt: skip
    file_entry: StringProperty(
        name="Entry", description="Which spectrum of the file, where it holds several", search=_entry_search,
        update=_choice_changed,
    )  # fmt: skip
    kind: EnumProperty(
        default="OWNER", description="What the values are",
        items=[
            ("OWNER", "By Owner", "What its owner can have", 0),
            ("ILLUMINANT", "Illuminant", "Relative power per nm", 1),
            ("REFLECTANCE", "Reflectance", "Share of light from 0 to 1", 2),
        ],
    )  # fmt: skip
    strength: FloatProperty(
        name="Relative Strength", default=1.0, min=0.0, soft_max=4.0, update=_tag,
        description="How bright a light of this spectrum is beside a white light of the same power",
    )  # fmt: skip
    spectrum_name: StringProperty(name="Spectrum Name", description="Name of the stored spectrum")
    origin: StringProperty(name="Origin", description="Where the stored values came from")
    interpolation: EnumProperty(
        name="Interpolation", default="LINEAR", description="What the values mean between their wavelengths",
        items=[
            ("LINEAR", "Linear", "Straight lines between the values, as the renderer reads them", 0),
            ("SAMPLED", "Sampled", "Each value stands for its own cell", 1),
        ],
    )  # fmt: skip
    samples: CollectionProperty(type=SpectralSample, name="Values")
    message: StringProperty(name="Message", description="What is wrong with the choice; empty where nothing is")


CLASSES = (SpectralSample, SpectralSpectrum)
CARRIERS = ("Material", "Light", "World", "ShaderNode")


def register() -> None:
    """Add ``spectral`` to materials, lights, worlds and shader nodes."""
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    for carrier in CARRIERS:
        getattr(bpy.types, carrier).spectral = PointerProperty(type=SpectralSpectrum, name="Spectrum")


def unregister() -> None:
    """Take it away again; what was stored stays in the file until it is saved without the extension."""
    for carrier in reversed(CARRIERS):
        delattr(getattr(bpy.types, carrier), "spectral")
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)

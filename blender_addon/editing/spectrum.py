# SPDX-License-Identifier: GPL-3.0-or-later
"""A spectrum follows the choice of its source: it is read at once from the catalogue or from a file."""

import bpy
from bpy.types import PropertyGroup

from spectral_core.errors import InvalidInputError, SpectralError
from spectral_core.spectra.spectrum import Spectrum

from ..properties import hooks
from ..properties.hooks import Topic
from ..translate.spectra import catalogue
from ..translate.spectra.stored import kind_in, write_samples


def reload(spectral: PropertyGroup) -> None:
    """Read the spectrum from its catalogue or file again; on failure the values stay and ``message`` gives the
    reason.
    """
    try:
        spectrum = _read(spectral, kind_in(spectral))
    except SpectralError as error:
        spectral.message = str(error)
        return
    if spectrum is not None:
        write_samples(spectral, spectrum)
        spectral.strength = 1.0
    spectral.message = ""


def _read(spectral: PropertyGroup, kind: str) -> Spectrum | None:
    if spectral.source == "CATALOGUE":
        return catalogue.named(kind, spectral.catalogue_name)
    if spectral.source == "FILE":
        path = bpy.path.abspath(spectral.filepath, library=spectral.id_data.library)
        return catalogue.from_file(kind, path, spectral.file_entry)[0]
    if spectral.source == "DESIGNED" and not len(spectral.samples):
        raise InvalidInputError("nothing is designed yet; take a spectrum from the palette, or apply the palette")
    return None


def _source_changed(spectral: bpy.types.PropertyGroup) -> None:
    """Clear the stored spectrum when another source is chosen."""
    if spectral.source in ("CATALOGUE", "FILE"):
        spectral.samples.clear()
    reload(spectral)
    _tell_palette(spectral)


def _choice_changed(spectral: bpy.types.PropertyGroup) -> None:
    reload(spectral)
    if spectral.message:
        spectral.samples.clear()  # the values of the previous choice would look like those of this one
    _tell_palette(spectral)


def _tell_palette(spectral: bpy.types.PropertyGroup) -> None:
    """A new lamp or surface in the palette's table requires a new solution."""
    if isinstance(spectral.id_data, bpy.types.Scene):
        hooks.announce(Topic.PALETTE, spectral)


def _names(spectral: bpy.types.PropertyGroup) -> list[str]:
    declared = getattr(type(spectral), "SPECTRUM_KIND", None)  # of a recipe, which stores only a name
    return catalogue.names(declared or kind_in(spectral))


def _entries(spectral: bpy.types.PropertyGroup) -> list[str]:
    """Names of the spectra in the chosen file."""
    try:
        from spectral_core.spectra.files import read_spectra

        path = bpy.path.abspath(spectral.filepath, library=spectral.id_data.library)
        return [spectrum.name for spectrum in read_spectra(path, kind=catalogue.READ_AS[kind_in(spectral)])]
    except (SpectralError, OSError):
        return []  # the property's message reports what is wrong with the file


LISTENERS = {
    Topic.SPECTRUM_SOURCE: _source_changed,
    Topic.SPECTRUM_CHOICE: _choice_changed,
    Topic.SPECTRUM_NAMES: _names,
    Topic.SPECTRUM_ENTRIES: _entries,
    Topic.LAMP_NAMES: lambda _bulb: catalogue.names("illuminant"),
}


def register() -> None:
    """Start listening to choices of sources."""
    for topic, listener in LISTENERS.items():
        hooks.listen(topic, listener)


def unregister() -> None:
    """Stop listening."""
    hooks.ignore(*LISTENERS)

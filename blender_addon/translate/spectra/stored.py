# SPDX-License-Identifier: GPL-3.0-or-later
"""Spectra in properties, and as objects of the core."""

import bpy
import numpy as np
from bpy.types import ID, Node, PropertyGroup

from spectral_core.errors import InvalidInputError
from spectral_core.spectra.spectrum import Illuminant, SpectralGrid, Spectrum

from ... import compat
from ...properties import hooks
from ...properties.spectrum import tag
from . import catalogue

OWNERS = (bpy.types.Material, bpy.types.Light, bpy.types.World)
SMALLEST_VALUE, LARGEST_VALUE = 1e-25, 1e30
"""Range of the largest value of a stored light; beyond, single precision loses its digits."""
EMITTING_NODES = ("ShaderNodeEmission", "ShaderNodeBackground", "ShaderNodeBlackbody")


def owner_of(spectral: PropertyGroup) -> ID | Node | PropertyGroup:
    """The material, light, world, node or palette entry with this ``spectral``."""
    if isinstance(spectral.id_data, bpy.types.NodeTree):  # Blender has no path to the properties of a node
        return next(node for node in spectral.id_data.nodes if getattr(node, "spectral", None) == spectral)
    holder, _, _ = spectral.path_from_id().rpartition(".")
    return spectral.id_data.path_resolve(holder) if holder else spectral.id_data


def kind_of(owner: ID) -> str:
    """``"illuminant"`` for emitters, ``"reflectance"`` for surfaces, also transmitting ones."""
    declared = getattr(type(owner), "SPECTRUM_KIND", None)
    if declared:
        return declared
    emits = isinstance(owner, (bpy.types.Light, bpy.types.World)) or (
        isinstance(owner, bpy.types.Node) and owner.bl_idname in EMITTING_NODES
    )
    return "illuminant" if emits else "reflectance"


def kind_in(spectral: PropertyGroup) -> str:
    """kind_of() of the owner, without a query for its path, which takes milliseconds on a scene."""
    if spectral.kind != "OWNER":
        return spectral.kind.lower()
    block = spectral.id_data
    return kind_of(block if isinstance(block, OWNERS) else owner_of(spectral))


def spectrum_of(owner: ID, attribute: str = "spectral") -> Spectrum | None:
    """The Illuminant or Reflectance of ``owner``, None if its color is used.

    ``owner``: a Material, Light, World or shader node, original or evaluated. On a material the spectrum replaces the
    main color of the surface, on a node that node's color; the node's has precedence over the material's. An illuminant
    is relative: ``strength_of(owner)`` is its brightness. ``attribute``: its property. Raises InvalidInputError if a
    spectrum is selected but none could be read; the message can be shown to the artist.
    """
    spectral = getattr(owner, attribute, None)
    if spectral is None or spectral.source == "NONE":
        return None
    if not len(spectral.samples):
        raise InvalidInputError(f"the spectrum of {owner.name!r} is empty: {spectral.message or 'nothing is chosen'}")
    return _stored(spectral, kind_in(spectral), owner.name)


def carried_spectrum(owner: ID | Node | PropertyGroup, attribute: str = "spectral") -> Spectrum:
    """The spectrum of ``owner``. Raises InvalidInputError if it has none."""
    spectrum = spectrum_of(owner, attribute)
    if spectrum is None:
        raise InvalidInputError(f"{owner.name!r} has no spectrum yet")
    return spectrum


def strength_of(owner: ID) -> float:
    """Factor on the power of ``owner``, after its spectrum is normalized to the luminance of white.

    1 except for designed lights: a design may require one light to be brighter than another.
    """
    spectral = getattr(owner, "spectral", None)
    return 1.0 if spectral is None or spectral.source == "NONE" else spectral.strength


def stored_samples(spectral: PropertyGroup) -> tuple[np.ndarray, np.ndarray]:
    """Stored wavelengths (n,) in nm and values (n,); both empty if nothing is stored."""
    columns = np.empty((2, len(spectral.samples)), dtype=np.float32)
    spectral.samples.foreach_get("wavelength_nm", columns[0])
    spectral.samples.foreach_get("value", columns[1])
    wavelengths, values = columns.astype(np.float64)
    return wavelengths, values


def _stored(spectral: PropertyGroup, kind: str, fallback_name: str) -> Spectrum:
    wavelengths, values = stored_samples(spectral)
    grid = SpectralGrid(wavelengths, spectral.interpolation.lower())
    return catalogue.KINDS[kind](spectral.spectrum_name or fallback_name, grid, values, source=spectral.origin)


def store_spectrum(
    spectral: PropertyGroup,
    spectrum: Spectrum,
    source: str = "DESIGNED",
    *,
    strength: float = 1.0,
    physical: bool = True,
    is_absolute: bool = False,
) -> None:
    """Store ``spectrum`` in the .blend. ``source``: one of SOURCES. ``is_absolute``: see ``write_samples``.

    Raises InvalidInputError if its owner is linked, or if the owner cannot have the spectrum: only a reflectance in [0,
    1] or a light without negative power. With ``physical`` False it is stored for drawing only, and reading it with
    spectrum_of() raises.
    """
    require_editable(spectral.id_data)
    expected = catalogue.KINDS[kind_in(spectral)]
    if physical and type(spectrum) is not expected:
        spectrum = expected(spectrum.name, spectrum.grid, spectrum.values, source=spectrum.source)
    write_samples(spectral, spectrum, is_absolute=is_absolute)
    with hooks.silenced(hooks.Topic.SPECTRUM_SOURCE):
        spectral.source = source
    spectral.strength = strength
    spectral.message = ""


def require_editable(block: ID) -> None:
    """Raise InvalidInputError for linked data: Blender accepts a change of them, but loses it when the file is
    saved.
    """
    if not compat.is_editable(block):
        source = bpy.path.basename(library_of(block).filepath)
        raise InvalidInputError(
            f"{block.bl_rna.name.lower()} {block.name!r} is linked from {source} and can "
            "store no spectrum here; make it local: in the panel Palette, Mend Table does so"
        )


def library_of(block: ID) -> bpy.types.Library:
    """The file that a linked data-block, or the reference of a library override, comes from."""
    return block.library or block.override_library.reference.library


def write_samples(spectral: PropertyGroup, spectrum: Spectrum, *, is_absolute: bool = False) -> None:
    """Store the values of a spectrum, its name and its source.

    ``is_absolute``: True for a light whose luminance counts, as in a palette's solution. Any other light is relative,
    and one of extreme values is stored in another unit. A reflectance never is: 1 is all light.
    """
    if len(spectral.samples) != spectrum.grid.size:
        spectral.samples.clear()
        for _ in range(spectrum.grid.size):
            spectral.samples.add()
    spectral.samples.foreach_set("wavelength_nm", spectrum.grid.wavelengths_nm.astype(np.float32))
    is_relative = isinstance(spectrum, Illuminant) and not is_absolute
    values = _in_single_precision(spectrum) if is_relative else spectrum.values
    spectral.samples.foreach_set("value", values.astype(np.float32))
    spectral.interpolation = spectrum.grid.interpolation.upper()
    spectral.spectrum_name = spectrum.name
    spectral.origin = spectrum.source
    tag(spectral)


def _in_single_precision(spectrum: Spectrum) -> np.ndarray:
    """Values (n,) that single precision stores with all their digits: a light is relative, and may have any unit."""
    largest = float(np.abs(spectrum.values).max())
    is_out = largest > 0 and not SMALLEST_VALUE <= largest <= LARGEST_VALUE
    return spectrum.values / largest if is_out else spectrum.values

# SPDX-License-Identifier: GPL-3.0-or-later
"""A transfer function in its stated units: over data values or fractions of their range, per world unit or voxel.

``TransferDocument`` keeps the stated units; ``for_volume`` converts it to a transfer function. As a plain document of
strings, numbers, lists and tables it is the content of files and of a .blend.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from spectral_core.checks import require_declared, require_kind
from spectral_core.documents.codecs import SpectrumFiles, decoded_color, decoded_grid, decoded_spectrum, encoded_grid
from spectral_core.documents.schema import Schema
from spectral_core.errors import FileFormatError, InvalidInputError, counted
from spectral_core.spectra.spectrum import SpectralGrid
from spectral_core.volume.field import VOLUME_SOURCES, ScalarVolume
from spectral_core.volume.fill_values import with_width
from spectral_core.volume.transfer import Array, Material, TransferFunction

FORMAT = "spectral-scene transfer function"
VERSION = 1
TRANSFER_SCHEMA = Schema("spectral_core.volume.documents", "transfer.schema.json")
MOST_SAMPLES = 20_000_000
"""Most samples of the spectra of all materials together."""


@dataclass(frozen=True, eq=False)
class TransferDocument:
    """A transfer function with its stated units.

    ``values``: ``"data"``, or ``"fraction"`` of the range from a volume's least to its greatest value, without values
    that mark missing data. ``length``:
    extinction, emission and gradients are per ``"world"`` unit or per ``"voxel"``.
    """

    transfer: TransferFunction
    values: Literal["data", "fraction"] = "data"
    length: Literal["world", "voxel"] = "world"
    title: str = ""

    def __post_init__(self) -> None:
        require_declared(self)

    def for_volume(self, volume: ScalarVolume, value_range: tuple[float, float] | None = None) -> TransferFunction:
        """The function over the volume's data values, per world unit.

        Fractions refer to ``value_range``, by default the volume's: a sequence has one range for all its frames. A
        voxel's length is the cube root of its volume, if voxels are no cubes.
        """
        require_kind("the volume", volume, ScalarVolume, VOLUME_SOURCES)
        low, high = with_width(*(volume.range_without_fill_values if value_range is None else value_range))
        scale, start = (high - low, low) if self.values == "fraction" else (1.0, 0.0)
        per_world = 1 / voxel_length(volume) if self.length == "voxel" else 1.0
        fitted = [_fitted(material, start, scale, per_world) for material in self.transfer.materials]
        return replace(self.transfer, materials=tuple(fitted))


def stated_in_fractions(
    transfer: TransferFunction, volume: ScalarVolume, value_range: tuple[float, float] | None = None
) -> TransferDocument:
    """The inverse of ``for_volume``: fractions of the range, per voxel."""
    low, high = with_width(*(volume.range_without_fill_values if value_range is None else value_range))
    span, voxel = high - low, voxel_length(volume)
    stated = [_fitted(material, -low / span, 1 / span, voxel) for material in transfer.materials]
    return TransferDocument(replace(transfer, materials=tuple(stated)), "fraction", "voxel")


def voxel_length(volume: ScalarVolume) -> float:
    """Edge of the cube with a voxel's volume, world units."""
    return float(abs(np.linalg.det(volume.world_from_index[:3, :3])) ** (1 / 3))


def _fitted(material: Material, start: float, scale: float, per_world: float) -> Material:
    changes: dict[str, Any] = {"values": start + material.values * scale, "extinction": material.extinction * per_world}
    if material.emission is not None:
        changes["emission"] = material.emission * per_world
    if material.gradient_values is not None:
        changes["gradient_values"] = material.gradient_values * scale * per_world
    return replace(material, **changes)


def document_of(stated: TransferDocument) -> dict[str, Any]:
    """As strings, numbers, lists and tables, without entries that have their default."""
    document: dict[str, Any] = {"format": FORMAT, "version": VERSION}
    if stated.title:
        document["title"] = stated.title
    document |= {"values": stated.values, "length": stated.length}
    if stated.transfer.wavelengths_nm is not None:
        document["grid"] = encoded_grid(SpectralGrid(stated.transfer.wavelengths_nm))
    spectral = stated.transfer.wavelengths_nm is not None
    document["materials"] = [_encoded_material(material, spectral) for material in stated.transfer.materials]
    return document


def transfer_of(document: Any, folder: Path) -> TransferDocument:
    """The transfer document of a plain document; spectrum files are searched in ``folder``.

    Raises FileFormatError that names the place in the document.
    """
    TRANSFER_SCHEMA.require_valid(document)
    grid, files = _grid_of(document), SpectrumFiles(folder)
    if grid is not None and grid.size * len(document["materials"]) > MOST_SAMPLES:
        raise FileFormatError(
            f"{counted(len(document['materials']), 'material')} on {grid.size} wavelengths; expected at most "
            f"{MOST_SAMPLES:,} samples"
        )
    materials = []
    for index, table in enumerate(document["materials"]):
        try:
            materials.append(_decoded_material(table, grid, files))
        except InvalidInputError as error:
            raise FileFormatError(f"materials[{index}] ({table['name']}): {error}") from error
    transfer = TransferFunction(tuple(materials), None if grid is None else grid.wavelengths_nm)
    title, values, length = (document.get(k, d) for k, d in (("title", ""), ("values", "data"), ("length", "world")))
    return TransferDocument(transfer, values, length, title)


def _grid_of(document: dict[str, Any]) -> SpectralGrid | None:
    """The grid of a spectral document; ``wavelengths`` is its name in documents of 2026."""
    names = [name for name in ("grid", "wavelengths") if name in document]
    if not names:
        return None
    try:
        if len(names) > 1:
            raise InvalidInputError("it is equal to [grid]; state it once")
        grid = decoded_grid(document[names[0]])
        if grid.interpolation != "linear":
            raise InvalidInputError("colors here are linear between wavelengths; remove interpolation")
    except InvalidInputError as error:
        raise FileFormatError(f"{names[-1]}: {error}") from error
    return grid


def _encoded_material(material: Material, spectral: bool) -> dict[str, Any]:
    table: dict[str, Any] = {"name": material.name, "values": material.values.tolist()}
    emits = material.emission is not None and bool(np.any(material.emission))
    if np.any(material.extinction) or not emits:  # a document states one of them, also of an invisible material
        table["extinction"] = material.extinction.tolist()
    if material.emission is not None and emits:
        table["emission"] = material.emission.tolist()
    table["color"] = {"values": material.color.tolist()} if spectral else material.color.tolist()
    if not material.lit:
        table["lit"] = False
    if material.gradient_values is not None and material.gradient_weights is not None:
        table["gradient"] = {
            "values": material.gradient_values.tolist(),
            "weights": material.gradient_weights.tolist(),
        }
    return table


def _decoded_material(table: dict[str, Any], grid: SpectralGrid | None, files: SpectrumFiles) -> Material:
    if "extinction" not in table and "emission" not in table:
        raise InvalidInputError("it has neither extinction nor emission, so it shows nothing; give one of them")
    gradient = table.get("gradient", {})
    lit = table.get("lit", True)
    return Material(
        table["name"],
        np.array(table["values"], float),
        np.array(table.get("extinction", [0.0] * len(table["values"])), float),
        _decoded_color(table["color"], lit, grid, files),
        np.array(table["emission"], float) if "emission" in table else None,
        lit,
        np.array(gradient["values"], float) if gradient else None,
        np.array(gradient["weights"], float) if gradient else None,
    )


def _decoded_color(given: Any, lit: bool, grid: SpectralGrid | None, files: SpectrumFiles) -> Array:
    """Linear sRGB, or samples on the document's grid: of a reflectance if the material is lit, else of a light."""
    is_spectrum = isinstance(given, dict) or (isinstance(given, str) and not given.startswith("#"))
    if grid is None:
        if is_spectrum:
            raise InvalidInputError("its color is a spectrum, but the document has no [grid]; add one")
        return decoded_color(given)
    if not is_spectrum:
        raise InvalidInputError("its color is no spectrum, but the document has a [grid]; give all of them spectra")
    spectrum = decoded_spectrum(given, "reflectance" if lit else "illuminant", grid, files)
    # A lamp's lines may be narrower than a step: their power counts, not the value at a knot.
    return (spectrum if spectrum.grid.same_as(grid) else spectrum.resampled(grid, average=not lit)).values

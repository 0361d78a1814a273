# SPDX-License-Identifier: GPL-3.0-or-later
"""Columns and rows that begin with a light or a material of the scene."""

import bpy
import numpy as np
from bpy.types import PropertyGroup
from numpy.typing import NDArray

from spectral_core.spectra.color import display_rgb_from_linear
from spectral_core.spectra.spectrum import Spectrum

from ... import compat
from ..shading.tree import MOST_HOPS, Input, Output, input_of, linked, mixed, surface_output
from ..spectra.stored import carried_spectrum, store_spectrum
from . import table


def add_light(palette: PropertyGroup, lamp: bpy.types.Light | None, name: str = "") -> PropertyGroup:
    """A measured column with the spectrum of the light; daylight without a light, or if it has no spectrum.

    Raises InvalidInputError, with the table unchanged, if the light's spectrum cannot be read.
    """
    spectrum = begun_with(lamp)
    column = table.add_light(palette, name or (lamp.name if lamp else "Light"))
    column.light = lamp
    if lamp is not None and lamp.spectral.source == "CATALOGUE":
        column.spectral.catalogue_name = lamp.spectral.catalogue_name
    elif spectrum is not None:
        store_spectrum(column.spectral, spectrum)
    if len(palette.lights) == 1:
        for row in palette.materials:
            if row.material is not None and row.design == "DESIGNED":
                _keep_color(row)
    return column


def add_material(palette: PropertyGroup, material: bpy.types.Material | None, name: str = "") -> PropertyGroup:
    """A row for a material: measured if it has a measured spectrum, else designed to keep its color under the first
    light. Without a material, a row without a request.

    Raises InvalidInputError, with the table unchanged, if the material's measured spectrum cannot be read.
    """
    spectrum = begun_with(material)
    row = table.add_material(palette, name or (material.name if material else "Material"))
    row.material = material
    if spectrum is not None:
        row.design = "MEASURED"
        store_spectrum(row.spectral, spectrum)
    elif material is not None:
        _keep_color(row)
    return row


def begun_with(block: bpy.types.Light | bpy.types.Material | None) -> Spectrum | None:
    """The measured spectrum that a column or row for a light or material begins with, None without one.

    Raises InvalidInputError if it cannot be read.
    """
    known = ("CATALOGUE", "FILE", "DESIGNED") if isinstance(block, bpy.types.Light) else ("CATALOGUE", "FILE")
    return carried_spectrum(block) if block is not None and block.spectral.source in known else None


def _keep_color(row: PropertyGroup) -> None:
    """Let a designed material keep its present color under the first light, once there is a light."""
    if row.cells:
        row.cells[0].mode = "FIXED"
        row.cells[0].target = display_rgb_from_linear(_main_color(row.material))


def _main_color(material: bpy.types.Material) -> NDArray[np.float64]:
    """Linear sRGB of the main color of a material's surface; of its viewport color without one.

    Of mixed shaders the first one with a color counts, and of a color with a texture the socket's own value.
    """
    found = _surface_color(material)
    color = np.array(material.diffuse_color[:3] if found is None else found)
    return compat.rec709_from_working(compat.working_space(bpy.data)) @ color


def _surface_color(material: bpy.types.Material) -> tuple[float, ...] | None:
    """The color of the first surface shader that the output node shows, in the working space; None without one."""
    inlined = compat.inlined(material)  # it has the output nodes of groups, and exists while it is named here
    output = surface_output(compat.node_tree(material) if inlined is None else inlined.node_tree)
    waiting = [] if output is None else [linked(input_of(output, "Surface"))]
    for _ in range(MOST_HOPS):
        if not waiting:
            break
        shader = waiting.pop(0)
        if shader is None:
            continue
        for name in ("Base Color", "Color"):
            socket = shader.input(name)
            if shader.node.type.startswith("BSDF") and socket is not None and socket.socket.type == "RGBA":
                return _constant(socket)
        waiting += [linked(Input(each, shader.groups)) for each in mixed(shader.node) if each.type == "SHADER"]
    return None


def _constant(place: Input) -> tuple[float, ...]:
    source = place.source()
    is_plain = isinstance(source, Output) and source.node.type == "RGB"
    value = source.socket.default_value if is_plain or isinstance(source, Input) else place.default
    return tuple(value[:3])

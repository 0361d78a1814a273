# SPDX-License-Identifier: GPL-3.0-or-later
"""Columns and rows that begin with a light or a material of the scene."""

import bpy
from bpy.types import PropertyGroup

from spectral_core.spectra.color import display_rgb_from_linear

from ..spectra.stored import carried_spectrum, store_spectrum
from . import table


def add_light(palette: PropertyGroup, lamp: bpy.types.Light | None, name: str = "") -> PropertyGroup:
    """A measured column with the spectrum of the light; daylight without a light, or if it has no spectrum."""
    column = table.add_light(palette, name or (lamp.name if lamp else "Light"))
    column.light = lamp
    if lamp is not None and lamp.spectral.source == "CATALOGUE":
        column.spectral.catalogue_name = lamp.spectral.catalogue_name
    elif lamp is not None and lamp.spectral.source != "NONE":
        store_spectrum(column.spectral, carried_spectrum(lamp))
    if len(palette.lights) == 1:
        for row in palette.materials:
            if row.material is not None and row.design == "DESIGNED":
                _keep_color(row)
    return column


def add_material(palette: PropertyGroup, material: bpy.types.Material | None, name: str = "") -> PropertyGroup:
    """A row for a material: measured if it has a measured spectrum, else designed to keep its color under the first
    light. Without a material, a row without a request.
    """
    row = table.add_material(palette, name or (material.name if material else "Material"))
    row.material = material
    if material is not None and material.spectral.source in ("CATALOGUE", "FILE"):
        row.design = "MEASURED"
        store_spectrum(row.spectral, carried_spectrum(material))
    elif material is not None:
        _keep_color(row)
    return row


def _keep_color(row: PropertyGroup) -> None:
    """Let a designed material keep its present color under the first light, once there is a light."""
    if row.cells:
        row.cells[0].mode = "FIXED"
        row.cells[0].target = display_rgb_from_linear(_main_color(row.material))


def _main_color(material: bpy.types.Material) -> tuple[float, float, float]:
    """Linear RGB of the first color socket of a material's surface; of its viewport color without one."""
    tree = material.node_tree
    for node in tree.nodes if tree is not None else ():
        for name in ("Base Color", "Color"):
            socket = node.inputs.get(name)
            if node.type.startswith("BSDF") and socket is not None and socket.type == "RGBA":
                return tuple(socket.default_value[:3])
    return tuple(material.diffuse_color[:3])

# SPDX-License-Identifier: GPL-3.0-or-later
"""Solved spectra of the palette, applied to materials, lights and worlds of the scene."""

import math
from collections.abc import Iterator

import bpy
import numpy as np
from bpy.types import ID, NodeSocket, PropertyGroup, Scene

from spectral_core.spectra.catalogue import illuminant
from spectral_core.spectra.color import linear_rgb_from_xyz
from spectral_core.spectra.observer import linear_rgb_from_product, normalized, xyz_of
from spectral_core.spectra.spectrum import Spectrum

from ... import compat
from ..spectra.stored import carried_spectrum, kind_of, store_spectrum

DIFFUSE = {"BSDF_PRINCIPLED": "Base Color", "BSDF_DIFFUSE": "Color"}
OTHER = dict.fromkeys(
    ("BSDF_GLOSSY", "BSDF_METALLIC", "BSDF_GLASS", "BSDF_TRANSLUCENT", "BSDF_TOON", "BSDF_TRANSPARENT"), "Color"
) | {"BSDF_METALLIC": "Base Color"}
"""Inputs that the spectrum of a material replaces, by type of node: the second if a tree has none of the first."""


def level_of(palette: PropertyGroup) -> float:
    """Ratio of the brightness of the palette's lights to lights of luminance 1."""
    return float(palette.brightness * palette.light_scale)


def store_result(target: ID, entry: PropertyGroup, *, level: float | None = None) -> None:
    """Give ``target`` the solved spectrum of a row or column; a light also its brightness relative to the other lights.

    Parameters
    ----------
    target
        A material, light or world, or a node with a spectrum.
    entry
        Row or column of the palette.
    level
        Brightness that is left to the camera's exposure instead of the lights; by default the palette's light level.

    Raises
    ------
    InvalidInputError
        Where the palette is not solved, or ``target`` is linked from another file.
    """
    spectrum, strength = designed(entry, level_of(entry.id_data.spectral.palette) if level is None else level)
    store_spectrum(target.spectral, spectrum, strength=strength)
    target.spectral.dyes.clear()
    for each in getattr(entry, "dyes", ()):
        carried = target.spectral.dyes.add()
        for name in ("excitation_nm", "emission_nm", "amount"):
            setattr(carried, name, getattr(each, name))


def designed(entry: PropertyGroup, level: float) -> tuple[Spectrum, float]:
    """Solved spectrum of a row or column, and the factor on the power of a light with it.

    ``level``: brightness that the camera's exposure contributes. Raises InvalidInputError if nothing is solved.
    """
    spectrum = carried_spectrum(entry, "result")
    return spectrum, float(xyz_of(spectrum)[1]) / level if kind_of(entry) == "illuminant" else 1.0


def store_colors(target: ID) -> None:
    """Give a material or light the color of its spectrum, which Solid mode and EEVEE show.

    A material gets its color under D65; a light that of its own light, at the luminance of white, without a color
    temperature beside it. Linked inputs and worlds stay unchanged. A color outside of sRGB is replaced by the nearest
    without negative channels.
    """
    if not isinstance(target, (bpy.types.Light, bpy.types.Material)):
        return
    spectrum = carried_spectrum(target)
    if isinstance(target, bpy.types.Light):
        xyz = xyz_of(spectrum)
        rgb = linear_rgb_from_xyz(xyz / xyz[1] if xyz[1] > 0 else xyz)
    else:
        rgb = linear_rgb_from_product(normalized(illuminant("D65")), spectrum.grid) @ spectrum.values
    matrix = compat.rec709_from_working(compat.working_space(bpy.data))
    color = np.maximum(np.linalg.solve(matrix, rgb), 0.0)
    if isinstance(target, bpy.types.Light):
        target.color = color
        compat.switch_temperature_off(target)  # it would tint the color
        return
    painted = (*np.minimum(color, 1.0), 1.0)
    target.diffuse_color = painted
    for socket in _main_colors(target):
        if not socket.is_linked:
            socket.default_value = painted


def _main_colors(material: bpy.types.Material) -> Iterator[NodeSocket]:
    tree = compat.node_tree(material)
    nodes = () if tree is None else tree.nodes
    names = DIFFUSE if any(node.type in DIFFUSE for node in nodes) else OTHER
    for node in nodes:
        socket = node.inputs.get(names.get(node.type, ""))
        if socket is not None:
            yield socket


def expose(scene: Scene, level: float) -> None:
    """Set the view's exposure for the palette's colors; the change of an earlier call is removed first."""
    palette, view = scene.spectral.palette, scene.view_settings
    own = view.exposure - palette.applied_exposure
    view.exposure = own + math.log2(level)
    palette.applied_exposure = view.exposure - own  # Blender limits the exposure

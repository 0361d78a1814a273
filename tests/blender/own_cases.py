# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of this extension that a render reads, each in a scene in which it matters."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy
import numpy as np

from blender_addon.translate.spectra.stored import store_spectrum
from spectral_core.palette.texture.file import write_texture
from spectral_core.palette.texture.reach import TEXTURE_GRID
from spectral_core.palette.texture.texture import SpectralTexture
from spectral_core.spectra.catalogue import illuminant, reflectance
from tests.blender.rendered_cases import Case, _of


def scene_of(build: Any, _: Path) -> Any:
    """The extension's settings of a scene with a lamp, in a light group, and a plane."""
    build.plane(material=build.material())
    lamp = build.light("POINT")
    bpy.context.view_layer.lightgroups.add().name = "Group"
    bpy.context.view_layer.lightgroups.add().name = "Rest"
    lamp.lightgroup = "Group"
    spectral = bpy.context.scene.spectral
    for name in ("First", "Second"):
        column = spectral.palette.lights.add()
        column.name = name
        store_spectrum(column.spectral, illuminant("HP1" if name == "First" else "FL2"))
    spectral.palette.lights["Second"].light = lamp.data
    return spectral


def chosen(build: Any, folder: Path) -> Any:
    """A choice of the artist instead of the plan's."""
    entry = scene_of(build, folder).render.overrides.add()
    entry.name, entry.value = "bounces", "3"
    return entry


def painted(build: Any, _: Path) -> Any:
    """The spectrum of a material."""
    material = build.material()
    build.plane(material=material)
    store_spectrum(material.spectral, reflectance("red"))
    return material.spectral


def lamp(build: Any, folder: Path) -> Any:
    """The spectrum of a lamp."""
    scene_of(build, folder)
    data = bpy.data.lights[0]
    store_spectrum(data.spectral, illuminant("HP1"))
    return data.spectral


def glowing_node(build: Any, _: Path) -> Any:
    """The spectrum of a node."""
    material = build.material(shader="ShaderNodeEmission")
    build.plane(material=material)
    node = material.node_tree.nodes["shader"]
    store_spectrum(node.spectral, illuminant("HP1"))
    return node.spectral


def dyed(build: Any, folder: Path) -> Any:
    """A dye in a material."""
    spectral = painted(build, folder)
    return spectral.dyes.add()


def textured(build: Any, folder: Path) -> Any:
    """A spectral texture from a file."""
    band = np.clip((TEXTURE_GRID.wavelengths_nm - 520) / 60, 0, 1)
    for number, name in enumerate(("first.exr", "second.exr")):
        weights = np.linspace(0, 0.5 + number / 2, 2 * 5 * 4).reshape(2, 5, 4).astype(np.float16)
        write_texture(folder / name, SpectralTexture(weights, np.stack([band, 1 - band]), (illuminant("D65"),)))
    material = build.material()
    node = material.node_tree.nodes.new("SpectralSceneTexture")
    material.node_tree.links.new(node.outputs[0], material.node_tree.nodes["shader"].inputs["Color"])
    build.plane(material=material)
    node.filepath = str(folder / "first.exr")
    return node


CASES = {
    "render": Case("SpectralRender", _of(scene_of, "render"), "goal transport samples seed tolerance denoise",
                   others={"goal": "TIME"}),
    "error": Case("SpectralRender", _of(scene_of, "render"), "target_error", {"goal": "ERROR"}),
    "time": Case("SpectralRender", _of(scene_of, "render"), "time_budget", {"goal": "TIME"}),
    "choice": Case("SpectralPlanChoice", chosen, "name value", others={"name": "wavelengths", "value": "4"}),
    "look": Case("SpectralLook", _of(scene_of, "viewport", "look"), "kind exposure", {"lamp": "HP1"},
                 {"kind": "LAMP"}),
    "lamp of a look": Case("SpectralLook", _of(scene_of, "viewport", "look"), "lamp adapts",
                           {"lamp": "HP1", "kind": "LAMP"}, {"lamp": "FL2"}),
    "group of a look": Case("SpectralLook", _of(scene_of, "viewport", "look"), "group",
                            {"group": "Group", "kind": "GROUP"}, {"group": "Rest"}),
    "column of a look": Case("SpectralLook", _of(scene_of, "viewport", "look"), "column",
                             {"column": "First", "kind": "COLUMN"}, {"column": "Second"}),
    "paint": Case("SpectralSpectrum", painted, "source spectrum_name origin interpolation",
                  others={"source": "NONE"}),
    "lamp": Case("SpectralSpectrum", lamp, "source strength interpolation", others={"source": "NONE"}),
    "node": Case("SpectralSpectrum", glowing_node, "source interpolation", others={"source": "NONE"}),
    "value": Case("SpectralSample", lambda build, folder: painted(build, folder).samples[3], "wavelength_nm value",
                  others={"wavelength_nm": 396.0}),
    "dye": Case("SpectralCarriedDye", dyed, "excitation_nm emission_nm amount"),
    "texture": Case("SpectralTextureNode", textured, "filepath interpolation extension",
                    others={"filepath": "second.exr"}),
}  # fmt: skip

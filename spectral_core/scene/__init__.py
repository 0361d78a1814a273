# SPDX-License-Identifier: GPL-3.0-or-later
"""One scene, described once as plain frozen data: Blender fills it, a script may, a sweep sends it elsewhere."""

from spectral_core.scene.camera import Aperture, Camera, Film, Panorama
from spectral_core.scene.fluorescent import Fluorescent
from spectral_core.scene.geometry import Instance, Mesh, VolumeObject
from spectral_core.scene.leaves import (
    Weight,
    leaves,
    map_leaves,
    mesh_inputs_of,
    programs_of,
    values_of,
    weighted_leaves,
)
from spectral_core.scene.lights import (
    AreaLight,
    Falloff,
    Light,
    Photometry,
    PointLight,
    SpotLight,
    SunLight,
    World,
)
from spectral_core.scene.motion import Moment
from spectral_core.scene.paint import Color, ImageTexture, MixedPaint, Paint, Scalar, gray
from spectral_core.scene.passes import Mist, Passes
from spectral_core.scene.rays import UNLIMITED_PATHS, LightPaths, Rays
from spectral_core.scene.scene import Note, RenderSettings, Scene, scene_hash
from spectral_core.scene.shading.program import Computed, Program
from spectral_core.scene.spectral_image import SpectralImage
from spectral_core.scene.surface import (
    IOR,
    LARGEST,
    AddSurface,
    Diffuse,
    Emission,
    Glass,
    Glossy,
    Material,
    Metal,
    MixSurface,
    Principled,
    ScatteringMedium,
    Subsurface,
    Surface,
    Toon,
    Translucent,
    Transparent,
)

__all__ = [
    "IOR",
    "LARGEST",
    "UNLIMITED_PATHS",
    "AddSurface",
    "Aperture",
    "AreaLight",
    "Camera",
    "Color",
    "Computed",
    "Diffuse",
    "Emission",
    "Falloff",
    "Film",
    "Fluorescent",
    "Glass",
    "Glossy",
    "ImageTexture",
    "Instance",
    "Light",
    "LightPaths",
    "Material",
    "Mesh",
    "Metal",
    "Mist",
    "MixSurface",
    "MixedPaint",
    "Moment",
    "Note",
    "Paint",
    "Panorama",
    "Passes",
    "Photometry",
    "PointLight",
    "Principled",
    "Program",
    "Rays",
    "RenderSettings",
    "Scalar",
    "ScatteringMedium",
    "Scene",
    "SpectralImage",
    "SpotLight",
    "Subsurface",
    "SunLight",
    "Surface",
    "Toon",
    "Translucent",
    "Transparent",
    "VolumeObject",
    "Weight",
    "World",
    "gray",
    "leaves",
    "map_leaves",
    "mesh_inputs_of",
    "programs_of",
    "scene_hash",
    "values_of",
    "weighted_leaves",
]  # fmt: skip

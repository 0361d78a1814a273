# SPDX-License-Identifier: GPL-3.0-or-later
"""One scene, described once as plain frozen data: Blender fills it, a script may, a sweep sends it elsewhere."""

from spectral_core.scene.camera import Camera, Film
from spectral_core.scene.geometry import Instance, Mesh, VolumeObject
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
from spectral_core.scene.paint import Color, ImageTexture, MixedPaint, Paint, Scalar, gray
from spectral_core.scene.rays import UNLIMITED_PATHS, LightPaths, Rays
from spectral_core.scene.scene import Note, RenderSettings, Scene, scene_hash
from spectral_core.scene.spectral_image import SpectralImage
from spectral_core.scene.surface import (
    AddSurface,
    Diffuse,
    Emission,
    Glass,
    Glossy,
    Material,
    MixSurface,
    Principled,
    ScatteringMedium,
    Surface,
    Transparent,
)

__all__ = [
    "UNLIMITED_PATHS", "AddSurface", "AreaLight", "Camera", "Color", "Diffuse", "Emission", "Falloff", "Film",
    "Glass", "Glossy", "ImageTexture", "Instance", "Light", "LightPaths", "Material", "Mesh", "MixSurface",
    "MixedPaint", "Note", "Paint", "Photometry", "PointLight", "Principled", "Rays", "RenderSettings", "Scalar",
    "ScatteringMedium", "Scene", "SpectralImage", "SpotLight", "SunLight", "Surface", "Transparent", "VolumeObject",
    "World", "gray", "scene_hash",
]  # fmt: skip

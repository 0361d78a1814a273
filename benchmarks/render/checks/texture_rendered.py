# SPDX-License-Identifier: GPL-3.0-or-later
"""A spectral texture rendered by F12 in Blender, through its node, against the picture that the texture promises."""

from __future__ import annotations

import math
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.palette.texture.file import write_texture
from spectral_core.palette.texture.texture import SpectralTexture
from spectral_core.spectra.color import delta_e_2000, lab_from_linear_rgb
from spectral_core.spectra.spectrum import Illuminant

BLOCK = 8
"""Side of the blocks of pixels whose means are compared: finer than the visibility of noise, coarser than the noise
itself.
"""


def rendered_errors(texture: SpectralTexture, samples: int, pixels_per_texel: int = 2) -> list[dict[str, float]]:
    """For each light ΔE2000 of block means: to the promised picture, and between two renders (the noise)."""
    rows = []
    for light in texture.lights:
        first, second = (_rendered(texture, light, samples, pixels_per_texel, seed) for seed in (1, 2))
        shown = np.kron(texture.picture(light), np.ones((pixels_per_texel, pixels_per_texel, 1)))
        labs = [
            lab_from_linear_rgb(np.maximum(_blocks(each), 0)) for each in ((first + second) / 2, shown, first, second)
        ]
        errors = delta_e_2000(labs[0], labs[1])
        # Two renders differ by √2 times the noise of one, their mean has 1/√2 of it.
        noise = delta_e_2000(labs[2], labs[3]) / 2
        beyond = np.sqrt(max(float(np.mean(errors**2) - np.mean(noise**2)), 0.0))
        rows.append(
            {
                "mean": float(errors.mean()), "p95": float(np.percentile(errors, 95)), "noise": float(noise.mean()),
                "noise_p95": float(np.percentile(noise, 95)), "beyond_noise": float(beyond),
            }
        )  # fmt: skip
    return rows


def _blocks(picture: NDArray[Any]) -> NDArray[Any]:
    height, width = (side // BLOCK * BLOCK for side in picture.shape[:2])
    cut = picture[:height, :width].reshape(height // BLOCK, BLOCK, width // BLOCK, BLOCK, 3)
    return np.asarray(cut.mean(axis=(1, 3)))


def _rendered(texture: SpectralTexture, light: Illuminant, samples: int, scale: int, seed: int) -> NDArray[Any]:
    """Linear sRGB (H, W, 3), top row first, of a diffuse square under a sun of irradiance π straight above."""
    import bpy

    import blender_addon
    from blender_addon import compat
    from blender_addon.translate.spectra.stored import store_spectrum

    blender_addon.register_once()
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    height, width = texture.weights.shape[1:]
    scene.render.engine = "SPECTRAL"
    scene.render.resolution_x, scene.render.resolution_y = width * scale, height * scale
    scene.render.filter_size = 0.01
    scene.view_settings.view_transform = "Standard"
    scene.spectral.render.samples, scene.spectral.render.seed = samples, seed
    with tempfile.TemporaryDirectory() as folder:
        path = write_texture(Path(folder) / "texture.exr", texture)
        bpy.ops.mesh.primitive_plane_add(size=2)
        plane = bpy.context.object
        plane.scale = (width / height, 1, 1)
        material = bpy.data.materials.new("textured")
        material.use_nodes = True
        tree = material.node_tree
        tree.nodes.clear()
        end, shader = tree.nodes.new("ShaderNodeOutputMaterial"), tree.nodes.new("ShaderNodeBsdfDiffuse")
        node = tree.nodes.new("SpectralSceneTexture")
        node.filepath, node.interpolation, node.extension = str(path), "Closest", "EXTEND"
        tree.links.new(node.outputs[0], shader.inputs["Color"])
        tree.links.new(shader.outputs[0], end.inputs["Surface"])
        plane.data.materials.append(material)
        lamp = bpy.data.lights.new("sun", "SUN")
        lamp.energy, lamp.angle = math.pi, 0.0
        store_spectrum(lamp.spectral, light)
        scene.collection.objects.link(bpy.data.objects.new("sun", lamp))
        camera = bpy.data.cameras.new("camera")
        camera.type, camera.ortho_scale = "ORTHO", 2 * max(width / height, 1)
        holder = bpy.data.objects.new("camera", camera)
        holder.location = (0, 0, 3)
        scene.collection.objects.link(holder)
        scene.camera = holder
        scene.render.filepath = str(Path(folder) / "frame.exr")
        compat.set_image_format(scene.render.image_settings, "OPEN_EXR", color_depth="32", color_mode="RGBA")
        bpy.ops.render.render(write_still=True)
        image = bpy.data.images.load(scene.render.filepath, check_existing=False)
        found = np.empty(width * height * scale * scale * 4, np.float32)
        image.pixels.foreach_get(found)
        bpy.data.images.remove(image)
    return found.reshape(height * scale, width * scale, 4)[::-1, :, :3]

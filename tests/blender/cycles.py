# SPDX-License-Identifier: GPL-3.0-or-later
"""The same Blender scene rendered by Cycles and by this renderer, as pixels."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")


def settings(samples=64, size=24):
    """Settings for a small square picture with linear colors and few bounces."""
    scene = bpy.context.scene
    scene.render.resolution_x = scene.render.resolution_y = size
    scene.render.resolution_percentage = 100
    scene.view_settings.view_transform = "Raw"
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    scene.cycles.samples, scene.cycles.device = samples, "CPU"
    scene.cycles.use_denoising = scene.cycles.use_adaptive_sampling = False
    scene.cycles.sample_clamp_indirect = 0
    scene.cycles.blur_glossy = 0
    for kind in ("max", "diffuse", "glossy", "transmission", "volume", "transparent_max"):
        setattr(scene.cycles, f"{kind}_bounces", 64)
    scene.render.threads_mode, scene.render.threads = "FIXED", 1


def cycles(tmp_path):
    """(size, size, 3) linear pixels, row 0 at the bottom."""
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.render.filepath = str(tmp_path / "cycles.exr")
    if scene.world is not None and scene.world.cycles.sampling_method == "AUTOMATIC":
        # its map of the light has half a million directions, which take longer than these pictures
        scene.world.cycles.sampling_method, scene.world.cycles.sample_map_resolution = "MANUAL", 128
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(scene.render.filepath, check_existing=False)
    image.colorspace_settings.name = "Non-Color"
    pixels = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(pixels)
    height = image.size[1]
    bpy.data.images.remove(image)
    return pixels.reshape(height, -1, 4)[..., :3]


def ours(samples=64, transport="rgb"):
    """The same picture by this renderer, and the notes."""
    from dataclasses import replace

    from blender_addon.translate.scene import translate_scene
    from spectral_core.render.still import render_scene

    scene = translate_scene(bpy.context.evaluated_depsgraph_get())
    film = replace(scene.film, samples=samples)
    result = render_scene(replace(scene, film=film, settings=replace(scene.settings, transport=transport)))
    return result.pixels[..., :3], [note.message for note in result.notes]

# SPDX-License-Identifier: GPL-3.0-or-later
"""Executed with ``$OCIO`` set: what the extension reads and shows in a configuration that is not Blender's own."""

from __future__ import annotations

import json
import sys

import bpy
import numpy as np

import blender_addon

BYTES = (200, 100, 50)
LIGHTS = (0.0, 0.18, 0.5, 1.0)


def emission_of(image):
    """The linear sRGB that a material with an image emits."""
    from blender_addon import compat
    from blender_addon.translate.context import Translation
    from blender_addon.translate.shading.images import linear_pixels, read_image

    translation = Translation.of(bpy.context.evaluated_depsgraph_get(), bpy.data)
    texture = read_image(translation, image, alpha_is_read=False)
    return [float(each) for each in linear_pixels(texture)[0, 0]], compat.working_space(bpy.data)


def saved(path, space):
    made = bpy.data.images.new("saved", 4, 4)
    made.pixels.foreach_set(np.tile(np.array([*BYTES, 255], np.float32) / 255, 16))
    made.filepath_raw, made.file_format = path, "PNG"
    made.save()
    image = bpy.data.images.load(path)
    image.colorspace_settings.name = space
    return image


def main(folder):
    blender_addon.register_once()
    from blender_addon.editing.dial.picture import new_picture
    from blender_addon.translate.display.transform import shown_pixels

    scene = bpy.context.scene
    found = {"color": emission_of(saved(f"{folder}/color.png", "sRGB - Texture"))}
    found["numbers"] = emission_of(saved(f"{folder}/numbers.png", "Raw"))
    scene.view_settings.view_transform = "Un-tone-mapped"
    gray = np.repeat(np.array(LIGHTS)[None, :, None], 3, axis=2)
    found["shown"] = shown_pixels(scene, gray)[0].tolist()
    found["dial"] = new_picture("Dial", 4, 4).colorspace_settings.name
    print("FOUND" + json.dumps(found))


main(sys.argv[1])

# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes with images: each function makes one and returns the struct of the settings."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy
import numpy as np


def saved(folder: Path, name: str, alpha: float = 0.5) -> str:
    """Path of a file with a picture of its own."""
    made = bpy.data.images.new("saved", 4, 4, alpha=True)
    pixels = np.random.default_rng(len(name) + ord(name[-5])).random((16, 4)).astype(np.float32)
    pixels[:, 3] = alpha
    made.pixels.foreach_set(pixels.ravel())
    made.filepath_raw, made.file_format = str(folder / name), "PNG"
    made.save()
    bpy.data.images.remove(made)
    return str(folder / name)


def textured(build: Any, image: Any) -> Any:
    """A plane that emits an image."""
    material = build.material(shader="ShaderNodeEmission")
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = image
    material.node_tree.links.new(node.outputs["Color"], material.node_tree.nodes["shader"].inputs["Color"])
    build.plane(material=material)
    return node


def image_file(build: Any, folder: Path) -> Any:
    saved(folder, "other.png")
    return textured(build, bpy.data.images.load(saved(folder, "image.png"))).image


def generated(build: Any, _: Path) -> Any:
    return textured(build, bpy.data.images.new("made", 4, 4)).image


def sequence(build: Any, folder: Path) -> Any:
    for number in range(12):
        saved(folder, f"walk_{chr(97 + number)}.png")
        Path(folder / f"walk_{chr(97 + number)}.png").rename(folder / f"walk_{number:04d}.png")
    image = bpy.data.images.load(str(folder / "walk_0003.png"))
    image.source = "SEQUENCE"
    bpy.context.scene.frame_set(5)
    user = textured(build, image).image_user
    user.frame_duration = 4
    return user


def image_with_alpha(build: Any, folder: Path) -> Any:
    """Of a byte image, color and alpha are read."""
    found = image_file(build, folder)
    (tree,) = (each.node_tree for each in bpy.data.materials)
    node = next(each for each in tree.nodes if each.type == "TEX_IMAGE")
    tree.links.new(node.outputs["Alpha"], tree.nodes["shader"].inputs["Strength"])
    return found

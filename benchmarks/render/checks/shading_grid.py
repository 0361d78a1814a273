# SPDX-License-Identifier: GPL-3.0-or-later
"""A square of faces with numbers as attributes, and the values that Cycles renders of a node tree on them."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray


def grid_of_faces(inputs: NDArray[np.float32], size: int) -> None:
    """A square of faces, one per pixel, with the numbers as attributes; each emits the result of a node tree."""
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    x, y = np.meshgrid(np.arange(size), np.arange(size))
    x, y = x.ravel(), y.ravel()
    corners = np.stack([x, y, x + 1, y, x + 1, y + 1, x, y + 1], 1).reshape(-1, 2).astype(float)
    mesh = bpy.data.meshes.new("Numbers")
    points = np.column_stack([corners, np.zeros(len(corners))])
    mesh.from_pydata(points.tolist(), [], np.arange(len(points)).reshape(-1, 4).tolist())
    for k in range(3):
        made = mesh.attributes.new(f"n{k}", "FLOAT", "FACE")
        made.data.foreach_set("value", np.ascontiguousarray(inputs[:, k]))
    material = bpy.data.materials.new("Numbers")
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    emission, output = tree.nodes.new("ShaderNodeEmission"), tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(emission.outputs[0], output.inputs["Surface"])
    mesh.materials.append(material)
    scene = bpy.context.scene
    scene.collection.objects.link(bpy.data.objects.new("Numbers", mesh))
    camera = bpy.data.cameras.new("Camera")
    camera.type, camera.ortho_scale = "ORTHO", size
    placed = bpy.data.objects.new("Camera", camera)
    placed.location = (size / 2, size / 2, 5)
    scene.collection.objects.link(placed)
    scene.camera = placed


def rendered_values(size: int) -> NDArray[np.float64]:
    """Values (n, 3) of the faces rendered by Cycles, with 0 for numbers that are not finite."""
    import bpy

    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.samples, scene.cycles.use_adaptive_sampling, scene.cycles.use_denoising = 1, False, False
    scene.cycles.pixel_filter_type, scene.cycles.filter_width = "BOX", 0.01
    scene.cycles.sample_clamp_indirect = 0
    scene.render.resolution_x = scene.render.resolution_y = size
    scene.view_settings.view_transform = "Raw"
    image_settings = scene.render.image_settings
    image_settings.file_format, image_settings.color_depth = "OPEN_EXR", "32"
    with tempfile.TemporaryDirectory() as folder:
        scene.render.filepath = str(Path(folder) / "numbers.exr")
        bpy.ops.render.render(write_still=True)
        image = bpy.data.images.load(scene.render.filepath, check_existing=False)
        image.colorspace_settings.name = "Non-Color"
        pixels = np.array(image.pixels[:], dtype=np.float64).reshape(size * size, 4)[:, :3]
        bpy.data.images.remove(image)
    return np.where(np.isfinite(pixels), pixels, 0.0)

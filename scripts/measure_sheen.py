# SPDX-License-Identifier: GPL-3.0-or-later
"""Measure the sheen of Blender's Sheen BSDF (Microfiber) with Cycles, for ``spectral_core``'s table.

Sheen is a linearly transformed cosine (Zeltner, Burley and Chiang 2022, "Practical multiple-scattering sheen using
linearly transformed cosines"): a share of light R, and a cosine lobe with (x, y, z) -> (a x + b z, a y, z). R is what a
plane shows in a white world. In a world that is white on one side of the plane x = t z alone it shows the share
(1 + k / sqrt(1 + k^2)) / 2 of it on that side, with k = a t + b: two such worlds give a and b.

``python scripts/measure_sheen.py OUT.npy`` writes (roughness, cosine, 3): R, a, b at i / 31.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import bpy
import numpy as np

from spectral_core.cli.shared.terminal import completed

SIZE = 32
SPLITS = (-0.6, 0.6)
LEAST_COSINE = 0.008
SAMPLES, ROWS = 1024, 16


def stage() -> tuple[bpy.types.Object, bpy.types.Node]:
    """A plane with sheen whose roughness goes from 0 to 1 across it, a camera, a world with a split."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.samples, scene.cycles.use_denoising, scene.cycles.use_adaptive_sampling = SAMPLES, False, False
    scene.cycles.max_bounces = 1
    scene.cycles.pixel_filter_type = "BOX"
    scene.cycles.filter_width = 0.01
    scene.render.resolution_x, scene.render.resolution_y = SIZE, ROWS
    scene.view_settings.view_transform = "Raw"
    mesh = bpy.data.meshes.new("Plane")
    half = 0.5 + 0.5 / (SIZE - 1)  # the middles of the outer pixels are roughness 0 and 1
    mesh.from_pydata([(-9, -half, 0), (9, -half, 0), (9, half, 0), (-9, half, 0)], [], [(0, 1, 2, 3)])
    material = bpy.data.materials.new("Sheen")
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    sheen, output = tree.nodes.new("ShaderNodeBsdfSheen"), tree.nodes.new("ShaderNodeOutputMaterial")
    sheen.inputs["Color"].default_value = (1, 1, 1, 1)
    place, split = tree.nodes.new("ShaderNodeNewGeometry"), tree.nodes.new("ShaderNodeSeparateXYZ")
    move = tree.nodes.new("ShaderNodeMath")
    move.inputs[1].default_value = 0.5
    tree.links.new(place.outputs["Position"], split.inputs[0])
    tree.links.new(split.outputs["Y"], move.inputs[0])
    tree.links.new(move.outputs[0], sheen.inputs["Roughness"])
    tree.links.new(sheen.outputs[0], output.inputs["Surface"])
    mesh.materials.append(material)
    scene.collection.objects.link(bpy.data.objects.new("Plane", mesh))
    camera = bpy.data.cameras.new("Camera")
    camera.type, camera.ortho_scale = "ORTHO", 2 * half
    seen_from = bpy.data.objects.new("Camera", camera)
    scene.collection.objects.link(seen_from)
    scene.camera = seen_from
    world = bpy.data.worlds.new("World")
    scene.world = world
    world.use_nodes = True
    world.cycles.sampling_method = "NONE"
    tree = world.node_tree
    coordinate, dot = tree.nodes.new("ShaderNodeTexCoord"), tree.nodes.new("ShaderNodeVectorMath")
    dot.operation, dot.name = "DOT_PRODUCT", "split"
    above = tree.nodes.new("ShaderNodeMath")
    above.operation = "GREATER_THAN"
    above.inputs[1].default_value = 0.0
    tree.links.new(coordinate.outputs["Generated"], dot.inputs[0])
    tree.links.new(dot.outputs["Value"], above.inputs[0])
    tree.links.new(above.outputs[0], tree.nodes["Background"].inputs["Color"])
    return seen_from, dot


def picture(folder: str) -> np.ndarray:
    """Mean reflected light over the rows, by roughness."""
    scene = bpy.context.scene
    scene.render.filepath = str(Path(folder) / "sheen.exr")
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(scene.render.filepath)
    pixels = np.array(image.pixels[:]).reshape(ROWS, SIZE, 4)[..., 0]
    bpy.data.images.remove(image)
    return pixels.mean(axis=0)


def main() -> None:
    """Measure all angles."""
    camera, split = stage()
    table = np.zeros((SIZE, SIZE, 3))
    with tempfile.TemporaryDirectory() as folder:
        for column, cosine in enumerate(np.maximum(np.arange(SIZE) / (SIZE - 1), LEAST_COSINE)):
            angle = np.arccos(cosine)
            # toward +x, the picture's right along +y
            camera.location = 20 * np.array([np.sin(angle), 0, np.cos(angle)])
            camera.rotation_euler = (0, angle, 0)
            camera.rotation_mode = "XYZ"
            matrix = np.eye(4)
            toward = np.array([np.sin(angle), 0, np.cos(angle)])
            right = np.array([0.0, 1.0, 0.0])
            matrix[:3, :3] = np.stack([right, np.cross(toward, right), toward], axis=1)
            matrix[:3, 3] = 5 * toward
            camera.matrix_world = matrix.T.tolist()
            seen = []
            for direction in ((0.0, 0.0, 1.0), *((1.0, 0.0, -t) for t in SPLITS)):
                split.inputs[1].default_value = direction
                seen.append(picture(folder))
            whole = seen[0]
            k = []
            for part in seen[1:]:
                share = np.clip(2 * (part / np.maximum(whole, 1e-9)) - 1, -1 + 1e-6, 1 - 1e-6)
                # light on the side x > t z is the part of the lobe beyond k
                k.append(-share / np.sqrt(1 - share**2))
            a = (k[1] - k[0]) / (SPLITS[1] - SPLITS[0])
            table[:, column] = np.stack([whole, a, k[0] - a * SPLITS[0]], axis=-1)
            print(
                f"cosine {cosine:.3f}: R {whole[[0, 10, 20, 31]].round(4)} a {a[[0, 10, 20, 31]].round(4)}", flush=True
            )
    np.save(sys.argv[1], table.astype(np.float32))


if __name__ == "__main__":
    sys.exit(completed(main))

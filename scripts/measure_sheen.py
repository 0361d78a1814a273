# SPDX-License-Identifier: GPL-3.0-or-later
"""Measure the sheen of Blender's Sheen BSDF (Microfiber) with Cycles, for ``spectral_core``'s table.

Sheen is a linearly transformed cosine (Zeltner, Burley and Chiang 2022, "Practical multiple-scattering sheen using
linearly transformed cosines"): a share of light R, and a cosine lobe with (x, y, z) -> (a x + b z, a y, z). A plane
under a point-like sun in the plane of incidence, at (x, 0, z), shows f = R z a^2 / (pi (z^2 + (a x + b z)^2)^2), so
that sqrt(z / f) is a quadratic form of x and z: three suns give R, a and b without noise.

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
SUNS_DEG = (-40.0, 10.0, 55.0)
"""Angles from the normal, toward the camera's side."""
LEAST_COSINE = 1e-4
"""In place of 0, where a camera does not see the plane."""
SAMPLES, ROWS, FAR = 4, 4, 2000.0


def stage() -> tuple[bpy.types.Object, bpy.types.Object]:
    """A plane with sheen whose roughness goes from 0 to 1 across it, a camera, a sun without size."""
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
    mesh.from_pydata([(-FAR, -half, 0), (FAR, -half, 0), (FAR, half, 0), (-FAR, half, 0)], [], [(0, 1, 2, 3)])
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
    camera.clip_end = 3 * FAR
    seen_from = bpy.data.objects.new("Camera", camera)
    scene.collection.objects.link(seen_from)
    scene.camera = seen_from
    light = bpy.data.lights.new("Sun", "SUN")
    light.energy, light.angle = 1.0, 0.0
    sun = bpy.data.objects.new("Sun", light)
    scene.collection.objects.link(sun)
    return seen_from, sun


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


def lobe(seen: list[np.ndarray]) -> np.ndarray:
    """(roughness, 3): R, a, b from what the plane shows under each sun."""
    x, z = np.sin(np.radians(SUNS_DEG)), np.cos(np.radians(SUNS_DEG))
    root = np.sqrt(z[:, None] / np.maximum(seen, 1e-30))
    # A x^2 + B x z + C z^2 with A = a / s, B = 2 b / s, C = (1 + b^2) / (a s) and s^2 = R / pi
    first, second, third = np.linalg.solve(np.stack([x * x, x * z, z * z], axis=1), root)
    s = 1.0 / np.sqrt(first * third - 0.25 * second**2)
    return np.stack([np.pi * s * s, first * s, 0.5 * second * s], axis=-1)


def main() -> None:
    """Measure all angles."""
    camera, sun = stage()
    table = np.zeros((SIZE, SIZE, 3))
    cosines = np.maximum(np.arange(SIZE) / (SIZE - 1), LEAST_COSINE)
    with tempfile.TemporaryDirectory() as folder:
        for column, cosine in enumerate(cosines):
            angle = np.arccos(cosine)
            toward, right = np.array([np.sin(angle), 0, np.cos(angle)]), np.array([0.0, 1.0, 0.0])
            matrix = np.eye(4)
            matrix[:3, :3] = np.stack([right, np.cross(toward, right), toward], axis=1)
            matrix[:3, 3] = FAR * toward
            camera.matrix_world = matrix.T.tolist()
            seen = []
            for degrees in SUNS_DEG:
                sun.rotation_euler = (0.0, np.radians(degrees), 0.0)
                seen.append(picture(folder))
            table[:, column] = lobe(seen)
            print(f"cosine {cosine:.3f}: R {table[[0, 10, 20, 31], column, 0].round(4)}", flush=True)
    share = cosines[0] * (SIZE - 1)  # of the second column in what was measured for the first
    table[:, 0] = (table[:, 0] - share * table[:, 1]) / (1.0 - share)
    np.save(sys.argv[1], table.astype(np.float32))


if __name__ == "__main__":
    sys.exit(completed(main))

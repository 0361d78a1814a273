# SPDX-License-Identifier: GPL-3.0-or-later
"""From Blender's evaluated scene to scene data: a million triangles of each type of shading, and many instances."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks import Options


def run(options: Options) -> dict[str, Any]:
    """Print seconds per scene (the best of three) and return them."""
    import bpy

    import blender_addon

    blender_addon.register_once()
    from blender_addon.translate.scene import translate_scene

    side, copies = (100, 500) if options.quick else (708, 20_000)
    cases: dict[str, Callable[[], None]] = {
        "flat": lambda: _grid(side, "flat"),
        "smooth": lambda: _grid(side, "smooth"),
        "smooth, with UVs": lambda: _grid(side, "smooth", uvs=True),
        "a third of its edges sharp, with UVs": lambda: _grid(side, "sharp", uvs=True),
        "every corner apart in UVs": lambda: _grid(side, "smooth", uvs=True, torn=True),
        "many instances of one cube": lambda: _instances(copies),
    }
    figures: dict[str, Any] = {}
    for name, build in cases.items():
        bpy.ops.wm.read_factory_settings(use_empty=True)
        build()
        camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
        bpy.context.scene.collection.objects.link(camera)
        bpy.context.scene.camera = camera
        depsgraph = bpy.context.evaluated_depsgraph_get()
        seconds, work = [], []
        for _ in range(3):
            start, busy = time.perf_counter(), time.process_time()
            scene = translate_scene(depsgraph)
            seconds.append(time.perf_counter() - start)
            work.append(time.process_time() - busy)
        triangles = sum(len(mesh.triangles) for mesh in scene.meshes)
        figures[name] = {
            "triangles": triangles, "instances": len(scene.instances), "seconds": min(seconds), "work": min(work),
        }  # fmt: skip
        print(f"{name:38} {triangles:9,} triangles {len(scene.instances):7,} instances {min(seconds):7.3f} s")
    grids, many = list(figures.values())[:-1], figures["many instances of one cube"]
    figures["holds"] = {
        "no triangle and no instance is lost": all(row["triangles"] == 2 * side**2 for row in grids)
        and (many["triangles"], many["instances"]) == (12, copies),
        "each scene is translated in 5 s of processor time": all(row["work"] < 5 for row in (*grids, many)),
    }
    return figures


def _grid(side: int, shading: str, *, uvs: bool = False, torn: bool = False) -> None:
    import bpy

    bpy.ops.mesh.primitive_grid_add(x_subdivisions=side, y_subdivisions=side)
    data = bpy.context.object.data
    data.polygons.foreach_set("use_smooth", np.full(len(data.polygons), shading != "flat"))
    if shading == "sharp":
        edges = data.attributes.new("sharp_edge", "BOOLEAN", "EDGE")
        edges.data.foreach_set("value", np.arange(len(data.edges)) % 3 == 0)
    if torn:
        data.uv_layers[0].uv.foreach_set(
            "vector", np.random.default_rng(0).random(len(data.loops) * 2, dtype=np.float32)
        )
    data.update()
    material = bpy.data.materials.new("Material")
    if uvs:
        from blender_addon import compat

        tree = compat.use_nodes(material)
        image = tree.nodes.new("ShaderNodeTexImage")
        image.image = bpy.data.images.new("Image", 8, 8)
        shader = next(node for node in tree.nodes if node.type == "BSDF_PRINCIPLED")
        tree.links.new(image.outputs["Color"], shader.inputs["Base Color"])
    data.materials.append(material)


def _instances(count: int) -> None:
    import bpy

    bpy.ops.mesh.primitive_cube_add()
    cube = bpy.context.object
    for place in range(count - 1):
        twin = bpy.data.objects.new("Cube", cube.data)
        twin.location.x = place
        bpy.context.scene.collection.objects.link(twin)

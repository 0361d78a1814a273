# SPDX-License-Identifier: GPL-3.0-or-later
"""A small saved scene with two lamps, an emissive ball and a world, and its recorded transport."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="needs the Python module bpy: pip install 'spectral-scene[blender]'")


def _linked(name, data, place):
    made = bpy.data.objects.new(name, data)
    made.location = place
    bpy.context.scene.collection.objects.link(made)
    return made


def _lamp(name, kind, energy, place):
    data = bpy.data.lights.new(name, kind)
    data.energy, data.shadow_soft_size = energy, 0.3
    return _linked(name, data, place)


def _material(name, shader, **inputs):
    from blender_addon import compat

    made = bpy.data.materials.new(name)
    tree = compat.use_nodes(made)
    tree.nodes.clear()
    node = tree.nodes.new(shader)
    for key, value in inputs.items():
        node.inputs[key].default_value = value
    tree.links.new(node.outputs[0], tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    return made


@pytest.fixture
def stage(_extension, tmp_path):
    """The saved scene: a floor, "Key" (orange) and "Fill" above it, an emissive "Ball", a gray world."""
    from blender_addon import compat

    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = "SPECTRAL"
    scene.render.resolution_x, scene.render.resolution_y = 16, 12
    scene.spectral.render.samples = 16
    bpy.ops.mesh.primitive_plane_add(size=8)
    bpy.context.object.data.materials.append(_material("Floor", "ShaderNodeBsdfDiffuse", Color=(0.6, 0.5, 0.4, 1)))
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.5, location=(0, 1.5, 0.6), segments=12, ring_count=8)
    bpy.context.object.name = "Ball"
    bpy.context.object.data.materials.append(
        _material("Glow", "ShaderNodeEmission", Color=(0.2, 0.4, 1, 1), Strength=3)
    )
    _lamp("Key", "POINT", 200.0, (-2, -1, 3)).data.color = (1.0, 0.6, 0.3)
    _lamp("Fill", "POINT", 80.0, (2, 1, 3))
    scene.world = bpy.data.worlds.new("World")
    tree = compat.use_nodes(scene.world)
    background = next(node for node in tree.nodes if node.type == "BACKGROUND")
    background.inputs["Color"].default_value, background.inputs["Strength"].default_value = (0.5, 0.5, 0.5, 1), 0.2
    camera = _linked("Camera", bpy.data.cameras.new("Camera"), (0, 0, 8))
    scene.camera = camera
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "stage.blend"))
    return scene


@pytest.fixture
def dial(stage):
    """The dial of the stage, recorded one bulb per light."""
    pytest.importorskip("mitsuba", reason="needs Mitsuba: pip install 'spectral-scene[render]'")
    pytest.importorskip("OpenEXR", reason="needs OpenEXR: pip install 'spectral-scene[render]'")
    bpy.ops.spectral.dial_record()
    return stage.spectral.dial


@pytest.fixture
def picture():
    """Pixels (height, width, 4) of the image that follows the dial."""

    def read():
        image = bpy.data.images["Light Dial"]
        pixels = np.empty(image.size[0] * image.size[1] * 4, np.float32)
        image.pixels.foreach_get(pixels)
        return pixels.reshape(image.size[1], image.size[0], 4)

    return read


@pytest.fixture
def f12():
    """The present picture of F12: (height, width, 4), row 0 at the bottom."""

    def render():
        from blender_addon import jobs

        jobs.records.clear()
        bpy.ops.render.render()
        assert jobs.records[-1].status == "done"
        return jobs.records[-1].result.pixels

    return render


@pytest.fixture
def same_paths():
    """The scene rendered with the paths of a recording, which choose lights independently of their brightness."""

    def render():
        from blender_addon.translate.scene import translate_scene
        from spectral_core.render import render_scene
        from spectral_core.render.relight.sampling import SAMPLING_LIGHTS

        scene = translate_scene(bpy.context.evaluated_depsgraph_get())
        return render_scene(scene, sampling_lights=SAMPLING_LIGHTS).pixels

    return render

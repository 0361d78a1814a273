# SPDX-License-Identifier: GPL-3.0-or-later
"""Denoising data compared with Cycles: rays follow mirrors and clear glass to rough surfaces, and see light."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")
pytest.importorskip("mitsuba")
OpenEXR = pytest.importorskip("OpenEXR")

from tests.blender.cycles import settings as small_picture  # noqa: E402

CELL, SAMPLES = 24, 64
BALLS = {
    "matt": ("BsdfDiffuse", {"Color": (0.6, 0.3, 0.2, 1)}),
    "varnished": ("BsdfPrincipled", {"Base Color": (0.2, 0.5, 0.7, 1), "Roughness": 0.1}),
    "mirror": ("BsdfGlossy", {"Color": (0.9, 0.9, 0.9, 1), "Roughness": 0.0}),
    "brushed": ("BsdfGlossy", {"Color": (0.8, 0.9, 0.7, 1), "Roughness": 0.5}),
    "sharp": ("BsdfGlossy", {"Color": (0.9, 0.9, 0.9, 1), "Roughness": 0.2}),
    "glass": ("BsdfGlass", {"Color": (1, 0.9, 0.8, 1), "Roughness": 0.0, "IOR": 1.45}),
    "clear": ("BsdfGlass", {"Color": (1, 0.9, 0.8, 1), "Roughness": 0.15, "IOR": 1.45}),
    "frosted": ("BsdfGlass", {"Color": (1, 0.9, 0.8, 1), "Roughness": 0.5, "IOR": 1.45}),
    "coated": ("BsdfPrincipled", {"Base Color": (0.6, 0.2, 0.1, 1), "Roughness": 0.6, "Coat Weight": 1.0}),
    "glow": ("Emission", {"Color": (1, 0.5, 0.2, 1), "Strength": 0.7}),
    "held out": ("Holdout", {}),
}


def stage():
    """One ball of each material in a row, before and in front of matt walls."""
    scene = bpy.context.scene
    small_picture(SAMPLES, CELL)
    scene.render.resolution_x = CELL * len(BALLS)
    for number, (name, (kind, values)) in enumerate(BALLS.items()):
        x = number - (len(BALLS) - 1) / 2
        bpy.ops.mesh.primitive_uv_sphere_add(radius=0.45, location=(x, 0, 1), segments=32, ring_count=16)
        bpy.ops.object.shade_smooth()
        bpy.context.object.data.materials.append(material(name, kind, values))
    for y in (3, -12):
        bpy.ops.mesh.primitive_plane_add(size=80, location=(0, y, 1), rotation=(np.pi / 2, 0, 0))
        bpy.context.object.data.materials.append(material("wall", "BsdfDiffuse", {"Color": (0.3, 0.6, 0.3, 1)}))
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.data.type, camera.data.ortho_scale = "ORTHO", len(BALLS)
    camera.location, camera.rotation_euler = (0, -10, 1), (np.pi / 2, 0, 0)
    scene.collection.objects.link(camera)
    scene.camera = camera
    bpy.context.view_layer.cycles.denoising_store_passes = True


def material(name, kind, values):
    from blender_addon import compat

    made = bpy.data.materials.new(name)
    tree = compat.use_nodes(made)
    tree.nodes.clear()
    node, output = tree.nodes.new(f"ShaderNode{kind}"), tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(node.outputs[0], output.inputs[0])
    for key, value in values.items():
        node.inputs[key].default_value = value
    return made


def rendered(path, engine, transport="RGB"):
    """Mean of each pass over the middle of each ball."""
    from blender_addon import compat

    scene = bpy.context.scene
    scene.render.engine = engine
    scene.spectral.render.samples, scene.spectral.render.transport = SAMPLES, transport
    compat.set_image_format(scene.render.image_settings, "OPEN_EXR_MULTILAYER", color_depth="32")
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    found = {}
    with OpenEXR.File(scene.render.filepath, separate_channels=True) as file:
        for channel, data in (item for part in file.parts for item in part.channels.items()):
            name, _, letter = channel.partition(".")[2].rpartition(".")
            found.setdefault(name, {})[letter] = np.array(data.pixels, np.float64)
    middle = CELL // 2
    means = {}
    for name in ("Denoising Albedo", "Denoising Normal", "Denoising Depth"):
        letters = sorted(found[name], key="RGBXYZ".index)
        picture = np.stack([found[name][letter] for letter in letters], axis=-1)
        cells = picture.reshape(CELL, len(BALLS), CELL, -1)[middle - 5 : middle + 5, :, middle - 5 : middle + 5]
        means[name] = cells.mean(axis=(0, 2))
    return means


@pytest.fixture(scope="module")
def three(_extension, tmp_path_factory):
    """The passes of Cycles, of RGB transport, and of spectral transport."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    stage()
    folder = tmp_path_factory.mktemp("denoising")
    kinds = (("CYCLES", "RGB"), ("SPECTRAL", "RGB"), ("SPECTRAL", "SPECTRAL"))
    return [rendered(folder / f"{engine}_{transport}.exr", engine, transport) for engine, transport in kinds]


@pytest.mark.parametrize("name", ["Denoising Albedo", "Denoising Normal", "Denoising Depth"])
@pytest.mark.parametrize("transport", [1, 2])
def test_denoising_data_equal_those_of_cycles(three, name, transport):
    theirs, ours = three[0][name], three[transport][name]
    scale = 1.0 if name != "Denoising Depth" else 0.02
    apart = dict(zip(BALLS, np.abs(ours - theirs).max(axis=-1) * scale, strict=True))
    assert max(apart.values()) < 0.02, apart
    assert theirs.std() > 0.1


def test_normals_of_a_panorama_have_the_axes_of_cycles(three, tmp_path):
    for each in [each for each in bpy.context.scene.objects if each.type == "MESH"]:
        if not set(each.data.materials.keys()) & {"matt", "mirror", "clear", "wall", "wall.001"}:
            bpy.data.objects.remove(each)
    camera = bpy.context.scene.camera
    camera.data.type, camera.location = "PANO", (0.5, -4, 1.5)
    owner = camera.data if hasattr(camera.data, "panorama_type") else camera.data.cycles
    owner.panorama_type = "EQUIRECTANGULAR"
    theirs, ours = (rendered(tmp_path / f"{name}.exr", name)["Denoising Normal"] for name in ("CYCLES", "SPECTRAL"))
    assert np.quantile(np.abs(ours - theirs), 0.9) < 0.02
    assert np.abs(theirs).max() > 0.8

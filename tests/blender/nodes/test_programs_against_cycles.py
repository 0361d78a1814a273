# SPDX-License-Identifier: GPL-3.0-or-later
"""Values of shader operations equal those of Cycles at the same positions of one render."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")
OpenEXR = pytest.importorskip("OpenEXR")

from tests.blender import cycles  # noqa: E402

NODES = {
    "noise": ("TexNoise", 0, {}, {"Scale": 5, "Detail": 3.4, "Distortion": 0.3}),
    "noise color 1D": ("TexNoise", 1, {"noise_dimensions": "1D"}, {"Scale": 5}),
    "noise 4D": ("TexNoise", 0, {"noise_dimensions": "4D"}, {"Scale": 5}),
    "ridged noise": ("TexNoise", 0, {"noise_type": "RIDGED_MULTIFRACTAL"}, {"Scale": 3, "Offset": 0.3}),
    "hetero terrain": ("TexNoise", 0, {"noise_type": "HETERO_TERRAIN"}, {"Scale": 3, "Detail": 2.5}),
    "white noise": ("TexWhiteNoise", 1, {}, {}),
    "voronoi": ("TexVoronoi", 0, {}, {"Scale": 4, "Detail": 1.5}),
    "voronoi color 2D": ("TexVoronoi", 1, {"voronoi_dimensions": "2D"}, {"Scale": 4}),
    "voronoi F2 4D": ("TexVoronoi", 0, {"voronoi_dimensions": "4D", "feature": "F2"}, {"Scale": 4}),
    "smooth voronoi": ("TexVoronoi", 2, {"feature": "SMOOTH_F1"}, {"Scale": 4}),
    "voronoi edge": ("TexVoronoi", 0, {"feature": "DISTANCE_TO_EDGE", "normalize": True}, {"Scale": 4, "Detail": 2.5}),
    "voronoi radius": ("TexVoronoi", "Radius", {"feature": "N_SPHERE_RADIUS"}, {"Scale": 4}),
    "minkowski": ("TexVoronoi", 0, {"distance": "MINKOWSKI"}, {"Scale": 4, "Randomness": 0.8}),
    "wave": ("TexWave", 1, {}, {"Distortion": 1.5, "Detail": 2.2}),
    "wave of a negative roughness": ("TexWave", 1, {}, {"Distortion": 1.5, "Detail": 2.2, "Detail Roughness": -0.6}),
    "wave of a negative detail": ("TexWave", 1, {}, {"Distortion": 1.5, "Detail": -0.4}),
    "rings": ("TexWave", 1, {"wave_type": "RINGS", "wave_profile": "SAW"}, {}),
    "magic": ("TexMagic", 0, {"turbulence_depth": 7}, {"Distortion": 1.3}),
    "magic with seams": ("TexMagic", 0, {"turbulence_depth": 3}, {"Scale": 1.7}),
    "gabor": ("TexGabor", 0, {}, {"Scale": 4}),
    "gabor phase isotropic": ("TexGabor", 1, {}, {"Scale": 4, "Anisotropy": 0.3, "Frequency": 0.4}),
    "gabor 3D": ("TexGabor", 2, {"gabor_type": "3D"}, {"Scale": 4, "Orientation": (0.3, -0.5, 0.2)}),
    "gabor 3D isotropic": (
        "TexGabor",
        0,
        {"gabor_type": "3D"},
        {"Scale": 3, "Anisotropy": 0.2, "Orientation": (0.3, -0.5, 0.2)},
    ),
    "radial": ("TexGradient", 1, {"gradient_type": "RADIAL"}, {}),
    "radial tiling": ("RadialTiling", "Segment Coordinates", {"normalize": True}, {"Sides": 5, "Roundness": 0.4}),
    "sharp tiling": ("RadialTiling", "Segment Coordinates", {"normalize": False}, {"Sides": 6, "Roundness": 0}),
    "round tiling": ("RadialTiling", "Segment Coordinates", {"normalize": True}, {"Sides": 3, "Roundness": 1}),
    "uneven tiling": ("RadialTiling", "Segment Coordinates", {"normalize": True}, {"Sides": 5.4, "Roundness": 0.5}),
    "uneven plain": ("RadialTiling", "Segment Coordinates", {"normalize": False}, {"Sides": 3.7, "Roundness": 0.8}),
    "sharp uneven": ("RadialTiling", "Segment Coordinates", {"normalize": True}, {"Sides": 4.2, "Roundness": 0}),
    "segment width": ("RadialTiling", "Segment Width", {}, {"Sides": 4.6, "Roundness": 0.3}),
    "segment number": ("RadialTiling", "Segment ID", {}, {"Sides": 4.6}),
    "segment rotation": ("RadialTiling", "Segment Rotation", {}, {"Sides": 7}),
    "checker": ("TexChecker", 0, {}, {}),
    "brick": ("TexBrick", 0, {"squash": 0.7, "squash_frequency": 3}, {"Bias": 0.1, "Mortar Smooth": 0.4}),
    "brick with sharp joints": ("TexBrick", 1, {}, {"Mortar Size": 0.1, "Mortar Smooth": 0.0}),
    "brick without joints": ("TexBrick", 1, {}, {"Mortar Size": 0.1, "Mortar Smooth": -0.5}),
    "mapping": ("Mapping", 0, {"vector_type": "TEXTURE"}, {"Rotation": (0.3, 0.5, 0.7), "Scale": (2, -0.5, 3)}),
    "rotate": ("VectorRotate", 0, {"rotation_type": "EULER_XYZ", "invert": True}, {"Rotation": (0.3, 0.5, 0.7)}),
    "hsl": ("SeparateColor", 2, {"mode": "HSL"}, {}),
    "combine hsv": ("CombineColor", 0, {"mode": "HSV"}, {}),
    "arcsine": ("Math", 0, {"operation": "ARCSINE"}, {}),
    "wrapped": ("VectorMath", 0, {"operation": "WRAP"}, {}),
    "smoother": ("MapRange", 0, {"interpolation_type": "SMOOTHERSTEP"}, {}),
    "empty range": ("MapRange", 0, {"clamp": False}, {"From Min": 0.3, "From Max": 0.3, "To Min": 0.8, "To Max": 0.2}),
    "empty range, clamped": (
        "MapRange",
        0,
        {"clamp": True},
        {"From Min": 0.3, "From Max": 0.3, "To Min": 0.8, "To Max": 0.2},
    ),
    "empty smooth range": (
        "MapRange",
        0,
        {"interpolation_type": "SMOOTHSTEP"},
        {"From Min": 0.3, "From Max": 0.3, "To Min": 0.8, "To Max": 0.2},
    ),
    "empty range of vectors": (
        "MapRange",
        0,
        {"data_type": "FLOAT_VECTOR"},
        {"From Min": (0.3, 0.1, 0.2), "From Max": (0.3, -0.4, 0.2), "To Min": (0.8, 0.7, 0.6), "To Max": (0.2, 0.1, 0)},
    ),
    "power of 0": ("Gamma", 0, {}, {"Gamma": 0.0}),
    "linear light": ("Mix", 2, {"data_type": "RGBA", "blend_type": "LINEAR_LIGHT"}, {}),
    "color blend": ("Mix", 2, {"data_type": "RGBA", "blend_type": "COLOR"}, {}),
    "ramp": ("ValToRGB", 0, {}, {}),
}
"""Node, output, settings and inputs."""


def wired(tree, kind, output, settings, inputs, offset):
    """The node with every free input fed from the position, moved by ``offset``."""
    geometry, moved = tree.nodes.new("ShaderNodeNewGeometry"), tree.nodes.new("ShaderNodeMapping")
    moved.inputs["Location"].default_value = (offset,) * 3
    tree.links.new(geometry.outputs["Position"], moved.inputs["Vector"])
    split = tree.nodes.new("ShaderNodeSeparateXYZ")
    tree.links.new(moved.outputs[0], split.inputs[0])
    node = tree.nodes.new(f"ShaderNode{kind}")
    for name, value in settings.items():
        setattr(node, name, value)
    free = [socket for socket in node.inputs if socket.enabled]
    for socket in free:
        if socket.name in inputs:
            socket.default_value = inputs[socket.name]
        elif kind.startswith("Tex") and socket.name == "Vector":
            tree.links.new(moved.outputs[0], socket)
        elif not kind.startswith("Tex"):
            is_number = socket.type == "VALUE"
            tree.links.new(split.outputs[free.index(socket) % 3] if is_number else moved.outputs[0], socket)
        elif socket.name == "W":
            tree.links.new(split.outputs[0], socket)
    outputs = [socket for socket in node.outputs if socket.enabled]
    return node.outputs[output] if isinstance(output, str) or kind == "Mix" else outputs[min(output, len(outputs) - 1)]


def passes(path):
    """Combined color and position (h, w, 3) of a multilayer picture; OpenEXR joins the channels of colors to one."""
    found = {}
    for part in OpenEXR.File(str(path)).parts:
        for name, channel in part.channels.items():
            found[f"{part.name()}.{name}"] = np.array(channel.pixels)

    def picked(kind, names):
        whole = [pixels for name, pixels in found.items() if kind in name and pixels.ndim == 3]
        single = lambda letter: next(p for n, p in found.items() if kind in n and n.endswith(f".{letter}"))  # noqa: E731
        return whole[0][..., :3] if whole else np.stack([single(letter) for letter in names], -1)

    return picked("Combined", "RGB"), picked("Position", "XYZ")


@pytest.mark.parametrize("offset", [0.0, 1e5])
@pytest.mark.parametrize("name", NODES)
def test_values_equal_those_of_cycles(build, tmp_path, name, offset):
    from blender_addon.translate.context import Translation
    from blender_addon.translate.shading import surfaces  # noqa: F401
    from blender_addon.translate.shading.reader import Reader
    from blender_addon.translate.shading.tree import Input

    kind, output, settings, inputs = NODES[name]
    if offset and (not kind.startswith("Tex") or kind in ("TexWave", "TexMagic")):
        pytest.skip("single precision has no digits left of the sines of numbers as large as this, in Cycles either")
    cycles.settings(1, 20)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    if hasattr(scene.render.image_settings, "media_type"):
        scene.render.image_settings.media_type = "MULTI_LAYER_IMAGE"
    scene.render.image_settings.file_format = "OPEN_EXR_MULTILAYER"
    scene.view_layers[0].use_pass_position = True
    material = build.material(shader="ShaderNodeEmission")
    tree = material.node_tree
    tree.links.new(wired(tree, kind, output, settings, inputs, offset), tree.nodes["shader"].inputs["Color"])
    bpy.ops.mesh.primitive_uv_sphere_add(segments=24, ring_count=12, radius=1.2, location=(0.1, 0.1, 0.1))
    bpy.context.object.data.materials.append(material)
    camera = build.camera((1, -6, 2), lens=90)
    camera.rotation_euler = (-camera.location).to_track_quat("-Z", "Y").to_euler()
    scene.render.filepath = str(tmp_path / "passes.exr")
    bpy.ops.render.render(write_still=True)
    color, position = passes(scene.render.filepath)
    hit = np.abs(position).sum(-1) > 0
    depsgraph = bpy.context.evaluated_depsgraph_get()
    reader = Reader(Translation.of(depsgraph, bpy.data), "material", on_surface=True)
    node = material.evaluated_get(depsgraph).node_tree.nodes["shader"]
    program = reader.paint(Input(node.inputs["Color"]), None).program
    points = tuple(position[hit].T)
    values = program.evaluate(lambda name, shift: points, np.float32)
    assert hit.sum() > 100 and reader.translation.notes == ()
    assert np.abs(values - color[hit]).mean() < 1e-3

# SPDX-License-Identifier: GPL-3.0-or-later
"""Volumes that vary: patterns in meshes, and the grids of Volume objects through every volume shader."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from benchmarks.render.features import feature
from benchmarks.render.features.stage import Stage

SIDE = 40
_FOLDER = tempfile.TemporaryDirectory(prefix="features_")


def _smoke() -> dict[str, np.ndarray]:
    """A puff of smoke with a hot core, and colors: grids of a cube of 2 units."""
    x, y, z = np.mgrid[0:SIDE, 0:SIDE, 0:SIDE] / SIDE * 2 - 1
    lumps = 0.5 + 0.5 * np.sin(7 * x + 2) * np.cos(6 * y) * np.sin(5 * z + 1)
    radius = np.sqrt(x * x + y * y + (0.8 * z) ** 2)
    density = np.clip(1.5 * (0.85 - radius), 0, 1) * lumps
    heat = np.clip(0.7 - np.sqrt(x * x + y * y + (z + 0.3) ** 2), 0, 1)
    color = np.stack([0.5 + 0.5 * x, 0.5 + 0.5 * y, 0.5 - 0.5 * z], -1) * (radius < 0.9)[..., None]
    return {"density": density, "temperature": heat, "heat": heat, "color": color}


def _file(names: tuple[str, ...]) -> str:
    """A file of some of the grids, in object space a cube from -1 to 1."""
    from spectral_core.volume.files.formats.openvdb_format import find_openvdb

    openvdb: Any = find_openvdb()
    path = Path(_FOLDER.name) / f"{'_'.join(names)}.vdb"
    grids = []
    for name in names:
        values = np.require(_smoke()[name], np.float32, ["C", "W"])
        grid = (openvdb.FloatGrid if values.ndim == 3 else openvdb.Vec3SGrid)()
        grid.copyFromArray(values)
        grid.name = name
        edge = 2 / SIDE
        matrix = np.diag([edge, edge, edge, 1.0])
        matrix[3, :3] = -1 + edge / 2
        grid.transform = openvdb.createLinearTransform(matrix.tolist())
        grids.append(grid)
    openvdb.write(str(path), grids=grids)
    return str(path)


def _object(stage: Stage, grids: tuple[str, ...]) -> Any:
    """The Volume object in the place of the ball, with the ball's material, of which the volume socket is free."""
    data = bpy.data.volumes.new("Smoke")
    data.filepath = _file(grids)
    data.materials.append(stage.material_of_ball)
    tree = stage.tree()
    tree.nodes.remove(tree.nodes["shader"])
    bpy.data.objects.remove(stage.ball)
    stage.ball = stage.object("Smoke", data, (0, 0, 1))
    stage.scene.cycles.volume_biased = False
    return tree.nodes["output"].inputs["Volume"]


def _smoky(kind: str, grids: tuple[str, ...] = ("density",), **inputs: Any) -> Callable[[Stage], None]:
    """A volume shader on the grids; an Attribute node drives the density of shaders that read no grid themselves."""

    def build(stage: Stage) -> None:
        socket = _object(stage, grids)
        node = stage.node(kind, **inputs)
        stage.link(node.outputs[0], socket)
        if kind != "ShaderNodeVolumePrincipled":
            attribute = stage.node("ShaderNodeAttribute", attribute_name="density")
            times = stage.node("ShaderNodeMath", operation="MULTIPLY")
            times.inputs[1].default_value = 6.0
            stage.link(attribute.outputs["Fac"], times.inputs[0])
            stage.link(times.outputs[0], node.inputs["Strength" if "Strength" in node.inputs else "Density"])

    return build


def _placed(stage: Stage) -> None:
    _smoky("ShaderNodeVolumePrincipled", Density=6.0)(stage)
    stage.ball.scale, stage.ball.rotation_euler, stage.ball.location = (0.7, 1.2, -0.8), (0.4, 0.3, 0.9), (0.2, 0.1, 1)


def _scaled(build: Callable[[Stage], None], space: str = "OBJECT") -> Callable[[Stage], None]:
    """Twice as large: densities count in the object's units or in the world's."""

    def change(stage: Stage) -> None:
        build(stage)
        stage.ball.scale = (2.0, 2.0, 2.0)
        stage.ball.data.render.space = space

    return change


def _info(stage: Stage) -> None:
    socket = _object(stage, ("density", "temperature"))
    node, info = stage.node("ShaderNodeVolumeScatter"), stage.node("ShaderNodeVolumeInfo")
    times = stage.node("ShaderNodeMath", operation="MULTIPLY_ADD")
    times.inputs[1].default_value = 5.0
    stage.link(info.outputs["Density"], times.inputs[0])
    stage.link(info.outputs["Temperature"], times.inputs[2])
    stage.link(times.outputs[0], node.inputs["Density"])
    stage.link(node.outputs[0], socket)


def _without_material(stage: Stage) -> None:
    _object(stage, ("density",))
    stage.ball.data.materials.clear()
    stage.ball.scale = (2.0, 2.0, 2.0)


def _textured(stage: Stage) -> None:
    """The grid's density, cut by noise."""
    socket = _object(stage, ("density",))
    node = stage.node("ShaderNodeVolumePrincipled", Color=(0.8, 0.6, 0.4, 1))
    noise = stage.node("ShaderNodeTexNoise", Scale=3.0)
    stage.link(stage.node("ShaderNodeTexCoord").outputs["Object"], noise.inputs["Vector"])
    times = stage.node("ShaderNodeMath", operation="MULTIPLY")
    times.inputs[1].default_value = 12.0
    stage.link(noise.outputs[0], times.inputs[0])
    stage.link(times.outputs[0], node.inputs["Density"])
    stage.link(node.outputs[0], socket)


def _from_mesh(stage: Stage) -> None:
    """Mesh to Volume: grids without a file."""
    source = stage.sphere(stage.material_of_ball, (0, 0, 0), 0.9)
    source.hide_render = True
    socket = _object(stage, ("density",))
    data = bpy.data.volumes.new("Made")
    data.materials.append(stage.material_of_ball)
    bpy.data.objects.remove(stage.ball)
    stage.ball = stage.object("Made", data, (0, 0, 1))
    modifier = stage.ball.modifiers.new("Made", "MESH_TO_VOLUME")
    modifier.object, modifier.density = source, 3.0
    stage.link(stage.node("ShaderNodeVolumePrincipled").outputs[0], socket)


_PRINCIPLED = "ShaderNodeVolumePrincipled"
feature("grids/principled", _smoky(_PRINCIPLED, Density=6.0), 2)
feature("grids/principled colored", _smoky(_PRINCIPLED, Density=6.0, Color=(0.3, 0.6, 0.9, 1)), 2)
feature("grids/principled dense", _smoky(_PRINCIPLED, Density=60.0, Color=(0.9, 0.9, 0.9, 1)), 2)
feature("grids/principled forward", _smoky(_PRINCIPLED, Density=6.0, Anisotropy=0.6), 2)
feature("grids/principled color attribute", _smoky(_PRINCIPLED, ("density", "color"), Density=6.0,
                                                  Color=(1, 1, 1, 1), Color_Attribute="color"), 2)  # fmt: skip
feature("grids/principled fire", _smoky(_PRINCIPLED, ("density", "temperature"), Density=3.0,
                                        Blackbody_Intensity=0.05, Temperature=3000.0), 2)  # fmt: skip
feature("grids/principled emission", _smoky(_PRINCIPLED, Density=2.0, Emission_Strength=0.3), 2)
feature("grids/principled other density", _smoky(_PRINCIPLED, ("density", "heat"), Density=6.0,
                                                 Density_Attribute="heat"), 2)  # fmt: skip
feature("grids/principled missing density", _smoky(_PRINCIPLED, Density=0.5, Density_Attribute="gone"), 2)
feature("grids/scatter", _smoky("ShaderNodeVolumeScatter", Color=(0.9, 0.7, 0.5, 1)), 2)
feature("grids/absorption", _smoky("ShaderNodeVolumeAbsorption", Color=(0.2, 0.5, 0.8, 1)), 2)
feature("grids/emission", _smoky("ShaderNodeEmission", Color=(1.0, 0.5, 0.1, 1)), 2)
feature("grids/placed", _placed, 2)
feature("grids/scaled", _scaled(_smoky(_PRINCIPLED, Density=2.0)), 2)
feature("grids/scaled in the world", _scaled(_smoky(_PRINCIPLED, Density=2.0), "WORLD"), 2)
feature("grids/scaled emission", _scaled(_smoky("ShaderNodeEmission", Color=(1.0, 0.5, 0.1, 1))), 2)
feature("grids/scaled fire", _scaled(_smoky(_PRINCIPLED, ("density", "temperature"), Density=1.0,
                                            Blackbody_Intensity=0.05, Temperature=3000.0)), 2)  # fmt: skip
feature("grids/volume info", _info, 2)
feature("grids/without a material", _without_material, 2)
feature("grids/cut by noise", _textured, 2)
feature("grids/mesh to volume", _from_mesh, 2)


def _pattern(change: Callable[[Stage, Any, Any], None], kind: str = "ShaderNodeVolumeScatter") -> Callable[..., None]:
    """The ball filled with a pattern; ``change`` makes it from the shader and the coordinates."""

    def build(stage: Stage) -> None:
        tree = stage.tree()
        tree.nodes.remove(tree.nodes["shader"])
        node = stage.node(kind)
        stage.link(node.outputs[0], tree.nodes["output"].inputs["Volume"])
        stage.scene.cycles.volume_biased = False
        change(stage, node, stage.node("ShaderNodeTexCoord"))

    return build


def _ramp(stage: Stage, node: Any, place: Any) -> None:
    noise, ramp = stage.node("ShaderNodeTexNoise", Scale=2.0), stage.node("ShaderNodeMapRange", From_Min=0.4)
    ramp.inputs["From Max"].default_value, ramp.inputs["To Max"].default_value = 0.6, 8.0
    stage.link(place.outputs["Object"], noise.inputs["Vector"])
    stage.link(noise.outputs[0], ramp.inputs["Value"])
    stage.link(ramp.outputs[0], node.inputs["Density"])


def _generated(stage: Stage, node: Any, place: Any) -> None:
    gradient = stage.node("ShaderNodeTexGradient", gradient_type="EASING")
    stage.link(place.outputs["Generated"], gradient.inputs["Vector"])
    times = stage.node("ShaderNodeMath", operation="MULTIPLY")
    times.inputs[1].default_value = 4.0
    stage.link(gradient.outputs[1], times.inputs[0])
    stage.link(times.outputs[0], node.inputs["Density"])
    stage.ball.scale, stage.ball.rotation_euler = (1.2, 0.8, 0.9), (0, 0.4, 0.5)


def _height(stage: Stage, node: Any, place: Any) -> None:
    """Fog that thins out with height in the world."""
    split = stage.node("ShaderNodeSeparateXYZ")
    stage.link(stage.node("ShaderNodeNewGeometry").outputs["Position"], split.inputs[0])
    fall = stage.node("ShaderNodeMath", operation="MULTIPLY_ADD")
    fall.inputs[1].default_value, fall.inputs[2].default_value = -1.5, 3.0
    stage.link(split.outputs[2], fall.inputs[0])
    stage.link(fall.outputs[0], node.inputs["Density"])


def _random(stage: Stage, node: Any, place: Any) -> None:
    times = stage.node("ShaderNodeMath", operation="MULTIPLY")
    times.inputs[1].default_value = 3.0
    stage.link(stage.node("ShaderNodeObjectInfo").outputs["Random"], times.inputs[0])
    stage.link(times.outputs[0], node.inputs["Density"])


def _fire(stage: Stage, node: Any, place: Any) -> None:
    noise = stage.node("ShaderNodeTexNoise", Scale=1.5)
    stage.link(place.outputs["Object"], noise.inputs["Vector"])
    stage.link(noise.outputs["Color"], node.inputs["Emission Color"])
    node.inputs["Emission Strength"].default_value, node.inputs["Density"].default_value = 0.6, 0.4


def _edge(stage: Stage, node: Any, place: Any) -> None:
    """A pattern with hard edges."""
    checker = stage.node("ShaderNodeTexChecker", Scale=2.5, Color1=(1, 0.2, 0.1, 1), Color2=(0.1, 0.4, 1, 1))
    stage.link(place.outputs["Object"], checker.inputs["Vector"])
    stage.link(checker.outputs[0], node.inputs["Color"])
    node.inputs["Density"].default_value = 2.0


def _mixed(stage: Stage, node: Any, place: Any) -> None:
    """Two volume shaders mixed by a gradient."""
    tree = stage.tree()
    other, mix = stage.node("ShaderNodeVolumeAbsorption", Density=3.0), stage.node("ShaderNodeMixShader")
    wave = stage.node("ShaderNodeTexWave", Scale=0.5)
    stage.link(place.outputs["Object"], wave.inputs["Vector"])
    stage.link(wave.outputs[1], mix.inputs[0])
    stage.link(node.outputs[0], mix.inputs[1])
    stage.link(other.outputs[0], mix.inputs[2])
    stage.link(mix.outputs[0], tree.nodes["output"].inputs["Volume"])
    node.inputs["Density"].default_value = 2.0


feature("grids/pattern with contrast", _pattern(_ramp), 2)
feature("grids/pattern over generated coordinates", _pattern(_generated), 2)
feature("grids/pattern by height", _pattern(_height), 2)
feature("grids/pattern of an object's random number", _pattern(_random), 2)
feature("grids/pattern of emission", _pattern(_fire, _PRINCIPLED), 2)
feature("grids/pattern with edges", _pattern(_edge), 2)
feature("grids/pattern of a mix", _pattern(_mixed), 2)

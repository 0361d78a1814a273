# SPDX-License-Identifier: GPL-3.0-or-later
"""Procedural textures, as color on the ball and as what drives bump, roughness and displacement."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy

from benchmarks.render.features import feature
from benchmarks.render.features.stage import Stage


def _modes(kind: str, name: str) -> list[str]:
    return [item.identifier for item in getattr(bpy.types, kind).bl_rna.properties[name].enum_items]


def _texture(
    kind: str, output: str | int = "Color", coordinate: str | None = "Object", **values: Any
) -> Callable[[Stage], None]:
    """The ball emits light with a texture over a coordinate."""

    def build(stage: Stage) -> None:
        node = stage.node(kind, **values)
        if coordinate is not None:
            stage.link(stage.node("ShaderNodeTexCoord").outputs[coordinate], node.inputs["Vector"])
        stage.glow(node.outputs[output])

    return build


for _kind in _modes("ShaderNodeTexNoise", "noise_type"):
    feature(f"textures/noise {_kind.lower()}", _texture("ShaderNodeTexNoise", "Fac", noise_type=_kind, Scale=1.5))
for _dimensions in ("1D", "2D", "4D"):
    feature(f"textures/noise {_dimensions}", lambda s, d=_dimensions: s.glow(
        s.node("ShaderNodeTexNoise", noise_dimensions=d, Scale=1.5).outputs["Color"]))  # fmt: skip
feature("textures/noise color", _texture("ShaderNodeTexNoise", "Color", Scale=1.5))
feature("textures/noise distorted", _texture("ShaderNodeTexNoise", "Fac", Scale=1.5, Distortion=1.0))
feature("textures/noise detailed", _texture("ShaderNodeTexNoise", "Fac", Scale=1.5, Detail=8.0, Roughness=0.7))
feature("textures/noise without coordinates", _texture("ShaderNodeTexNoise", "Fac", None, Scale=3.0))
for _kind in _modes("ShaderNodeTexVoronoi", "feature"):
    _out = {"DISTANCE_TO_EDGE": "Distance", "N_SPHERE_RADIUS": "Radius"}.get(_kind, "Distance")
    feature(f"textures/voronoi {_kind.lower()}", _texture("ShaderNodeTexVoronoi", _out, feature=_kind, Scale=1.5))
for _kind in _modes("ShaderNodeTexVoronoi", "distance"):
    feature(
        f"textures/voronoi {_kind.lower()}", _texture("ShaderNodeTexVoronoi", "Distance", distance=_kind, Scale=1.5)
    )
feature("textures/voronoi color", _texture("ShaderNodeTexVoronoi", "Color", Scale=1.5))
feature("textures/voronoi position", _texture("ShaderNodeTexVoronoi", "Position", Scale=1.5))
for _kind in _modes("ShaderNodeTexWave", "wave_type"):
    feature(f"textures/wave {_kind.lower()}", _texture("ShaderNodeTexWave", wave_type=_kind, Scale=0.7))
for _kind in _modes("ShaderNodeTexWave", "wave_profile"):
    feature(f"textures/wave {_kind.lower()}", _texture("ShaderNodeTexWave", wave_profile=_kind, Scale=0.7))
feature("textures/wave distorted", _texture("ShaderNodeTexWave", Scale=0.7, Distortion=3.0))
for _kind in _modes("ShaderNodeTexGradient", "gradient_type"):
    feature(f"textures/gradient {_kind.lower()}", _texture("ShaderNodeTexGradient", gradient_type=_kind))
feature("textures/magic", _texture("ShaderNodeTexMagic", Scale=1.5))
feature("textures/magic deep", _texture("ShaderNodeTexMagic", Scale=1.5, turbulence_depth=5, Distortion=2.0))
feature("textures/checker", _texture("ShaderNodeTexChecker", Scale=1.7))
feature("textures/brick", _texture("ShaderNodeTexBrick", Scale=1.3))
feature("textures/brick offset", _texture("ShaderNodeTexBrick", Scale=1.3, offset=0.3, squash=1.5))
feature("textures/white noise", _texture("ShaderNodeTexWhiteNoise", "Value"))
feature("textures/white noise of an index", lambda s: s.glow(
    s.node("ShaderNodeTexWhiteNoise", noise_dimensions="1D", W=4.0).outputs["Color"]))  # fmt: skip
feature("textures/gabor", _texture("ShaderNodeTexGabor", "Value", Scale=1.5))
feature("textures/gabor phase", _texture("ShaderNodeTexGabor", "Phase", Scale=1.0, Anisotropy=0.4, Frequency=1.0))
feature("textures/gabor 3D", _texture("ShaderNodeTexGabor", "Value", Scale=1.0, gabor_type="3D"))
feature("textures/gabor 3D isotropic",
        _texture("ShaderNodeTexGabor", "Intensity", Scale=1.0, gabor_type="3D", Anisotropy=0.0))  # fmt: skip
feature("textures/sky on a surface", _texture("ShaderNodeTexSky", "Color", None, sky_type="PREETHAM"))
for _coordinate in ("Generated", "UV", "Normal"):
    feature(f"textures/checker over {_coordinate}", _texture("ShaderNodeTexChecker", "Color", _coordinate, Scale=4.0))


def _mapped(stage: Stage) -> None:
    """The texture mapping in the side panel of every texture node."""
    _texture("ShaderNodeTexChecker", Scale=1.7)(stage)
    node = next(n for n in stage.tree().nodes if n.type == "TEX_CHECKER")
    node.texture_mapping.scale, node.texture_mapping.translation = (2.0, 0.7, 1.0), (0.3, 0.0, 0.1)


feature("textures/texture mapping panel", _mapped)


def _bump(
    kind: str, target: str = "Normal", shader: str = "ShaderNodeBsdfDiffuse", **values: Any
) -> Callable[[Stage], None]:
    def build(stage: Stage) -> None:
        node = stage.shader(shader)
        bump = stage.node(kind, **values)
        noise = stage.node("ShaderNodeTexNoise", Scale=2.0)
        stage.link(stage.node("ShaderNodeTexCoord").outputs["Object"], noise.inputs["Vector"])
        stage.link(noise.outputs["Fac" if kind == "ShaderNodeBump" else "Color"],
                   bump.inputs["Height" if kind == "ShaderNodeBump" else "Color"])  # fmt: skip
        stage.link(bump.outputs[0], node.inputs[target])

    return build


feature("textures/bump", _bump("ShaderNodeBump", Strength=1.0, Distance=0.3))
feature("textures/bump inverted", _bump("ShaderNodeBump", Strength=1.0, Distance=0.3, invert=True))
feature("textures/bump on glossy", _bump("ShaderNodeBump", "Normal", "ShaderNodeBsdfAnisotropic", Distance=0.3))
feature("textures/bump on coat", _bump("ShaderNodeBump", "Coat Normal", "ShaderNodeBsdfPrincipled", Distance=0.3))
for _space in ("TANGENT", "OBJECT", "WORLD"):
    feature(f"textures/normal map {_space.lower()}", _bump("ShaderNodeNormalMap", space=_space))


def _displaced(method: str) -> Callable[[Stage], None]:
    def build(stage: Stage) -> None:
        stage.material_of_ball.displacement_method = method
        noise = stage.node("ShaderNodeTexNoise", Scale=1.5)
        stage.link(stage.node("ShaderNodeTexCoord").outputs["Object"], noise.inputs["Vector"])
        displacement = stage.node("ShaderNodeDisplacement", Scale=0.5)
        stage.link(noise.outputs["Fac"], displacement.inputs["Height"])
        stage.link(displacement.outputs[0], stage.tree().nodes["output"].inputs["Displacement"])

    return build


for _method in ("BUMP", "DISPLACEMENT", "BOTH"):
    feature(f"textures/displacement {_method.lower()}", _displaced(_method))


def _roughness(stage: Stage) -> None:
    shader = stage.shader("ShaderNodeBsdfAnisotropic")
    noise = stage.node("ShaderNodeTexNoise", Scale=2.0)
    stage.link(stage.node("ShaderNodeTexCoord").outputs["Object"], noise.inputs["Vector"])
    stage.link(noise.outputs["Fac"], shader.inputs["Roughness"])


feature("textures/noise into roughness", _roughness)

# SPDX-License-Identifier: GPL-3.0-or-later
"""Further scenes of hair, inputs, images and volumes: unusual values, and nodes in rarely used modes."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from benchmarks.render.features import feature
from benchmarks.render.features.shading.further import BASE, TINT, Build, driven, made, noise, ranged
from benchmarks.render.features.shading.hair import patch, strands, tuft
from benchmarks.render.features.stage import Stage

HAIR, PIGMENT = "BsdfHairPrincipled", {"parametrization": "MELANIN"}

# --- hair -----------------------------------------------------------------------------------------------------------


def _combed(build: Build, shape: Build = patch) -> Build:
    return lambda stage: (build(stage), shape(stage))


_STRANDS: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "black": (PIGMENT, {"Melanin": 1.0}),
    "white": (PIGMENT, {"Melanin": 0.0}),
    "red": (PIGMENT, {"Melanin": 0.6, "Melanin_Redness": 1.0, "Roughness": 0.5}),
    "coat and random roughness": (PIGMENT, {"Melanin": 0.4, "Coat": 0.5, "Random_Roughness": 0.6}),
    "rough along": ({}, {"Color": (0.5, 0.3, 0.15, 1), "Roughness": 0.9, "Radial_Roughness": 0.2}),
    "of a dark color": ({}, {"Color": (0.05, 0.03, 0.02, 1), "Offset": -0.1}),
}
for _name, (_properties, _inputs) in _STRANDS.items():
    feature(f"hair/strands {_name}", _combed(made(HAIR, _properties, **_inputs)), 2)
feature("hair/tuft with random color", _combed(made(HAIR, PIGMENT, Melanin=0.5, Random_Color=0.7), tuft), 2)
feature("hair/transmission lobe, rough", _combed(made(
    "BsdfHair", {"component": "Transmission"}, Color=BASE, RoughnessU=0.8, RoughnessV=0.3)), 2)  # fmt: skip
feature("hair/diffuse strands", _combed(made("BsdfDiffuse", Color=BASE), tuft), 2)
feature("hair/principled strands", _combed(made("BsdfPrincipled", Base_Color=BASE, Roughness=0.3), tuft), 2)


def _along(stage: Stage) -> None:
    """Color from root to tip, which a ramp tells by the intercept."""
    shader, ramp = made(HAIR)(stage), stage.node("ShaderNodeValToRGB")
    ramp.color_ramp.elements[0].color, ramp.color_ramp.elements[1].color = (0.1, 0.05, 0.02, 1), (0.9, 0.7, 0.4, 1)
    stage.link(stage.node("ShaderNodeHairInfo").outputs["Intercept"], ramp.inputs[0])
    stage.link(ramp.outputs[0], shader.inputs["Color"])
    tuft(stage)


def _tapered(stage: Stage) -> None:
    """Thick strands that end in a tip."""
    made(HAIR, Color=BASE)(stage)
    points = np.zeros((60, 5, 3))
    points[..., 0] = np.linspace(-1, 1, 60)[:, None]
    points[..., 2] = np.linspace(0.0, 2.0, 5)
    bpy.data.objects.remove(stage.ball)
    strands(stage, points, 0.03)
    radii = stage.scene.objects["Strands"].data.attributes["radius"]
    radii.data.foreach_set("value", np.tile(np.linspace(0.03, 0.002, 5), 60).astype(np.float32))


feature("hair/color along strands", _along, 2)
feature("hair/tapered", _tapered, 2)

# --- inputs ---------------------------------------------------------------------------------------------------------


def _shown(kind: str, output: str, **values: Any) -> Build:
    return lambda stage: stage.glow(stage.node(f"ShaderNode{kind}", **values).outputs[output])


def _bumpy(kind: str, output: str, **values: Any) -> Build:
    """An output of a node whose normal is bumpy."""

    def build(stage: Stage) -> None:
        node, bump = stage.node(f"ShaderNode{kind}", **values), stage.node("ShaderNodeBump", Strength=0.8, Distance=0.3)
        stage.link(noise(stage, 4.0), bump.inputs["Height"])
        stage.link(bump.outputs[0], node.inputs["Normal"])
        stage.glow(node.outputs[output])

    return build


for _output in ("Glossy Depth", "Transmission Depth", "Portal Depth", "Is Volume Scatter Ray"):
    feature(f"inputs/light path {_output}", _shown("LightPath", _output))
feature("inputs/fresnel of bump", _bumpy("Fresnel", "Fac", IOR=1.8))
feature("inputs/fresnel below 1", _shown("Fresnel", "Fac", IOR=0.7))
feature("inputs/layer weight of bump", _bumpy("LayerWeight", "Facing", Blend=0.6))
feature("inputs/layer weight blend of noise", lambda s: (lambda node: (
    s.link(ranged(s, noise(s), 0.0, 1.0), node.inputs["Blend"]), s.glow(node.outputs["Fresnel"])))(
    s.node("ShaderNodeLayerWeight")))  # fmt: skip
feature("inputs/wireframe in pixels", _shown("Wireframe", "Fac", use_pixel_size=True, Size=1.5))
feature("inputs/ambient occlusion of a color", _shown("AmbientOcclusion", "Color", Color=TINT, Distance=2.0), 2)
for _name in ("position", "UVMap", "sharp_face", "normal"):
    feature(f"inputs/attribute {_name}", _shown("Attribute", "Vector", attribute_name=_name))
feature("inputs/blackbody 1500 K, shown", _shown("Blackbody", "Color", Temperature=1500.0))
for _nanometers in (450.0, 605.0):
    feature(f"inputs/wavelength {_nanometers:g}", _shown("Wavelength", "Color", Wavelength=_nanometers))
feature("inputs/pointiness of a mask", lambda s: s.into_color(ranged(
    s, s.node("ShaderNodeNewGeometry").outputs["Pointiness"], 0.0, 1.0)))  # fmt: skip
feature("inputs/ray length as a color", lambda s: (
    s.set_world((0.4, 0.4, 0.4)), s.into_color(s.node("ShaderNodeLightPath").outputs["Ray Length"])))  # fmt: skip

# --- images ---------------------------------------------------------------------------------------------------------


def _generated(kind: str) -> Build:
    def build(stage: Stage) -> None:
        node = stage.node("ShaderNodeTexImage")
        node.image = bpy.data.images.new("Generated", 64, 32)
        node.image.source, node.image.generated_type = "GENERATED", kind
        stage.into_color(node.outputs["Color"])

    return build


def _saved(kind: str, depth: str = "8", mode: str = "RGB", into: str = "") -> Build:
    """A picture read from a file of a type; ``into``: a socket of Principled that it drives."""

    def build(stage: Stage) -> None:
        folder = Path(tempfile.gettempdir()) / "spectral_feature_images"
        folder.mkdir(exist_ok=True)
        path, image = folder / f"{kind}{depth}{mode}.img", stage.image("Saved", (32, 16), float_buffer=depth != "8")
        settings = stage.scene.render.image_settings
        settings.file_format, settings.color_mode = kind, mode
        if kind not in ("JPEG", "HDR", "BMP", "TARGA", "WEBP"):
            settings.color_depth = depth
        image.save_render(str(path), scene=stage.scene)
        node = stage.node("ShaderNodeTexImage")
        node.image = bpy.data.images.load(str(path), check_existing=False)
        if into:
            shader = made("BsdfPrincipled", Base_Color=BASE)(stage)
            node.image.colorspace_settings.name = "Non-Color"
            stage.link(node.outputs["Color"], shader.inputs[into])
        else:
            stage.into_color(node.outputs["Color"])

    return build


for _kind in ("UV_GRID", "COLOR_GRID"):
    feature(f"images/generated {_kind}", _generated(_kind))
for _kind, _depth, _mode in (("PNG", "16", "RGB"), ("PNG", "8", "BW"), ("JPEG", "8", "RGB"), ("OPEN_EXR", "16", "RGB"),
                             ("OPEN_EXR", "32", "RGB"), ("HDR", "32", "RGB"), ("TIFF", "16", "RGB"),
                             ("TARGA", "8", "RGB"), ("WEBP", "8", "RGB")):  # fmt: skip
    feature(f"images/file {_kind} {_depth} {_mode}", _saved(_kind, _depth, _mode))
feature("images/file as data into roughness", _saved("PNG", "8", "BW", "Roughness"))


def _warped(stage: Stage, kind: str = "TEXTURE", **options: Any) -> Any:
    """Coordinates that noise distorts, and a Mapping of another type."""
    node = stage.node("ShaderNodeTexImage", **options)
    node.image = stage.image(alpha=True)
    mapping, add = stage.node("ShaderNodeMapping", vector_type=kind), stage.node("ShaderNodeVectorMath")
    if kind != "NORMAL":
        mapping.inputs["Rotation"].default_value, mapping.inputs["Scale"].default_value = (0, 0, 0.5), (0.4, 0.7, 1)
    stage.link(stage.node("ShaderNodeTexCoord").outputs["UV"], add.inputs[0])
    stage.link(noise(stage, 2.0, 1), add.inputs[1])
    stage.link(add.outputs[0], mapping.inputs["Vector"])
    stage.link(mapping.outputs[0], node.inputs["Vector"])
    return node


for _kind in ("TEXTURE", "VECTOR", "NORMAL"):
    feature(f"images/mapping {_kind.lower()}, warped", lambda s, k=_kind: s.into_color(_warped(s, k).outputs["Color"]))
feature("images/alpha as a number", lambda s: s.into_color(_warped(s).outputs["Alpha"]))
feature("images/clipped alpha", lambda s: s.link(
    _warped(s, extension="CLIP").outputs["Alpha"], made("BsdfPrincipled")(s).inputs["Alpha"]))  # fmt: skip

# --- volumes --------------------------------------------------------------------------------------------------------


def _filled(kind: str, surface: str = "", properties: dict[str, Any] | None = None, **inputs: Any) -> Build:
    def build(stage: Stage) -> Any:
        tree = stage.tree()
        if surface:
            stage.shader(f"ShaderNode{surface}")
        else:
            tree.nodes.remove(tree.nodes["shader"])
        node = stage.node(f"ShaderNode{kind}", **(properties or {}))
        for name, value in inputs.items():
            node.inputs[name.replace("_", " ")].default_value = value
        stage.link(node.outputs[0], tree.nodes["output"].inputs["Volume"])
        stage.scene.cycles.volume_biased = False
        return node

    return build


feature("volumes/dense", _filled("VolumeScatter", Color=TINT, Density=20.0), 2)
feature("volumes/forward", _filled("VolumeScatter", Color=(0.9, 0.9, 0.9, 1), Density=4.0, Anisotropy=0.9), 2)
feature("volumes/principled backward", _filled(
    "VolumePrincipled", Color=(0.8, 0.6, 0.4, 1), Density=2.0, Anisotropy=-0.5), 2)  # fmt: skip
feature("volumes/fire", _filled(
    "VolumePrincipled", Density=1.0, Color=(0.1, 0.1, 0.1, 1), Blackbody_Intensity=0.05, Temperature=1800.0,
    Blackbody_Tint=(1, 0.6, 0.3, 1)), 2)  # fmt: skip
feature("volumes/mie", _filled("VolumeScatter", properties={"phase": "MIE"}, Density=2.0, Diameter=5.0), 2)
feature("volumes/draine", _filled(
    "VolumeScatter", properties={"phase": "DRAINE"}, Density=2.0, Anisotropy=0.6, Alpha=0.8), 2)  # fmt: skip
feature("volumes/water", _filled(
    "VolumeScatter", properties={"phase": "FOURNIER_FORAND"}, Density=2.0, IOR=1.2, Backscatter=0.05), 2)  # fmt: skip
feature("volumes/coefficients of all kinds", _filled(
    "VolumeCoefficients", Absorption_Coefficients=(0.5, 0.2, 0.1), Scatter_Coefficients=(0.3, 0.6, 1.2),
    Emission_Coefficients=(0.05, 0.02, 0.0)), 2)  # fmt: skip
feature("volumes/absorption of noise", driven(
    _filled("VolumeAbsorption", Color=TINT, Density=1.0), "Density", 0.0, 3.0), 2)  # fmt: skip
feature(
    "volumes/glass filled with milk", _filled("VolumeScatter", "BsdfGlass", Color=(1, 0.95, 0.9, 1), Density=3.0), 4
)


def _joined(kind: str) -> Build:
    """Scattering and absorption, mixed or added."""

    def build(stage: Stage) -> None:
        first = _filled("VolumeScatter", Color=TINT, Density=2.0)(stage)
        second = stage.node("ShaderNodeVolumeAbsorption", Color=(0.9, 0.5, 0.2, 1), Density=1.5)
        node = stage.node(kind)
        inputs = [socket for socket in node.inputs if socket.type == "SHADER"]
        stage.link(first.outputs[0], inputs[0])
        stage.link(second.outputs[0], inputs[1])
        stage.link(node.outputs[0], stage.tree().nodes["output"].inputs["Volume"])

    return build


feature("volumes/mixed", _joined("ShaderNodeMixShader"), 2)
feature("volumes/added", _joined("ShaderNodeAddShader"), 2)


def _in_front(build: Build) -> Build:
    """A ball of subsurface scattering inside a cloud."""

    def run(stage: Stage) -> None:
        build(stage)
        skin = stage.material("Skin", "ShaderNodeSubsurfaceScattering", Color=BASE, Scale=0.2)
        stage.sphere(skin, (0, 0, 1), 0.5)

    return run


feature("volumes/around subsurface", _in_front(_filled("VolumeScatter", Color=(1, 1, 1, 1), Density=0.5)), 2)

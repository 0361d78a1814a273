# SPDX-License-Identifier: GPL-3.0-or-later
"""Further scenes of closures: unusual values, sockets that textures drive, rarely used modes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks.render.features import feature
from benchmarks.render.features.stage import Stage

Build = Callable[[Stage], Any]
BASE, TINT = (0.75, 0.4, 0.15, 1), (0.25, 0.55, 0.85, 1)


def made(kind: str, properties: dict[str, Any] | None = None, **inputs: Any) -> Build:
    """The ball made of one shader; properties first, because sockets follow them."""

    def build(stage: Stage) -> Any:
        node = stage.shader(f"ShaderNode{kind}")
        for name, value in (properties or {}).items():
            setattr(node, name, value)
        for name, value in inputs.items():
            node.inputs[name.replace("_", " ")].default_value = value
        return node

    return build


def noise(stage: Stage, scale: float = 3.0, output: int = 0) -> Any:
    """Output of a noise over Object coordinates."""
    node = stage.node("ShaderNodeTexNoise", Scale=scale)
    stage.link(stage.node("ShaderNodeTexCoord").outputs["Object"], node.inputs["Vector"])
    return node.outputs[output]


def ranged(stage: Stage, output: Any, low: float, high: float) -> Any:
    """An output of 0.3 to 0.7 brought to a range."""
    node = stage.node("ShaderNodeMapRange")
    for name, value in (("From Min", 0.3), ("From Max", 0.7), ("To Min", low), ("To Max", high)):
        node.inputs[name].default_value = value
    stage.link(output, node.inputs["Value"])
    return node.outputs[0]


def driven(build: Build, socket: str, low: float, high: float) -> Build:
    """A socket of the shader driven by noise."""

    def run(stage: Stage) -> Any:
        shader = build(stage)
        stage.link(ranged(stage, noise(stage), low, high), shader.inputs[socket])
        return shader

    return run


def bumped(build: Build, socket: str = "Normal") -> Build:
    """A shader about a bumpy normal."""

    def run(stage: Stage) -> Any:
        shader = build(stage)
        bump = stage.node("ShaderNodeBump", Strength=0.7, Distance=0.3)
        stage.link(noise(stage, 4.0), bump.inputs["Height"])
        stage.link(bump.outputs[0], shader.inputs[socket])
        return shader

    return run


GLOSSY, GLASS, SSS, PRINCIPLED = "BsdfAnisotropic", "BsdfGlass", "SubsurfaceScattering", "BsdfPrincipled"
COLORED = (0.9, 0.45, 0.2, 1)

# --- diffuse, glossy, glass -----------------------------------------------------------------------------------------
feature("closures/diffuse roughness of noise", driven(made("BsdfDiffuse", Color=BASE), "Roughness", 0.0, 1.0))
feature("closures/diffuse bump", bumped(made("BsdfDiffuse", Color=BASE, Roughness=0.5)))
feature("closures/glossy roughness of noise", driven(made(GLOSSY, Color=BASE), "Roughness", 0.05, 0.6))
feature("closures/glossy beckmann turned", made(
    GLOSSY, {"distribution": "BECKMANN"}, Color=BASE, Roughness=0.5, Anisotropy=-0.6, Rotation=0.2))  # fmt: skip
feature("closures/glossy single scattering turned", made(
    GLOSSY, {"distribution": "GGX"}, Color=BASE, Roughness=0.35, Anisotropy=0.5, Rotation=0.3))  # fmt: skip
feature("closures/glossy bump", bumped(made(GLOSSY, Color=BASE, Roughness=0.3)))
for _model, _rough, _ior in (("MULTI_GGX", 0.6, 1.3), ("GGX", 0.2, 2.4), ("BECKMANN", 0.6, 1.7)):
    feature(f"closures/glass colored {_model} {_rough:g}", made(
        GLASS, {"distribution": _model}, Color=COLORED, Roughness=_rough, IOR=_ior), 3)  # fmt: skip
    if _model != "MULTI_GGX":
        feature(f"closures/refraction colored {_model} {_rough:g}", made(
            "BsdfRefraction", {"distribution": _model}, Color=COLORED, Roughness=_rough, IOR=_ior), 3)  # fmt: skip
feature("closures/glass roughness of noise", driven(made(GLASS, Color=COLORED), "Roughness", 0.1, 0.7), 3)
feature("closures/glass bump", bumped(made(GLASS, Roughness=0.3)), 3)
feature("closures/metallic gold, rough", made(
    "BsdfMetallic", {"fresnel_type": "PHYSICAL_CONDUCTOR"}, Roughness=0.7, IOR=(0.18, 0.42, 1.37),
    Extinction=(3.42, 2.35, 1.77)))  # fmt: skip
feature("closures/metallic turned", made("BsdfMetallic", Roughness=0.4, Anisotropy=0.7, Rotation=0.4))
feature("closures/metallic bump", bumped(made("BsdfMetallic", Base_Color=BASE, Roughness=0.25)))
for _rough in (0.05, 0.95):
    feature(f"closures/sheen {_rough:g}", made("BsdfSheen", Color=BASE, Roughness=_rough))
feature("closures/sheen bump", bumped(made("BsdfSheen", Color=BASE)))
feature("closures/toon smooth", made("BsdfToon", Color=BASE, Size=0.3, Smooth=0.6))
feature("closures/toon glossy smooth", made("BsdfToon", {"component": "GLOSSY"}, Color=BASE, Size=0.4, Smooth=0.3))
feature("closures/toon bump", bumped(made("BsdfToon", Color=BASE, Size=0.5, Smooth=0.2)))
feature("closures/translucent bump", bumped(made("BsdfTranslucent", Color=BASE)))
feature("closures/translucent of noise", lambda s: s.link(
    noise(s, 3.0, 1), made("BsdfTranslucent")(s).inputs["Color"]))  # fmt: skip


def _thin(shader: str) -> Build:
    """A sheet that stands between the lamp and the camera."""

    def build(stage: Stage) -> None:
        import bpy

        made(shader, Color=BASE)(stage)
        bpy.data.objects.remove(stage.ball)
        stage.ball = stage.plane(2.0, stage.material_of_ball, (0, 0, 1.0), (np.pi / 2 - 0.2, 0, 0.4))
        stage.lamp.location, stage.lamp.rotation_euler = (0.5, 3.0, 3.5), (-0.75, 0, 0)

    return build


feature("closures/translucent sheet", _thin("BsdfTranslucent"))
feature("closures/sheen sheet", _thin("BsdfSheen"))

# --- subsurface scattering ------------------------------------------------------------------------------------------
_BELOW: dict[str, dict[str, Any]] = {
    "ior and roughness": {"IOR": 1.1, "Roughness": 0.2, "Scale": 0.2},
    "ior 2": {"IOR": 2.0, "Roughness": 0.6, "Scale": 0.2},
    "anisotropy": {"Anisotropy": 0.7, "Scale": 0.25},
    "dark": {"Color": (0.12, 0.05, 0.02, 1), "Scale": 0.3},
    "white": {"Color": (1, 1, 1, 1), "Scale": 0.1},
    "no red radius": {"Radius": (0.0, 0.3, 1.0), "Scale": 0.3},
    "large": {"Scale": 3.0, "Radius": (1.0, 0.8, 0.6)},
}
for _name, _inputs in _BELOW.items():
    feature(f"closures/subsurface {_name}", made(SSS, **({"Color": BASE} | _inputs)), 2)
for _model, _scale in (("RANDOM_WALK_SKIN", 0.05), ("BURLEY", 1.0), ("BURLEY", 0.1)):
    _own = {"IOR": 1.6} if "SKIN" in _model else {}
    feature(f"closures/subsurface {_model} {_scale:g}", made(
        SSS, {"falloff": _model}, Color=(0.85, 0.5, 0.35, 1), Scale=_scale, **_own), 2)  # fmt: skip
feature("closures/subsurface scale of noise", driven(made(SSS, Color=BASE), "Scale", 0.0, 0.4), 2)
feature("closures/subsurface radius of noise", lambda s: s.link(
    noise(s, 3.0, 1), made(SSS, Color=BASE, Scale=0.3)(s).inputs["Radius"]), 2)  # fmt: skip
feature("closures/subsurface color of noise", lambda s: s.link(
    noise(s, 3.0, 1), made(SSS, Scale=0.2)(s).inputs["Color"]), 2)  # fmt: skip
feature("closures/subsurface bump", bumped(made(SSS, Color=BASE, Scale=0.1)), 2)


def _on_cube(build: Build) -> Build:
    def run(stage: Stage) -> None:
        import bpy

        build(stage)
        bpy.data.objects.remove(stage.ball)
        stage.ball = stage.cube(stage.material_of_ball, (0, 0, 0.75), 1.4, (0, 0, 0.6))

    return run


feature("closures/subsurface cube", _on_cube(made(SSS, Color=BASE, Scale=0.3)), 2)
feature("closures/subsurface Burley cube", _on_cube(made(SSS, {"falloff": "BURLEY"}, Color=BASE, Scale=0.6)), 2)
feature("closures/subsurface, few bounces", lambda s: (
    made(SSS, Color=BASE, Scale=0.3)(s), setattr(s.scene.cycles, "diffuse_bounces", 1)), 2)  # fmt: skip

# --- principled -----------------------------------------------------------------------------------------------------
_MIXED: dict[str, dict[str, Any]] = {
    "subsurface anisotropy": {"Subsurface_Weight": 1.0, "Subsurface_Scale": 0.2, "Subsurface_Anisotropy": 0.8},
    "subsurface under coat": {"Subsurface_Weight": 1.0, "Subsurface_Scale": 0.15, "Coat_Weight": 1.0},
    "subsurface under sheen": {"Subsurface_Weight": 0.7, "Subsurface_Scale": 0.1, "Sheen_Weight": 1.0},
    "subsurface, rough": {"Subsurface_Weight": 1.0, "Subsurface_Scale": 0.3, "Roughness": 1.0, "IOR": 1.2},
    "subsurface, glossy": {"Subsurface_Weight": 1.0, "Subsurface_Scale": 0.3, "Roughness": 0.1, "IOR": 1.8},
    "transmission colored, rough": {"Transmission_Weight": 1.0, "Roughness": 0.9},
    "transmission of low index": {"Transmission_Weight": 1.0, "Roughness": 0.3, "IOR": 1.1},
    "transmission of high index": {"Transmission_Weight": 1.0, "Roughness": 0.25, "IOR": 2.2},
    "transmission over metal": {"Transmission_Weight": 0.6, "Metallic": 0.4, "Roughness": 0.3},
    "coat, all rough": {"Coat_Weight": 1.0, "Coat_Roughness": 1.0, "Roughness": 0.9},
    "coat of low index": {"Coat_Weight": 1.0, "Coat_IOR": 1.1, "Coat_Tint": TINT},
    "coat and sheen": {"Coat_Weight": 0.6, "Sheen_Weight": 0.8, "Sheen_Roughness": 0.3, "Sheen_Tint": TINT},
    "half a coat, tinted": {"Coat_Weight": 0.5, "Coat_Tint": TINT, "Coat_Roughness": 0.2},
    "diffuse roughness and metal": {"Diffuse_Roughness": 0.5, "Metallic": 0.3},
    "high specular level": {"Specular_IOR_Level": 0.9, "Specular_Tint": TINT, "IOR": 2.0, "Roughness": 0.4},
    "film on rough glass": {
        "Transmission_Weight": 1.0, "Thin_Film_Thickness": 600.0, "Thin_Film_IOR": 2.0, "Roughness": 0.25,
    },
    "everything": {
        "Metallic": 0.2, "Roughness": 0.4, "Subsurface_Weight": 0.4, "Subsurface_Scale": 0.1, "Coat_Weight": 0.5,
        "Sheen_Weight": 0.5, "Transmission_Weight": 0.3, "Alpha": 0.9, "Emission_Strength": 0.1, "Anisotropic": 0.4,
    },
}  # fmt: skip
for _name, _inputs in _MIXED.items():
    _noisy = any(word in name for name in _inputs for word in ("Transmission", "Subsurface"))
    feature(f"principled/{_name}", made(PRINCIPLED, **({"Base_Color": BASE} | _inputs)), 2 if _noisy else 1)
feature("principled/skin of high index", made(
    PRINCIPLED, {"subsurface_method": "RANDOM_WALK_SKIN"}, Base_Color=(0.8, 0.5, 0.4, 1), Subsurface_Weight=1.0,
    Subsurface_Scale=0.05, Subsurface_IOR=2.0), 2)  # fmt: skip
_DRIVEN = {"Sheen Weight": (0, 1), "Diffuse Roughness": (0, 1), "Coat Roughness": (0, 0.8), "Metallic": (0, 1),
           "Transmission Weight": (0, 1), "Emission Strength": (0, 1), "Anisotropic Rotation": (0, 1),
           "Subsurface Scale": (0, 0.3), "Coat Weight": (0, 1), "Sheen Roughness": (0.1, 1)}  # fmt: skip
for _socket, (_low, _high) in _DRIVEN.items():
    _given: dict[str, Any] = {"Base_Color": BASE}
    if "Rotation" in _socket:
        _given |= {"Anisotropic": 0.8, "Metallic": 1.0}
    for _kind in ("Sheen", "Coat", "Subsurface"):
        if _socket.startswith(_kind) and "Weight" not in _socket:
            _given[f"{_kind}_Weight"] = 1.0
    feature(f"principled/noise into {_socket}", driven(made(PRINCIPLED, **_given), _socket, _low, _high), 2)
feature("principled/bump of a coated metal", bumped(made(PRINCIPLED, Base_Color=BASE, Metallic=1.0, Coat_Weight=0.5)))
feature("principled/bump below a plain coat", bumped(made(PRINCIPLED, Base_Color=BASE, Coat_Weight=1.0)))
feature("principled/bump of the coat alone", bumped(made(PRINCIPLED, Base_Color=BASE, Coat_Weight=1.0), "Coat Normal"))
feature("principled/bump of glass", bumped(made(PRINCIPLED, Transmission_Weight=1.0, Roughness=0.2)), 3)
feature("principled/bump of subsurface", bumped(
    made(PRINCIPLED, Base_Color=BASE, Subsurface_Weight=1.0, Subsurface_Scale=0.1)), 2)  # fmt: skip

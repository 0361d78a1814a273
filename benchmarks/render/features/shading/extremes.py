# SPDX-License-Identifier: GPL-3.0-or-later
"""Closures at the ends of their ranges, and mixes and sums of many."""

from __future__ import annotations

from typing import Any

from benchmarks.render.features import feature
from benchmarks.render.features.shading.further import (
    BASE,
    GLASS,
    GLOSSY,
    PRINCIPLED,
    SSS,
    TINT,
    Build,
    bumped,
    made,
    noise,
)
from benchmarks.render.features.stage import Stage

WHITE = (1, 1, 1, 1)

for _rough in (0.02, 1.0):
    feature(f"extremes/metal roughness {_rough:g}", made(PRINCIPLED, Base_Color=BASE, Metallic=1.0, Roughness=_rough))
    feature(f"extremes/white glass roughness {_rough:g}", made(GLASS, Roughness=_rough), 3)
    feature(f"extremes/colored glass roughness {_rough:g}", made(GLASS, Color=BASE, Roughness=_rough), 3)
    feature(f"extremes/transmission roughness {_rough:g}", made(
        PRINCIPLED, Base_Color=BASE, Transmission_Weight=1.0, Roughness=_rough), 3)  # fmt: skip
    feature(f"extremes/sheen roughness {_rough:g}", made(
        PRINCIPLED, Base_Color=BASE, Sheen_Weight=1.0, Sheen_Roughness=_rough))  # fmt: skip
    feature(f"extremes/film on metal roughness {_rough:g}", made(
        "BsdfMetallic", Roughness=_rough, Thin_Film_Thickness=350.0, Thin_Film_IOR=1.4))  # fmt: skip
feature("extremes/transmission roughness 0.7", made(
    PRINCIPLED, Base_Color=BASE, Transmission_Weight=1.0, Roughness=0.7), 3)  # fmt: skip
for _index in (1.01, 3.0):
    feature(f"extremes/glass index {_index:g}", made(GLASS, Roughness=0.2, IOR=_index), 3)
    feature(f"extremes/principled index {_index:g}", made(PRINCIPLED, Base_Color=BASE, IOR=_index, Roughness=0.3))
    feature(f"extremes/transmission index {_index:g}", made(
        PRINCIPLED, Base_Color=BASE, IOR=_index, Transmission_Weight=1.0, Roughness=0.1), 3)  # fmt: skip
    feature(f"extremes/coat index {_index:g}", made(PRINCIPLED, Base_Color=BASE, Coat_Weight=1.0, Coat_IOR=_index))
    feature(f"extremes/subsurface index {_index:g}", made(SSS, Color=BASE, IOR=_index, Roughness=0.3, Scale=0.2), 2)


def _along_uv(build: Build) -> Build:
    """A shader whose tangent follows the UV map."""

    def run(stage: Stage) -> Any:
        shader = build(stage)
        tangent = stage.node("ShaderNodeTangent", direction_type="UV_MAP")
        stage.link(tangent.outputs[0], shader.inputs["Tangent"])
        return shader

    return run


for _amount in (-1.0, 1.0):
    feature(f"extremes/anisotropy {_amount:g}", made(GLOSSY, Color=BASE, Roughness=0.4, Anisotropy=_amount))
    feature(f"extremes/anisotropy {_amount:g} along the UV map", _along_uv(
        made(GLOSSY, Color=BASE, Roughness=0.4, Anisotropy=_amount)))  # fmt: skip
feature("extremes/anisotropic metal along the UV map", _along_uv(
    made(PRINCIPLED, Base_Color=BASE, Metallic=1.0, Roughness=0.5, Anisotropic=1.0)))  # fmt: skip
feature("extremes/anisotropic dielectric", made(PRINCIPLED, Base_Color=BASE, Roughness=0.2, Anisotropic=1.0, IOR=2.0))
feature("extremes/black coat", made(PRINCIPLED, Base_Color=BASE, Coat_Weight=1.0, Coat_Tint=(0, 0, 0, 1)))
feature("extremes/coat tint over transmission", made(
    PRINCIPLED, Base_Color=BASE, Transmission_Weight=1.0, Roughness=0.1, Coat_Weight=1.0,
    Coat_Tint=TINT), 3)  # fmt: skip
for _thickness in (5.0, 120.0, 5000.0):
    feature(f"extremes/film of {_thickness:g} nm", made(
        PRINCIPLED, Base_Color=BASE, Roughness=0.2, Thin_Film_Thickness=_thickness, Thin_Film_IOR=1.8))  # fmt: skip
feature("extremes/film of the base's index", made(
    PRINCIPLED, Base_Color=BASE, Roughness=0.2, Thin_Film_Thickness=400.0, Thin_Film_IOR=1.5))  # fmt: skip
_BELOW: dict[str, dict[str, Any]] = {
    "scale 0": {"Scale": 0.0},
    "scale 10": {"Scale": 10.0},
    "backward": {"Anisotropy": -0.9, "Scale": 0.2},
    "forward": {"Anisotropy": 0.95, "Scale": 0.2},
    "one deep channel": {"Radius": (3.0, 0.01, 0.01), "Scale": 0.3},
    "of a saturated color": {"Color": (1.0, 0.0, 0.0, 1), "Scale": 0.2},
}
for _name, _inputs in _BELOW.items():
    feature(f"extremes/subsurface {_name}", made(SSS, **({"Color": BASE} | _inputs)), 2)
for _color, _edge in (((0, 0, 0, 1), WHITE), (WHITE, (0, 0, 0, 1)), (BASE, TINT)):
    feature(f"extremes/metal {_color[0]:g} with edge {_edge[0]:g}", made(
        "BsdfMetallic", Base_Color=_color, Edge_Tint=_edge, Roughness=0.3))  # fmt: skip
feature("extremes/metal of index 0 and no extinction", made(
    "BsdfMetallic", {"fresnel_type": "PHYSICAL_CONDUCTOR"}, IOR=(0.05, 1.0, 4.0), Extinction=(0.0, 1.0, 0.1),
    Roughness=0.3))  # fmt: skip
for _size, _smooth in ((0.0, 0.0), (1.0, 1.0), (0.9, 0.0)):
    for _part in ("DIFFUSE", "GLOSSY"):
        feature(f"extremes/toon {_part} {_size:g} {_smooth:g}", made(
            "BsdfToon", {"component": _part}, Color=BASE, Size=_size, Smooth=_smooth))  # fmt: skip


def _combined(kinds: tuple[str, ...], node: str, factor: float = 0.5, **inputs: dict[str, Any]) -> Build:
    """Shaders added, or mixed one after another with what came before."""

    def build(stage: Stage) -> None:
        last = made(kinds[0], **inputs.get(kinds[0], {}))(stage).outputs[0]
        for kind in kinds[1:]:
            other, both = stage.node(f"ShaderNode{kind}"), stage.node(node)
            for name, value in inputs.get(kind, {}).items():
                other.inputs[name.replace("_", " ")].default_value = value
            places = [socket for socket in both.inputs if socket.type == "SHADER"]
            if node == MIX:
                both.inputs[0].default_value = factor
            stage.link(last, places[0])
            stage.link(other.outputs[0], places[1])
            last = both.outputs[0]
        stage.link(last, stage.tree().nodes["output"].inputs["Surface"])

    return build


MIX, ADD = "ShaderNodeMixShader", "ShaderNodeAddShader"
_DIM: dict[str, dict[str, Any]] = {
    "BsdfDiffuse": {"Color": (0.2, 0.1, 0.05, 1)},
    GLOSSY: {"Color": (0.2, 0.2, 0.3, 1), "Roughness": 0.2},
    "BsdfTranslucent": {"Color": (0.1, 0.3, 0.1, 1)},
    "BsdfTransparent": {"Color": (0.2, 0.2, 0.2, 1)},
    "BsdfSheen": {"Color": (0.2, 0.1, 0.3, 1)},
    "Emission": {"Color": TINT, "Strength": 0.1},
    "BsdfRefraction": {"Color": (0.6, 0.8, 0.6, 1), "Roughness": 0.1, "IOR": 1.3},
    SSS: {"Color": BASE, "Scale": 0.1},
}
feature("extremes/sum of six", _combined(
    ("BsdfDiffuse", GLOSSY, "BsdfTranslucent", "BsdfTransparent", "BsdfSheen", "Emission"), ADD,
    **_DIM), 2)  # fmt: skip
feature("extremes/mix of seven", _combined(
    ("BsdfDiffuse", GLOSSY, "BsdfTranslucent", "BsdfRefraction", SSS, "BsdfSheen", "BsdfTransparent"), MIX, 0.3,
    **_DIM), 2)  # fmt: skip
feature("extremes/mix of holdout and glass", _combined(("Holdout", GLASS), MIX, 0.6), 2)
feature("extremes/sum of holdout and emission", _combined(("Holdout", "Emission"), ADD, **_DIM))
feature("extremes/mix of holdout and transparent", _combined(("Holdout", "BsdfTransparent"), MIX, 0.5, **_DIM))
feature("extremes/sum beyond 1", _combined(("BsdfDiffuse", "BsdfDiffuse"), ADD))
feature("extremes/transparent beyond 1", made("BsdfTransparent", Color=(1.5, 1.2, 1.0, 1)))
feature("extremes/translucent and transparent", _combined(("BsdfTranslucent", "BsdfTransparent"), MIX, 0.5, **_DIM))
for _strength in (0.001, 500.0):
    feature(f"extremes/emission {_strength:g}", made("Emission", Color=TINT, Strength=_strength))


def _filled(shader: str, **inputs: Any) -> Build:
    """A medium in glass."""

    def build(stage: Stage) -> None:
        made(GLASS, IOR=1.3)(stage)
        medium = stage.node(f"ShaderNode{shader}", **inputs)
        stage.link(medium.outputs[0], stage.tree().nodes["output"].inputs["Volume"])

    return build


feature("extremes/absorption in glass", _filled("VolumeAbsorption", Color=(0.9, 0.5, 0.2, 1), Density=1.5), 3)
feature("extremes/scattering in glass", _filled("VolumeScatter", Color=(0.9, 0.7, 0.5, 1), Density=1.0), 3)


def _coated(**inputs: Any) -> Build:
    """A coat with bumps of its own over another bump."""

    def build(stage: Stage) -> None:
        shader = bumped(made(PRINCIPLED, Base_Color=BASE, Coat_Weight=1.0, **inputs), "Coat Normal")(stage)
        bump = stage.node("ShaderNodeBump", Strength=0.6, Distance=0.2)
        stage.link(noise(stage, 2.0), bump.inputs["Height"])
        stage.link(bump.outputs[0], shader.inputs["Normal"])

    return build


feature("extremes/two bumps", _coated(Metallic=1.0, Roughness=0.3))
feature("extremes/two bumps, tinted", _coated(Coat_Tint=TINT, Coat_Roughness=0.3))
feature("extremes/two bumps, emission", _coated(Emission_Strength=0.5, Coat_Tint=TINT))

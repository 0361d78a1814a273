# SPDX-License-Identifier: GPL-3.0-or-later
"""The Principled BSDF, socket by socket, alone and in the pairs that matter."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from benchmarks.render.features import feature
from benchmarks.render.features.stage import Stage

BASE = (0.7, 0.35, 0.2, 1)
TINT = (0.2, 0.5, 0.9, 1)

PRINCIPLED: dict[str, dict[str, Any]] = {
    "default": {},
    "metallic": {"Metallic": 1.0, "Roughness": 0.3},
    "half metallic": {"Metallic": 0.5, "Roughness": 0.3},
    "roughness 0": {"Roughness": 0.0},
    "roughness 0.15": {"Roughness": 0.15},
    "roughness 1": {"Roughness": 1.0},
    "metal roughness 0": {"Metallic": 1.0, "Roughness": 0.0},
    "metal roughness 1": {"Metallic": 1.0, "Roughness": 1.0},
    "ior 1": {"IOR": 1.0},
    "ior 2.5": {"IOR": 2.5},
    "ior 0.8": {"IOR": 0.8},
    "alpha": {"Alpha": 0.4},
    "alpha 0": {"Alpha": 0.0},
    "diffuse roughness": {"Diffuse Roughness": 1.0},
    "specular 0": {"Specular IOR Level": 0.0},
    "specular 1": {"Specular IOR Level": 1.0},
    "specular tint": {"Specular Tint": TINT, "Roughness": 0.2},
    "metal specular tint": {"Specular Tint": TINT, "Metallic": 1.0, "Roughness": 0.2},
    "anisotropic": {"Anisotropic": 0.8, "Metallic": 1.0, "Roughness": 0.4},
    "anisotropic rotation": {"Anisotropic": 0.8, "Anisotropic Rotation": 0.25, "Metallic": 1.0, "Roughness": 0.4},
    "transmission": {"Transmission Weight": 1.0, "Roughness": 0.0, "Base Color": (1, 1, 1, 1)},
    "transmission rough": {"Transmission Weight": 1.0, "Roughness": 0.4},
    "transmission colored": {"Transmission Weight": 1.0, "Roughness": 0.1},
    "half transmission": {"Transmission Weight": 0.5, "Roughness": 0.2},
    "transmission and coat": {"Transmission Weight": 1.0, "Coat Weight": 1.0, "Roughness": 0.2},
    "transmission tinted": {"Transmission Weight": 1.0, "Specular Tint": TINT, "Roughness": 0.1},
    "coat": {"Coat Weight": 1.0},
    "coat rough": {"Coat Weight": 1.0, "Coat Roughness": 0.5},
    "coat ior": {"Coat Weight": 1.0, "Coat IOR": 2.2},
    "coat tint": {"Coat Weight": 1.0, "Coat Tint": TINT},
    "coat over metal": {"Coat Weight": 1.0, "Metallic": 1.0, "Coat Tint": TINT},
    "sheen": {"Sheen Weight": 1.0},
    "sheen rough": {"Sheen Weight": 1.0, "Sheen Roughness": 0.1},
    "sheen tint": {"Sheen Weight": 1.0, "Sheen Tint": TINT},
    "subsurface": {"Subsurface Weight": 1.0, "Subsurface Scale": 0.3},
    "subsurface small": {"Subsurface Weight": 1.0, "Subsurface Scale": 0.01},
    "subsurface half": {"Subsurface Weight": 0.5, "Subsurface Scale": 0.2},
    "subsurface radius": {"Subsurface Weight": 1.0, "Subsurface Scale": 0.2, "Subsurface Radius": (1.0, 1.0, 0.1)},
    "emission": {"Emission Strength": 1.5, "Emission Color": TINT},
    "emission under alpha": {"Emission Strength": 1.5, "Emission Color": TINT, "Alpha": 0.5},
    "emission under coat": {"Emission Strength": 1.5, "Coat Weight": 1.0, "Coat Tint": TINT},
    "thin film": {"Thin Film Thickness": 500.0, "Roughness": 0.1},
    "thin film on metal": {"Thin Film Thickness": 500.0, "Metallic": 1.0, "Roughness": 0.1},
    "thin film ior": {"Thin Film Thickness": 300.0, "Thin Film IOR": 2.0, "Roughness": 0.1},
    "transmission, specular 0": {"Transmission Weight": 1.0, "Specular IOR Level": 0.0, "Roughness": 0.1},
    "transmission, specular 1": {"Transmission Weight": 1.0, "Specular IOR Level": 1.0, "Roughness": 0.1},
    "thin film on tinted glass": {
        "Thin Film Thickness": 400.0,
        "Transmission Weight": 1.0,
        "Specular Tint": TINT,
        "Roughness": 0.1,
    },
    "thin film, roughness 1": {"Thin Film Thickness": 400.0, "Thin Film IOR": 1.8, "Roughness": 1.0},
    "thin film, thick": {"Thin Film Thickness": 2000.0, "Roughness": 0.1},
    "thin film below a nanometer": {"Thin Film Thickness": 0.5, "Thin Film IOR": 2.0, "Roughness": 0.1},
    "thin film, rough": {"Thin Film Thickness": 400.0, "Thin Film IOR": 1.8, "Roughness": 0.6},
    "thin film, tinted": {"Thin Film Thickness": 400.0, "Specular Tint": TINT, "Roughness": 0.1},
    "thin film on half a metal": {"Thin Film Thickness": 350.0, "Metallic": 0.5, "Specular Tint": TINT},
    "thin film under coat": {"Thin Film Thickness": 350.0, "Coat Weight": 1.0},
    "thin film on glass": {
        "Thin Film Thickness": 400.0,
        "Thin Film IOR": 1.8,
        "Transmission Weight": 1.0,
        "Roughness": 0.0,
    },
    "thin film on rough glass": {"Thin Film Thickness": 400.0, "Transmission Weight": 1.0, "Roughness": 0.3},
    "black": {"Base Color": (0, 0, 0, 1)},
    "white": {"Base Color": (1, 1, 1, 1)},
    "saturated": {"Base Color": (1, 0, 0, 1)},
}


def _principled(inputs: dict[str, Any], **properties: Any) -> Callable[[Stage], None]:
    def build(stage: Stage) -> None:
        node = stage.shader("ShaderNodeBsdfPrincipled", Base_Color=BASE)
        for name, value in inputs.items():
            node.inputs[name].default_value = value
        for name, value in properties.items():
            setattr(node, name, value)

    return build


for _name, _inputs in PRINCIPLED.items():
    _noisy = any("Transmission" in name or "Subsurface" in name for name in _inputs)
    feature(f"principled/{_name}", _principled(_inputs), 2 if _noisy else 1)
feature("principled/GGX", _principled({"Metallic": 1.0, "Roughness": 0.8}, distribution="GGX"))
feature(
    "principled/GGX transmission", _principled({"Transmission Weight": 1.0, "Roughness": 0.4}, distribution="GGX"), 2
)
for _method in ("BURLEY", "RANDOM_WALK_SKIN"):
    feature(f"principled/subsurface {_method}", _principled(
        {"Subsurface Weight": 1.0, "Subsurface Scale": 0.2}, subsurface_method=_method), 2)  # fmt: skip


def _from_image(socket: str, **inputs: Any) -> Callable[[Stage], None]:
    def build(stage: Stage) -> None:
        node = stage.shader("ShaderNodeBsdfPrincipled", Base_Color=BASE, **inputs)
        texture = stage.node("ShaderNodeTexImage")
        texture.image = stage.image()
        stage.link(texture.outputs["Color"], node.inputs[socket])

    return build


for _socket in ("Base Color", "Metallic", "Roughness", "IOR", "Alpha", "Specular IOR Level", "Specular Tint",
                "Transmission Weight", "Coat Weight", "Coat Roughness", "Sheen Weight", "Subsurface Weight",
                "Emission Color", "Emission Strength", "Anisotropic", "Thin Film IOR"):  # fmt: skip
    _extra = {"Emission Color": {"Emission_Strength": 1.0}, "Thin Film IOR": {"Thin_Film_Thickness": 400.0}}.get(
        _socket, {}
    )
    feature(f"principled/image into {_socket}", _from_image(_socket, **_extra), 2)


def _thickness(stage: Stage) -> None:
    """A film of 200 to 800 nm, as thick as an image is bright."""
    node = stage.shader("ShaderNodeBsdfPrincipled", Base_Color=BASE, Roughness=0.1, Metallic=1.0)
    texture, span = stage.node("ShaderNodeTexImage"), stage.node("ShaderNodeMapRange")
    texture.image = stage.image()
    span.inputs["To Min"].default_value, span.inputs["To Max"].default_value = 200.0, 800.0
    stage.link(texture.outputs["Color"], span.inputs["Value"])
    stage.link(span.outputs["Result"], node.inputs["Thin Film Thickness"])


feature("principled/thin film from an image", _thickness)

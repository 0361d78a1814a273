# SPDX-License-Identifier: GPL-3.0-or-later
"""Shader nodes: each closure, its distributions, and how closures are combined."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from benchmarks.render.features import feature
from benchmarks.render.features.stage import Stage

BASE = (0.7, 0.35, 0.2, 1)


def _shader(kind: str, properties: dict[str, Any] | None = None, **inputs: Any) -> Callable[[Stage], None]:
    def build(stage: Stage) -> None:
        node = stage.shader(kind, **inputs)
        for name, value in (properties or {}).items():
            setattr(node, name, value)

    return build


feature("closures/diffuse", _shader("ShaderNodeBsdfDiffuse", Color=BASE))
feature("closures/diffuse rough", _shader("ShaderNodeBsdfDiffuse", Color=BASE, Roughness=0.8))
for _model in ("GGX", "MULTI_GGX", "BECKMANN", "ASHIKHMIN_SHIRLEY"):
    for _rough in (0.0, 0.2, 0.6, 1.0):
        feature(f"closures/glossy {_model} {_rough:g}", _shader(
            "ShaderNodeBsdfAnisotropic", {"distribution": _model}, Color=BASE, Roughness=_rough))  # fmt: skip
feature("closures/glossy anisotropic", _shader("ShaderNodeBsdfAnisotropic", Color=BASE, Roughness=0.4, Anisotropy=0.8))
feature("closures/glossy ASHIKHMIN_SHIRLEY anisotropic", _shader(
    "ShaderNodeBsdfAnisotropic", {"distribution": "ASHIKHMIN_SHIRLEY"}, Color=BASE, Roughness=0.5,
    Anisotropy=0.7))  # fmt: skip
for _model in ("GGX", "MULTI_GGX", "BECKMANN"):
    for _rough in (0.0, 0.4):
        feature(
            f"closures/glass {_model} {_rough:g}",
            _shader(
                "ShaderNodeBsdfGlass", {"distribution": _model}, Color=(0.9, 0.95, 1, 1), Roughness=_rough, IOR=1.45
            ),
            2,
        )
for _model in ("GGX", "BECKMANN"):
    for _rough in (0.0, 0.4):
        feature(f"closures/refraction {_model} {_rough:g}", _shader(
            "ShaderNodeBsdfRefraction", {"distribution": _model}, Roughness=_rough, IOR=1.45), 2)  # fmt: skip
feature("closures/glass ior below 1", _shader("ShaderNodeBsdfGlass", IOR=0.8), 2)
feature("closures/glass ior 1", _shader("ShaderNodeBsdfGlass", IOR=1.0))
feature("closures/transparent", _shader("ShaderNodeBsdfTransparent", Color=BASE))
feature("closures/translucent", _shader("ShaderNodeBsdfTranslucent", Color=BASE))
feature("closures/holdout", _shader("ShaderNodeHoldout"))
feature("closures/emission", _shader("ShaderNodeEmission", Color=BASE, Strength=2.0))
feature("closures/background", _shader("ShaderNodeBackground", Color=BASE, Strength=2.0))
for _model in ("MICROFIBER", "ASHIKHMIN"):
    feature(f"closures/sheen {_model}", _shader("ShaderNodeBsdfSheen", {"distribution": _model}, Color=BASE))
for _model in ("DIFFUSE", "GLOSSY"):
    feature(f"closures/toon {_model}", _shader("ShaderNodeBsdfToon", {"component": _model}, Color=BASE, Size=0.6))
for _model in ("F82", "PHYSICAL_CONDUCTOR"):
    feature(f"closures/metallic {_model}", _shader("ShaderNodeBsdfMetallic", {"fresnel_type": _model}, Roughness=0.3))
feature("closures/metallic colors", _shader("ShaderNodeBsdfMetallic", Base_Color=BASE, Edge_Tint=(0.2, 0.6, 0.9, 1)))
feature("closures/metallic anisotropic", _shader("ShaderNodeBsdfMetallic", Base_Color=BASE, Anisotropy=0.8))
FILM = {"Thin_Film_Thickness": 450.0, "Thin_Film_IOR": 1.6}
for _model in ("F82", "PHYSICAL_CONDUCTOR"):
    feature(f"closures/metallic {_model} film", _shader(
        "ShaderNodeBsdfMetallic", {"fresnel_type": _model}, Roughness=0.2, **FILM))  # fmt: skip
for _model in ("GGX", "BECKMANN"):
    feature(f"closures/metallic {_model}", _shader("ShaderNodeBsdfMetallic", {"distribution": _model}, Roughness=0.5))
for _rough in (0.0, 0.3):
    feature(f"closures/glass film {_rough:g}", _shader("ShaderNodeBsdfGlass", Roughness=_rough, IOR=1.5, **FILM), 2)
for _model in ("BURLEY", "RANDOM_WALK", "RANDOM_WALK_SKIN"):
    feature(f"closures/subsurface {_model}", _shader(
        "ShaderNodeSubsurfaceScattering", {"falloff": _model}, Color=BASE, Scale=0.3), 2)  # fmt: skip
for _model in ("Reflection", "Transmission"):
    feature(f"closures/hair {_model}", _shader("ShaderNodeBsdfHair", {"component": _model}, Color=BASE))
feature("closures/principled hair", _shader("ShaderNodeBsdfHairPrincipled"))
feature("closures/ray portal", _shader("ShaderNodeBsdfRayPortal", Position=(0.0, 0.0, 3.0)))
feature("closures/specular node", _shader("ShaderNodeEeveeSpecular", Base_Color=BASE))


def _copper(stage: Stage) -> None:
    """Measured indices of refraction; only the physical model has sockets for them."""
    node = stage.shader("ShaderNodeBsdfMetallic", Roughness=0.2)
    node.fresnel_type = "PHYSICAL_CONDUCTOR"
    node.inputs["IOR"].default_value, node.inputs["Extinction"].default_value = (0.25, 0.9, 1.2), (3.6, 2.6, 2.5)


feature("closures/metallic copper", _copper)


def _pair(kind: str, first: str, second: str, factor: float = 0.4) -> Callable[[Stage], None]:
    def build(stage: Stage) -> None:
        one = stage.shader(first)
        node, two = stage.node(kind), stage.node(second)
        inputs = [socket for socket in node.inputs if socket.type == "SHADER"]
        if kind == "ShaderNodeMixShader":
            node.inputs[0].default_value = factor
        stage.link(one.outputs[0], inputs[0])
        stage.link(two.outputs[0], inputs[1])
        stage.link(node.outputs[0], stage.tree().nodes["output"].inputs["Surface"])

    return build


feature(
    "closures/mix diffuse glossy", _pair("ShaderNodeMixShader", "ShaderNodeBsdfDiffuse", "ShaderNodeBsdfAnisotropic")
)
feature(
    "closures/mix diffuse transparent",
    _pair("ShaderNodeMixShader", "ShaderNodeBsdfDiffuse", "ShaderNodeBsdfTransparent"),
)
feature(
    "closures/mix diffuse translucent",
    _pair("ShaderNodeMixShader", "ShaderNodeBsdfDiffuse", "ShaderNodeBsdfTranslucent"),
)
feature("closures/mix glass diffuse", _pair("ShaderNodeMixShader", "ShaderNodeBsdfGlass", "ShaderNodeBsdfDiffuse"), 2)
feature("closures/mix holdout diffuse", _pair("ShaderNodeMixShader", "ShaderNodeHoldout", "ShaderNodeBsdfDiffuse"))
feature("closures/mix beyond 1", _pair("ShaderNodeMixShader", "ShaderNodeBsdfDiffuse", "ShaderNodeEmission", 1.7))
feature("closures/add diffuse emission", _pair("ShaderNodeAddShader", "ShaderNodeBsdfDiffuse", "ShaderNodeEmission"))
feature(
    "closures/add diffuse glossy", _pair("ShaderNodeAddShader", "ShaderNodeBsdfDiffuse", "ShaderNodeBsdfAnisotropic")
)
feature(
    "closures/add transparent emission", _pair("ShaderNodeAddShader", "ShaderNodeBsdfTransparent", "ShaderNodeEmission")
)


def _factor(kind: str, output: str, **values: Any) -> Callable[[Stage], None]:
    """A mix of a dark and a light diffuse surface by the output of a node."""

    def build(stage: Stage) -> None:
        _pair("ShaderNodeMixShader", "ShaderNodeBsdfDiffuse", "ShaderNodeEmission")(stage)
        node = stage.node(kind, **values)
        mix = next(n for n in stage.tree().nodes if n.type == "MIX_SHADER")
        stage.link(node.outputs[output], mix.inputs[0])

    return build


feature("closures/mix by fresnel", _factor("ShaderNodeFresnel", "Fac", IOR=1.45))
feature("closures/mix by layer weight fresnel", _factor("ShaderNodeLayerWeight", "Fresnel", Blend=0.5))
feature("closures/mix by layer weight facing", _factor("ShaderNodeLayerWeight", "Facing", Blend=0.5))
feature("closures/mix by facing blend", _factor("ShaderNodeLayerWeight", "Facing", Blend=0.8))
feature("closures/mix by backfacing", _factor("ShaderNodeNewGeometry", "Backfacing"))
for _ray in ("Is Camera Ray", "Is Shadow Ray", "Is Diffuse Ray", "Is Glossy Ray", "Is Singular Ray",
             "Is Reflection Ray", "Is Transmission Ray"):  # fmt: skip
    feature(f"closures/mix by {_ray}", _factor("ShaderNodeLightPath", _ray))


def _shadowless(stage: Stage) -> None:
    """The usual trick: glass or a surface that is transparent to shadow rays."""
    _pair("ShaderNodeMixShader", "ShaderNodeBsdfDiffuse", "ShaderNodeBsdfTransparent")(stage)
    path = stage.node("ShaderNodeLightPath")
    mix = next(n for n in stage.tree().nodes if n.type == "MIX_SHADER")
    stage.link(path.outputs["Is Shadow Ray"], mix.inputs[0])


feature("closures/transparent to shadow rays", _shadowless)
feature("closures/no output", lambda s: s.tree().nodes.remove(s.tree().nodes["output"]))
feature("closures/output for Eevee only", lambda s: setattr(s.tree().nodes["output"], "target", "EEVEE"))
feature("closures/muted shader", lambda s: setattr(s.tree().nodes["shader"], "mute", True))
feature("closures/no material", lambda s: s.ball.data.materials.clear())
feature("closures/unlinked", lambda s: s.tree().links.clear())

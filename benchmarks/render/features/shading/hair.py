# SPDX-License-Identifier: GPL-3.0-or-later
"""Shaders of hair: a patch of parallel strands, and a tuft on the ball."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy
import numpy as np

from benchmarks.render.features import feature
from benchmarks.render.features.stage import Stage


def strands(stage: Stage, points: Any, radius: float) -> None:
    """Hair curves (strands, points, 3) of one radius with the ball's material."""
    count, length = points.shape[:2]
    curves = bpy.data.hair_curves.new("Strands")
    curves.add_curves([length] * count)
    curves.attributes["position"].data.foreach_set("vector", points.astype(np.float32).ravel())
    radii = curves.attributes.new("radius", "FLOAT", "POINT")
    radii.data.foreach_set("value", np.full(count * length, radius, np.float32))
    curves.materials.append(stage.material_of_ball)
    stage.object("Strands", curves)


def patch(stage: Stage) -> None:
    """Strands side by side and one behind another, which stand upright in place of the ball."""
    bpy.data.objects.remove(stage.ball)
    rng = np.random.default_rng(2)
    roots = np.stack([rng.uniform(-1, 1, 900), rng.uniform(-0.5, 0.5, 900)], axis=-1)
    points = np.zeros((900, 6, 3))
    points[..., :2] = roots[:, None]
    points[..., 2] = np.linspace(0.0, 2.0, 6)
    strands(stage, points, 0.006)


def tuft(stage: Stage) -> None:
    """Strands that grow out of a dark ball and bend."""
    rng = np.random.default_rng(3)
    roots = rng.normal(size=(1200, 3))
    roots /= np.linalg.norm(roots, axis=1, keepdims=True)
    share = np.linspace(0, 1, 7)[None, :, None]
    points = roots[:, None] * (0.98 + 0.5 * share) + share**2 * np.array([0.35, 0.0, -0.35])
    skin = stage.material("Skin", Color=(0.1, 0.1, 0.1, 1))
    stage.ball.data.materials[0] = skin
    strands(stage, points + np.array([0, 0, 1.0]), 0.008)


def _with(
    shape: Callable[[Stage], None], kind: str, properties: dict[str, Any] | None = None, **inputs: Any
) -> Callable[[Stage], None]:
    def build(stage: Stage) -> None:
        node = stage.shader(kind)
        for name, value in (properties or {}).items():
            setattr(node, name, value)  # a property, such as the model, changes which sockets there are
        for name, value in inputs.items():
            node.inputs[name.replace("_", " ")].default_value = value
        shape(stage)

    return build


PRINCIPLED, LOBE = "ShaderNodeBsdfHairPrincipled", "ShaderNodeBsdfHair"
BLOND, PIGMENT = (0.7, 0.45, 0.2, 1), {"parametrization": "MELANIN"}
for _name, _shape in (("patch", patch), ("tuft", tuft)):
    feature(f"hair/{_name} of a color", _with(_shape, PRINCIPLED, Color=BLOND), 2)
    feature(f"hair/{_name} with melanin", _with(_shape, PRINCIPLED, PIGMENT, Melanin=0.5), 2)
    for _component in ("Reflection", "Transmission"):
        feature(f"hair/{_name} {_component.lower()} lobe", _with(
            _shape, LOBE, {"component": _component}, Color=BLOND, RoughnessU=0.3, RoughnessV=0.6), 2)  # fmt: skip
feature("hair/absorption", _with(
    patch, PRINCIPLED, {"parametrization": "ABSORPTION"}, Absorption_Coefficient=(0.2, 0.5, 1.0)), 2)  # fmt: skip
feature("hair/melanin redness", _with(patch, PRINCIPLED, PIGMENT, Melanin=0.7, Melanin_Redness=0.2), 2)
feature("hair/melanin tint", _with(patch, PRINCIPLED, PIGMENT, Melanin=0.2, Tint=(0.3, 0.8, 0.5, 1)), 2)
for _input, _values in (
    ("Roughness", (0.1, 0.8)), ("Radial Roughness", (0.1, 0.9)), ("Coat", (0.9,)), ("IOR", (1.2, 2.0)),
    ("Offset", (0.3,)),
):  # fmt: skip
    for _value in _values:
        feature(f"hair/{_input.lower()} {_value}", _with(
            patch, PRINCIPLED, Color=BLOND, **{_input.replace(" ", "_"): _value}), 2)  # fmt: skip
feature("hair/random color", _with(patch, PRINCIPLED, PIGMENT, Melanin=0.5, Random_Color=0.9), 2)
feature("hair/random roughness", _with(patch, PRINCIPLED, Color=BLOND, Random_Roughness=0.9), 2)
feature("hair/Huang", _with(patch, PRINCIPLED, {"model": "HUANG"}, Color=BLOND), 2)
feature("hair/lobe with an offset", _with(patch, LOBE, RoughnessU=0.2, Offset=0.4), 2)


def _particles(stage: Stage) -> None:
    stage.ball.modifiers.new("P", "PARTICLE_SYSTEM")
    system = stage.ball.particle_systems[0]
    system.settings.type, system.settings.count, system.settings.hair_length = "HAIR", 400, 0.5
    system.settings.radius_scale = 0.03


feature("hair/particle hair", _with(_particles, PRINCIPLED, Color=BLOND), 2)


def _told(output: str) -> Callable[[Stage], None]:
    """Strands that show an output of Curves Info."""

    def build(stage: Stage) -> None:
        stage.glow(stage.node("ShaderNodeHairInfo").outputs[output])
        tuft(stage)

    return build


for _output in ("Is Strand", "Intercept", "Length", "Thickness", "Random"):
    feature(f"hair/curves info {_output}", _told(_output))


def _carried(domain: str, kind: str) -> Callable[[Stage], None]:
    """An attribute of hair curves as their color."""

    def build(stage: Stage) -> None:
        node = stage.node("ShaderNodeAttribute", attribute_name="Mine")
        stage.into_color(node.outputs["Color"])
        tuft(stage)
        made = bpy.data.hair_curves[0].attributes.new("Mine", kind, domain)
        values = np.random.default_rng(5).random(len(made.data) * (4 if kind == "FLOAT_COLOR" else 1))
        made.data.foreach_set("color" if kind == "FLOAT_COLOR" else "value", values.astype(np.float32))

    return build


def _grown(kind: str, output: str, child: str = "NONE") -> Callable[[Stage], None]:
    """Particle hair that is colored by the surface at its roots."""

    def build(stage: Stage) -> None:
        mesh = stage.ball.data
        made = mesh.color_attributes.new("Colors", "BYTE_COLOR", "CORNER")
        made.data.foreach_set("color", np.random.default_rng(5).random(4 * len(made.data)).astype(np.float32))
        values: dict[str, Any] = {"layer_name": "Colors"} if kind == "ShaderNodeVertexColor" else {}
        stage.into_color(stage.node(kind, **values).outputs[output])
        settings = stage.ball.modifiers.new("Hair", "PARTICLE_SYSTEM").particle_system.settings
        settings.type, settings.count, settings.hair_length, settings.child_type = "HAIR", 400, 0.5, child
        settings.radius_scale, settings.tip_radius, settings.rendered_child_count = 0.03, 0.5, 3

    return build


for _domain, _type in (("POINT", "FLOAT"), ("POINT", "FLOAT_COLOR"), ("CURVE", "FLOAT_COLOR")):
    feature(f"hair/{_type.lower()} of each {_domain.lower()}", _carried(_domain, _type))
for _node, _output, _child in (
    ("ShaderNodeTexCoord", "UV", "NONE"),
    ("ShaderNodeTexCoord", "UV", "SIMPLE"),
    ("ShaderNodeTexCoord", "Generated", "NONE"),
    ("ShaderNodeVertexColor", "Color", "NONE"),
):
    feature(f"hair/particles by {_node[10:]} {_output}, {_child.lower()} children", _grown(_node, _output, _child))

# SPDX-License-Identifier: GPL-3.0-or-later
"""Lamps: kinds, sizes, options, visibility, linking, and what their nodes do."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy

from benchmarks.render.features import feature
from benchmarks.render.features.stage import Stage


def _lamp(kind: str, energy: float, **values: Any) -> Callable[[Stage], object]:
    return lambda stage: stage.replace_lamp(kind, energy, **values)


LAMPS: dict[str, tuple[str, float, dict[str, Any]]] = {
    "point": ("POINT", 300, {"shadow_soft_size": 0.0}),
    "point radius": ("POINT", 300, {"shadow_soft_size": 0.5}),
    "point hard falloff": ("POINT", 300, {"shadow_soft_size": 0.5, "use_soft_falloff": False}),
    "point not normalized": ("POINT", 300, {"shadow_soft_size": 0.3, "normalize": False}),
    "point color": ("POINT", 300, {"color": (1.0, 0.4, 0.1)}),
    "point exposure": ("POINT", 150, {"exposure": 1.0}),
    "point temperature": ("POINT", 300, {"use_temperature": True, "temperature": 3000.0}),
    "point temperature and color": ("POINT", 300, {
        "use_temperature": True, "temperature": 9000.0, "color": (1, 0.5, 0.2)}),
    "point no shadow": ("POINT", 300, {"use_shadow": False}),
    "point negative": ("POINT", -100, {}),
    "sun": ("SUN", 3, {"angle": 0.0}),
    "sun angle": ("SUN", 3, {"angle": 0.3}),
    "sun wide": ("SUN", 3, {"angle": 2.0}),
    "sun not normalized": ("SUN", 30, {"angle": 0.3, "normalize": False}),
    "spot": ("SPOT", 400, {"spot_size": 0.7, "spot_blend": 0.0, "shadow_soft_size": 0.0}),
    "spot blend": ("SPOT", 400, {"spot_size": 0.7, "spot_blend": 1.0, "shadow_soft_size": 0.0}),
    "spot radius": ("SPOT", 400, {"spot_size": 0.7, "shadow_soft_size": 0.4}),
    "spot radius not normalized": ("SPOT", 400, {"spot_size": 0.7, "shadow_soft_size": 0.3, "normalize": False}),
    "spot wide": ("SPOT", 400, {"spot_size": 3.14, "shadow_soft_size": 0.1}),
    "spot narrow": ("SPOT", 400, {"spot_size": 0.15, "shadow_soft_size": 0.1}),
    "spot square": ("SPOT", 400, {"spot_size": 0.7, "use_square": True}),
    "area square": ("AREA", 150, {"size": 1.0}),
    "area rectangle": ("AREA", 150, {"shape": "RECTANGLE", "size": 0.3, "size_y": 2.0}),
    "area disk": ("AREA", 150, {"shape": "DISK", "size": 1.0}),
    "area ellipse": ("AREA", 150, {"shape": "ELLIPSE", "size": 0.3, "size_y": 2.0}),
    "area tiny": ("AREA", 150, {"size": 0.001}),
    "area not normalized": ("AREA", 60, {"size": 1.2, "normalize": False}),
    "area spread": ("AREA", 100, {"size": 0.8, "spread": 1.5}),
    "area spread small": ("AREA", 20, {"size": 0.8, "spread": 0.1}),
    "area spread zero": ("AREA", 20, {"size": 0.8, "spread": 0.0}),
    "area spread disk": ("AREA", 50, {"shape": "DISK", "size": 0.8, "spread": 0.6}),
}  # fmt: skip
for _name, (_kind, _energy, _values) in LAMPS.items():
    feature(f"lamps/{_name}", _lamp(_kind, _energy, **_values))


def _scaled(kind: str, energy: float, scale: tuple[float, float, float], **values: Any) -> Callable[[Stage], object]:
    def build(stage: Stage) -> None:
        stage.replace_lamp(kind, energy, **values).scale = scale

    return build


feature("lamps/spot scaled", _scaled("SPOT", 400, (2.0, 0.7, 1.0), spot_size=0.6, shadow_soft_size=0.0))
feature("lamps/spot scaled radius", _scaled("SPOT", 400, (0.6, 1.5, 1.0), spot_size=0.6, shadow_soft_size=0.2))
feature("lamps/spot scaled along", _scaled("SPOT", 400, (1.0, 1.0, 3.0), spot_size=0.6, shadow_soft_size=0.0))
feature("lamps/spot scaled square", _scaled("SPOT", 400, (2.0, 0.7, 1.0), spot_size=0.6, use_square=True))
feature("lamps/area scaled", _scaled("AREA", 150, (2.0, 0.5, 1.0), size=1.0))
feature("lamps/area mirrored", _scaled("AREA", 150, (-1.0, 1.0, 1.0), size=1.0))
feature("lamps/point scaled", _scaled("POINT", 300, (3.0, 1.0, 1.0), shadow_soft_size=0.5))
feature("lamps/sun scaled", _scaled("SUN", 3, (3.0, 1.0, 1.0), angle=0.3))


def _portal(stage: Stage) -> None:
    portal = stage.light("AREA", 200.0, (0, 0, 5), size=4.0)
    portal.data.cycles.is_portal = True


feature("lamps/portal", _portal)
feature(
    "lamps/no multiple importance", lambda s: setattr(s.lamp.data.cycles, "use_multiple_importance_sampling", False)
)
for _bounces in (0, 1):
    feature(f"lamps/max bounces {_bounces}", lambda s, n=_bounces: setattr(s.lamp.data.cycles, "max_bounces", n))
for _ray in ("camera", "diffuse", "glossy", "transmission", "shadow", "volume_scatter"):

    def _hidden(stage: Stage, ray: str = _ray) -> None:
        stage.shader({"glossy": "ShaderNodeBsdfAnisotropic", "transmission": "ShaderNodeBsdfGlass"}.get(
            ray, "ShaderNodeBsdfDiffuse"))  # fmt: skip
        setattr(stage.lamp, f"visible_{ray}", False)

    feature(f"lamps/not visible to {_ray}", _hidden, 2)


def _seen_by_camera(stage: Stage) -> None:
    stage.lamp.visible_camera = True
    stage.lamp.location, stage.lamp.rotation_euler = (1.5, 1.5, 2.0), (-1.2, 0.3, 0.0)


feature("lamps/seen by camera", _seen_by_camera)
for _factor in ("diffuse_factor", "specular_factor", "transmission_factor", "volume_factor"):
    feature(f"lamps/{_factor}", lambda s, name=_factor: setattr(s.lamp.data, name, 0.2))


def _linking(collection: str) -> Callable[[Stage], object]:
    def build(stage: Stage) -> None:
        chosen = bpy.data.collections.new("Linked")
        setattr(stage.lamp.light_linking, collection, chosen)
        chosen.objects.link(stage.ball)

    return build


feature("lamps/light linking", _linking("receiver_collection"))
feature("lamps/shadow linking", _linking("blocker_collection"))


def _excluded(stage: Stage) -> None:
    chosen = bpy.data.collections.new("Linked")
    stage.lamp.light_linking.receiver_collection = chosen
    chosen.objects.link(stage.ball)
    chosen.collection_objects[0].light_linking.link_state = "EXCLUDE"


feature("lamps/light linking excluded", _excluded)


def _shadow_excluded(stage: Stage) -> None:
    chosen = bpy.data.collections.new("Linked")
    stage.lamp.light_linking.blocker_collection = chosen
    chosen.objects.link(stage.ball)
    chosen.collection_objects[0].light_linking.link_state = "EXCLUDE"


feature("lamps/shadow linking excluded", _shadow_excluded)


def _instanced(stage: Stage) -> None:
    stage.instance_at(stage.lamp, (-1.5, 0.5))


feature("lamps/instanced", _instanced)
feature("lamps/hidden in renders", lambda s: setattr(s.lamp, "hide_render", True))
feature("lamps/light group", lambda s: (s.layer.lightgroups.add(name="key"), setattr(s.lamp, "lightgroup", "key")))


# --- nodes ---------------------------------------------------------------------------------------------------------


def _nodes(
    connect: Callable[[Stage, Any], object], kind: str = "POINT", energy: float = 300.0
) -> Callable[[Stage], None]:
    def build(stage: Stage) -> None:
        lamp = stage.replace_lamp(kind, energy)
        tree = stage.tree(lamp.data)
        connect(stage, next(node for node in tree.nodes if node.type == "EMISSION"))

    return build


def _set(name: str, value: Any) -> Callable[[Stage, Any], object]:
    return lambda stage, emission: setattr(emission.inputs[name], "default_value", value)


def _from(kind: str, output: str, target: str = "Strength", **values: Any) -> Callable[[Stage, Any], object]:
    def connect(stage: Stage, emission: Any) -> None:
        node = emission.id_data.nodes.new(kind)
        for key, value in values.items():
            if key in node.bl_rna.properties:
                setattr(node, key, value)
            else:
                node.inputs[key.replace("_", " ")].default_value = value
        stage.link(node.outputs[output], emission.inputs[target])

    return connect


def _mixed(stage: Stage, emission: Any) -> None:
    tree = emission.id_data
    other, mix = tree.nodes.new("ShaderNodeEmission"), tree.nodes.new("ShaderNodeMixShader")
    other.inputs["Color"].default_value, other.inputs["Strength"].default_value = (0.1, 0.3, 1.0, 1), 3.0
    mix.inputs["Fac"].default_value = 0.3
    stage.link(emission.outputs[0], mix.inputs[1])
    stage.link(other.outputs[0], mix.inputs[2])
    output = next(node for node in tree.nodes if node.type == "OUTPUT_LIGHT")
    stage.link(mix.outputs[0], output.inputs["Surface"])


def _camera_ray(stage: Stage, emission: Any) -> None:
    tree = emission.id_data
    path, math = tree.nodes.new("ShaderNodeLightPath"), tree.nodes.new("ShaderNodeMath")
    math.operation = "MULTIPLY"
    math.inputs[1].default_value = 2.0
    stage.link(path.outputs["Is Shadow Ray"], math.inputs[0])
    stage.link(math.outputs[0], emission.inputs["Strength"])


def _image(stage: Stage, emission: Any) -> None:
    tree = emission.id_data
    texture, place = tree.nodes.new("ShaderNodeTexImage"), tree.nodes.new("ShaderNodeTexCoord")
    texture.image = stage.image()
    stage.link(place.outputs["UV"], texture.inputs["Vector"])
    stage.link(texture.outputs["Color"], emission.inputs["Color"])


def _normal_texture(stage: Stage, emission: Any) -> None:
    tree = emission.id_data
    place, ramp = tree.nodes.new("ShaderNodeTexCoord"), tree.nodes.new("ShaderNodeSeparateXYZ")
    stage.link(place.outputs["Normal"], ramp.inputs[0])
    stage.link(ramp.outputs[2], emission.inputs["Strength"])


IES = """IESNA:LM-63-1995
TILT=NONE
1 -1 1 7 1 1 2 0 0 0
1 1 100
0 15 30 45 60 75 90
0
1000 950 800 500 200 50 0
"""


def _ies(stage: Stage, emission: Any) -> None:
    tree = emission.id_data
    node = tree.nodes.new("ShaderNodeTexIES")
    node.mode = "INTERNAL"
    node.ies = bpy.data.texts.new("lamp.ies")
    node.ies.write(IES)
    stage.link(node.outputs[0], emission.inputs["Strength"])


feature("lamps/node strength", _nodes(_set("Strength", 2.5)))
feature("lamps/node color", _nodes(_set("Color", (0.2, 0.6, 1.0, 1))))
feature("lamps/node blackbody", _nodes(_from("ShaderNodeBlackbody", "Color", "Color", Temperature=2500.0)))
feature("lamps/node wavelength", _nodes(_from("ShaderNodeWavelength", "Color", "Color", Wavelength=560.0)))
for _output in ("Quadratic", "Linear", "Constant"):
    for _smooth in (0.0, 1.0):
        feature(f"lamps/node falloff {_output.lower()} smooth {_smooth:g}", _nodes(
            _from("ShaderNodeLightFalloff", _output, Strength=3.0, Smooth=_smooth), energy=100.0))  # fmt: skip
feature("lamps/node falloff on a sun", _nodes(_from("ShaderNodeLightFalloff", "Quadratic", Strength=2.0), "SUN", 3.0))
feature("lamps/node falloff on an area", _nodes(_from("ShaderNodeLightFalloff", "Linear", Strength=2.0), "AREA", 50.0))
feature("lamps/node IES", _nodes(_ies))
feature("lamps/node IES on a spot", _nodes(_ies, "SPOT", 300.0))
feature("lamps/node mix of emissions", _nodes(_mixed))
feature("lamps/node light path", _nodes(_camera_ray))
feature("lamps/node ray length", _nodes(_from("ShaderNodeLightPath", "Ray Length")))
feature("lamps/node image on an area", _nodes(_image, "AREA", 150.0))
feature("lamps/node image on a point", _nodes(_image))
feature("lamps/node normal on a point", _nodes(_normal_texture))
feature("lamps/node normal on a spot", _nodes(_normal_texture, "SPOT", 300.0))
feature("lamps/node value", _nodes(_from("ShaderNodeValue", "Value")))
feature("lamps/node noise on an area", _nodes(_from("ShaderNodeTexNoise", "Color", "Color"), "AREA", 150.0))

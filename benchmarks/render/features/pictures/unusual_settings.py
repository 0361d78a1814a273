# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of other engines and of views, which must not count; several outputs, layers, and a compositor."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy

from benchmarks.render.features import feature
from benchmarks.render.features.stage import Stage


def _lamp(kind: str, energy: float, **values: Any) -> Callable[[Stage], None]:
    """A lamp with those of the settings that this Blender has."""

    def build(stage: Stage) -> None:
        data = stage.replace_lamp(kind, energy).data
        for name, value in values.items():
            if name in data.bl_rna.properties:
                setattr(data, name, value)

    return build


def _material(**values: Any) -> Callable[[Stage], None]:
    def build(stage: Stage) -> None:
        stage.shader("ShaderNodeBsdfPrincipled", Alpha=0.6, Base_Color=(0.7, 0.3, 0.2, 1))
        for name, value in values.items():
            if name in stage.material_of_ball.bl_rna.properties:
                setattr(stage.material_of_ball, name, value)

    return build


_OTHERS = {"diffuse_factor": 0.2, "specular_factor": 0.0, "transmission_factor": 0.3, "volume_factor": 0.0}
feature("unusual/lamp with factors of another engine", _lamp("POINT", 300, **_OTHERS))
feature("unusual/lamp with a cutoff of another engine", _lamp(
    "POINT", 300, use_custom_distance=True, cutoff_distance=1.0))  # fmt: skip
feature("unusual/square spot", _lamp("SPOT", 500, use_square=True, spot_size=0.8, show_cone=True))
feature("unusual/lamp of hard falloff", _lamp("POINT", 300, use_soft_falloff=False, shadow_soft_size=0.6))
feature("unusual/spot of hard falloff", _lamp("SPOT", 500, use_soft_falloff=False, shadow_soft_size=0.5, spot_size=0.9))
feature("unusual/sun without shadows", _lamp("SUN", 3, use_shadow=False, angle=0.1))
feature("unusual/alpha of another engine", _material(surface_render_method="BLENDED", alpha_threshold=0.9))
feature("unusual/culling of another engine", _material(
    use_backface_culling=True, use_transparency_overlap=False, use_backface_culling_shadow=True))  # fmt: skip


def _two_outputs(stage: Stage) -> None:
    """An output for Cycles, another for EEVEE, and a third for all, the active one."""
    tree = stage.tree()
    for target, color in (("EEVEE", (0, 0, 1, 1)), ("ALL", (0, 1, 0, 1)), ("CYCLES", (0.9, 0.2, 0.1, 1))):
        output, shader = stage.node("ShaderNodeOutputMaterial", target=target), stage.node("ShaderNodeBsdfDiffuse")
        shader.inputs["Color"].default_value = color
        tree.links.new(shader.outputs[0], output.inputs["Surface"])
        output.is_active_output = target == "ALL"


def _active_output(stage: Stage) -> None:
    tree = stage.tree()
    output, shader = stage.node("ShaderNodeOutputMaterial"), stage.node("ShaderNodeBsdfDiffuse")
    shader.inputs["Color"].default_value = (0.1, 0.7, 0.2, 1)
    tree.links.new(shader.outputs[0], output.inputs["Surface"])
    output.is_active_output = True


def _world_outputs(stage: Stage) -> None:
    tree = stage.tree(stage.world)
    output, shade = stage.node("ShaderNodeOutputWorld", stage.world, target="CYCLES"), stage.node(
        "ShaderNodeBackground", stage.world, Color=(0.6, 0.2, 0.1, 1))  # fmt: skip
    tree.links.new(shade.outputs[0], output.inputs["Surface"])


feature("unusual/outputs of several engines", _two_outputs)
feature("unusual/second output is active", _active_output)
feature("unusual/world output of an engine", _world_outputs)

# --- views and renders ------------------------------------------------------------------------------------------------


def _modifiers(stage: Stage) -> None:
    """A modifier of views alone, one of renders alone, and other levels in each."""
    seen = stage.ball.modifiers.new("Seen", "CAST")
    seen.factor, seen.cast_type, seen.show_render = 1.0, "CUBOID", False
    rendered = stage.ball.modifiers.new("Rendered", "SIMPLE_DEFORM")
    rendered.deform_method, rendered.angle, rendered.show_viewport = "TAPER", 0.8, False
    levels = stage.ball.modifiers.new("Levels", "SUBSURF")
    levels.levels, levels.render_levels = 0, 1


def _visibility(stage: Stage) -> None:
    stage.ball.hide_viewport = True
    cube = stage.cube(stage.material("Cube", Color=(0.1, 0.5, 0.2, 1)), (1.3, -1, 0.4), 0.7)
    cube.hide_set(True)
    stage.layer.update()


def _parent_hidden(stage: Stage) -> None:
    parent = stage.cube(stage.material("Parent", Color=(0.1, 0.5, 0.2, 1)), (-1.4, -1, 0.4), 0.7)
    parent.hide_render = True
    stage.ball.parent = parent
    stage.ball.matrix_parent_inverse = parent.matrix_world.inverted()


feature("unusual/modifiers of views and renders", _modifiers)
feature("unusual/objects hidden in views", _visibility)
feature("unusual/child of a hidden parent", _parent_hidden)

# --- layers and the compositor ----------------------------------------------------------------------------------------


def _two_layers(stage: Stage) -> None:
    """A second view layer that lacks the ball; the picture shows the first."""
    other = stage.scene.view_layers.new("Other")
    other.use_sky = False
    other.material_override = stage.material("Over", Color=(0.0, 0.0, 1.0, 1))


def _node_groups(stage: Stage) -> None:
    """A group in a group, with defaults at both levels, used twice with other values."""
    inner = bpy.data.node_groups.new("Inner", "ShaderNodeTree")
    outer = bpy.data.node_groups.new("Outer", "ShaderNodeTree")
    for tree, value in ((inner, (0.2, 0.4, 0.6, 1)), (outer, (0.6, 0.1, 0.3, 1))):
        tree.interface.new_socket("Tint", in_out="INPUT", socket_type="NodeSocketColor").default_value = value
        tree.interface.new_socket("Amount", in_out="INPUT", socket_type="NodeSocketFloat").default_value = 0.3
        tree.interface.new_socket("Result", in_out="OUTPUT", socket_type="NodeSocketColor")
    start, end = inner.nodes.new("NodeGroupInput"), inner.nodes.new("NodeGroupOutput")
    mix = inner.nodes.new("ShaderNodeMix")
    mix.data_type = "RGBA"
    inner.links.new(start.outputs["Amount"], mix.inputs[0])
    inner.links.new(start.outputs["Tint"], mix.inputs[6])
    inner.links.new(mix.outputs[2], end.inputs[0])
    first, last = outer.nodes.new("NodeGroupInput"), outer.nodes.new("NodeGroupOutput")
    nested = outer.nodes.new("ShaderNodeGroup")
    nested.node_tree = inner
    outer.links.new(first.outputs["Tint"], nested.inputs["Tint"])
    outer.links.new(nested.outputs[0], last.inputs[0])
    both = stage.node("ShaderNodeMix", data_type="RGBA", blend_type="ADD")
    for number, color in enumerate(((0.5, 0.1, 0.1, 1), None)):
        node = stage.node("ShaderNodeGroup")
        node.node_tree = outer
        if color is not None:
            node.inputs["Tint"].default_value = color
        stage.link(node.outputs[0], both.inputs[6 + number])
    stage.into_color(both.outputs[2])


def _muted_link(stage: Stage) -> None:
    noise = stage.node("ShaderNodeTexNoise")
    stage.into_color(noise.outputs["Color"])
    stage.tree().links[-1].is_muted = True


def _curves_of_color(stage: Stage) -> None:
    settings = stage.scene.view_settings
    settings.exposure, settings.gamma = 0.7, 1.3


feature("unusual/two view layers", _two_layers)
feature("unusual/groups in groups with defaults", _node_groups)
feature("unusual/muted link", _muted_link)
feature("unusual/exposure and gamma of the view", _curves_of_color)
feature(
    "unusual/camera with a background image and guides",
    lambda s: (
        setattr(s.camera.data, "show_background_images", True),
        setattr(s.camera.data.background_images.new(), "image", s.image()),
        setattr(s.camera.data, "show_limits", True),
    ),
)

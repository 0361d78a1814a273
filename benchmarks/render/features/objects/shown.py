# SPDX-License-Identifier: GPL-3.0-or-later
"""What rays, lamps and films see: visibility, linking, holdouts, catchers, instances and motion in combination."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy

from benchmarks.render.features import feature
from benchmarks.render.features.stage import Stage

# --- linking --------------------------------------------------------------------------------------------------------


def _second_lamp(stage: Stage) -> Any:
    return stage.light("POINT", 120.0, (-2.0, -1.5, 2.5), color=(1.0, 0.4, 0.2), shadow_soft_size=0.3)


def _linked(member: str, exclude: bool, nested: bool = False) -> Callable[[Stage], None]:
    """Two lamps, of which the second lights (or is shadowed by) the ball alone, or all but the ball."""

    def build(stage: Stage) -> None:
        lamp, chosen = _second_lamp(stage), bpy.data.collections.new("Chosen")
        setattr(lamp.light_linking, member, chosen)
        if nested:
            inner = bpy.data.collections.new("Inner")
            inner.objects.link(stage.ball)
            chosen.children.link(inner)
            entry = chosen.collection_children[0]
        else:
            chosen.objects.link(stage.ball)
            entry = chosen.collection_objects[0]
        if exclude:
            entry.light_linking.link_state = "EXCLUDE"

    return build


for _member, _word in (("receiver_collection", "lit"), ("blocker_collection", "shadowed")):
    feature(f"shown/ball alone is {_word} by one of two lamps", _linked(_member, False))
    feature(f"shown/all but the ball {_word} by one of two lamps", _linked(_member, True))
    feature(f"shown/{_word} through a nested collection", _linked(_member, False, nested=True))


def _linked_glow(stage: Stage) -> None:
    """An emissive cube that lights the ball alone, and casts the shadow of the ball alone."""
    cube = stage.cube(stage.material("Glow", "ShaderNodeEmission", Strength=12.0), (1.6, -1.0, 1.2), 0.5)
    chosen = bpy.data.collections.new("Chosen")
    chosen.objects.link(stage.ball)
    cube.light_linking.receiver_collection = chosen


def _linked_instances(stage: Stage) -> None:
    """Instances of the ball, which the lamp lights, on a floor that it does not."""
    stage.instance_at(stage.ball, (-0.9, 0.9))
    chosen = bpy.data.collections.new("Chosen")
    chosen.objects.link(stage.ball)
    stage.lamp.light_linking.receiver_collection = chosen


feature("shown/emissive cube linked to the ball", _linked_glow, 2)
feature("shown/lamp linked to instances", _linked_instances)

# --- visibility -----------------------------------------------------------------------------------------------------


def _mirror_floor(stage: Stage) -> None:
    stage.floor.data.materials[0] = stage.material("Mirror", "ShaderNodeBsdfAnisotropic", Roughness=0.1)


def _hidden_ball(flag: str) -> Callable[[Stage], None]:
    def build(stage: Stage) -> None:
        _mirror_floor(stage)
        setattr(stage.ball, flag, False)

    return build


def _hidden_glow(flag: str) -> Callable[[Stage], None]:
    """An emissive cube over a glossy floor and a glass ball."""

    def build(stage: Stage) -> None:
        _mirror_floor(stage)
        stage.shader("ShaderNodeBsdfGlass", IOR=1.3, Roughness=0.1)
        stage.replace_lamp("POINT", 40.0, shadow_soft_size=0.2)
        cube = stage.cube(stage.material("Glow", "ShaderNodeEmission", Strength=8.0), (-1.5, 0.6, 1.4), 0.8)
        setattr(cube, flag, False)

    return build


for _flag in ("camera", "glossy", "shadow"):
    feature(f"shown/ball over a mirror, not visible to {_flag}", _hidden_ball(f"visible_{_flag}"))
for _flag in ("camera", "glossy", "transmission", "diffuse", "shadow"):
    feature(f"shown/emissive cube not visible to {_flag}", _hidden_glow(f"visible_{_flag}"), 2)


def _plastic(flag: str, of_world: bool) -> Callable[[Stage], None]:
    """A ball of plastic, which scatters and mirrors, under a light that is hidden from one of the two."""

    def build(stage: Stage) -> None:
        stage.shader("ShaderNodeBsdfPrincipled", Base_Color=(0.6, 0.2, 0.1, 1), Roughness=0.25)
        if of_world:
            setattr(stage.world.cycles_visibility, flag, False)
        else:
            setattr(stage.lamp, f"visible_{flag}", False)

    return build


for _flag in ("diffuse", "glossy"):
    feature(f"shown/plastic under a lamp not visible to {_flag}", _plastic(_flag, False))
    feature(f"shown/plastic under a world not visible to {_flag}", _plastic(_flag, True))


def _world_of_rays(flag: str) -> Callable[[Stage], None]:
    def build(stage: Stage) -> None:
        _mirror_floor(stage)
        stage.shader("ShaderNodeBsdfGlass", IOR=1.3)
        setattr(stage.world.cycles_visibility, flag, False)

    return build


for _flag in ("camera", "diffuse", "glossy", "transmission"):
    feature(f"shown/world over a mirror and glass, not visible to {_flag}", _world_of_rays(_flag), 2)

# --- film -----------------------------------------------------------------------------------------------------------


def _transparent(stage: Stage) -> None:
    stage.scene.render.film_transparent = True


def _half_holdout(stage: Stage) -> None:
    """A ball that is half a holdout by its nodes."""
    _transparent(stage)
    tree = stage.tree()
    mix, hole = stage.node("ShaderNodeMixShader"), stage.node("ShaderNodeHoldout")
    stage.link(hole.outputs[0], mix.inputs[1])
    stage.link(tree.nodes["shader"].outputs[0], mix.inputs[2])
    stage.link(mix.outputs[0], tree.nodes["output"].inputs[0])


def _hole_behind_glass(stage: Stage) -> None:
    _transparent(stage)
    stage.shader("ShaderNodeBsdfGlass", IOR=1.2)
    stage.cube(stage.floor.data.materials[0], (0, 2.0, 1.0), 1.5).is_holdout = True


def _caught(lamp: str) -> Callable[[Stage], None]:
    def build(stage: Stage) -> None:
        _transparent(stage)
        stage.floor.is_shadow_catcher = True
        if lamp:
            stage.replace_lamp(lamp, {"SUN": 4.0, "SPOT": 500.0, "POINT": 250.0}[lamp], color=(1.0, 0.6, 0.3))

    return build


def _clear_ball_caught(stage: Stage) -> None:
    _caught("SUN")(stage)
    stage.shader("ShaderNodeBsdfTransparent", Color=(0.3, 0.8, 0.4, 1))


feature("shown/half a holdout", _half_holdout)
feature("shown/holdout behind glass", _hole_behind_glass, 2)
for _lamp in ("SUN", "SPOT", "POINT"):
    feature(f"shown/catcher under a colored {_lamp.lower()}", _caught(_lamp), 2)
feature("shown/catcher under a clear ball", _clear_ball_caught, 2)
feature("shown/ball hidden from the camera over a transparent film", lambda s: (
    _transparent(s), setattr(s.ball, "visible_camera", False)))  # fmt: skip
feature("shown/floor hidden from the camera over a transparent film", lambda s: (
    _transparent(s), setattr(s.floor, "visible_camera", False)))  # fmt: skip
feature("shown/world that lights, over a transparent film", lambda s: (
    _transparent(s), bpy.data.objects.remove(s.lamp)))  # fmt: skip

# --- motion, instances, cameras -------------------------------------------------------------------------------------


def _moved(obj: Any, name: str, first: Any, last: Any, stage: Stage, shutter: float = 1.0) -> None:
    for frame, value in ((0, first), (2, last)):
        setattr(obj, name, value)
        obj.keyframe_insert(name, frame=frame)
    stage.scene.frame_set(1)
    stage.scene.render.use_motion_blur, stage.scene.render.motion_blur_shutter = True, shutter


feature("shown/ball that turns", lambda s: (
    setattr(s.ball, "scale", (1.2, 0.5, 1.0)),
    _moved(s.ball, "rotation_euler", (0, 0, 0), (0, 0, 1.5), s)), 2)  # fmt: skip
feature("shown/ball that grows", lambda s: _moved(s.ball, "scale", (0.6, 0.6, 0.6), (1.3, 1.3, 1.3), s), 2)
feature("shown/camera that moves past, long shutter", lambda s: _moved(
    s.camera, "location", (-0.5, -6, 2.4), (0.5, -6, 2.4), s, 2.0), 2)  # fmt: skip
feature("shown/camera that zooms", lambda s: _moved(s.camera.data, "lens", 50.0, 75.0, s), 2)
feature("shown/panel that moves", lambda s: _moved(s.lamp, "location", (0.5, -2.2, 4), (3.0, -2.2, 4), s), 2)


def _mirrored_instances(stage: Stage) -> None:
    """Instances that are mirrored, squeezed and turned."""
    noise = stage.node("ShaderNodeTexNoise", Scale=3.0)
    stage.link(stage.node("ShaderNodeTexCoord").outputs["Object"], noise.inputs["Vector"])
    stage.into_color(noise.outputs["Color"])
    for x, scale in ((-1.8, (-1, 1, 1)), (1.8, (0.6, 1.0, 1.4))):
        made = stage.object(f"Copy {x}", stage.ball.data, (x, 0.5, 1.0), (0.4, 0.2, x))
        made.scale = scale


def _window_coordinates(stage: Stage) -> None:
    stage.camera.data.shift_x, stage.camera.data.shift_y = 0.1, -0.05
    checker = stage.node("ShaderNodeTexChecker", Scale=6.0)
    stage.link(stage.node("ShaderNodeTexCoord").outputs["Window"], checker.inputs["Vector"])
    stage.glow(checker.outputs["Color"])


def _squeezed(stage: Stage) -> None:
    stage.scene.render.pixel_aspect_x, stage.scene.render.pixel_aspect_y = 1.0, 1.6
    stage.camera.data.sensor_fit, stage.camera.data.sensor_height = "VERTICAL", 18.0


feature("shown/instances mirrored and squeezed", _mirrored_instances)
feature("shown/window coordinates with a shifted lens", _window_coordinates)
feature("shown/orthographic window coordinates", lambda s: (
    setattr(s.camera.data, "type", "ORTHO"), setattr(s.camera.data, "ortho_scale", 5.0),
    _window_coordinates(s)))  # fmt: skip
feature("shown/vertical sensor with tall pixels", _squeezed)
feature("shown/focus on an object through a wide aperture", lambda s: (
    setattr(s.camera.data.dof, "use_dof", True), setattr(s.camera.data.dof, "focus_object", s.ball),
    setattr(s.camera.data.dof, "aperture_fstop", 0.4), setattr(s.camera.data.dof, "aperture_blades", 5),
    setattr(s.camera.data.dof, "aperture_rotation", 0.4)), 2)  # fmt: skip

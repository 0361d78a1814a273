# SPDX-License-Identifier: GPL-3.0-or-later
"""Lamps, cameras and films as files from elsewhere have them: nodes on suns, linking, arcs, lenses, layers."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy

from benchmarks.render.features import feature
from benchmarks.render.features.stage import Stage


def _lamp(kind: str, energy: float, **values: Any) -> Callable[[Stage], Any]:
    return lambda stage: stage.replace_lamp(kind, energy, **values)


def _then(*steps: Callable[[Stage], object]) -> Callable[[Stage], None]:
    def build(stage: Stage) -> None:
        for step in steps:
            step(stage)

    return build


def _set(which: str, **values: Any) -> Callable[[Stage], None]:
    """Settings of the scene's ``render`` or ``cycles``, of the camera's ``data`` or of the ``lamp``."""

    def build(stage: Stage) -> None:
        owners = {"render": stage.scene.render, "cycles": stage.scene.cycles, "camera": stage.camera.data,
                  "dof": stage.camera.data.dof, "lamp": stage.lamp.data, "ball": stage.ball, "floor": stage.floor,
                  "layer": stage.layer}  # fmt: skip
        for name, value in values.items():
            setattr(owners[which], name, value)

    return build


# --- lamps ----------------------------------------------------------------------------------------------------------

feature("unusual/sun of 20 degrees", _lamp("SUN", 3.0, angle=0.35))
feature("unusual/sun of 120 degrees", _lamp("SUN", 3.0, angle=2.1))
feature("unusual/sun through glass", _then(_lamp("SUN", 3.0, angle=0.1), lambda s: s.shader(
    "ShaderNodeBsdfGlass", Roughness=0.2)), 4)  # fmt: skip
feature("unusual/lamp with a temperature", _lamp("POINT", 300.0, use_temperature=True, temperature=2800.0))
feature("unusual/lamp with an exposure", _lamp("AREA", 50.0, exposure=1.5, size=0.7))
feature("unusual/spot of full blend", _lamp("SPOT", 500.0, spot_size=0.9, spot_blend=1.0, shadow_soft_size=0.3))
feature("unusual/spot of 170 degrees", _lamp("SPOT", 500.0, spot_size=2.97, spot_blend=0.0, shadow_soft_size=0.0))
feature("unusual/ellipse of narrow spread", _then(_lamp("AREA", 60.0, shape="ELLIPSE", size=1.5, size_y=0.4), _set(
    "lamp", spread=0.4)))  # fmt: skip
feature("unusual/rectangle of spread 0", _then(_lamp("AREA", 10.0, shape="RECTANGLE", size=1.5, size_y=0.6), _set(
    "lamp", spread=0.0)))  # fmt: skip
feature("unusual/lamp without shadows", _then(_lamp("POINT", 300.0), _set("lamp", use_shadow=False)))


def _parented(stage: Stage) -> None:
    """A panel and a spot under an empty of negative, uneven scale."""
    parent = stage.object("Parent", None, (0.3, 0, 0.2), (0.1, 0.2, 0.4))
    parent.scale = (-1.4, 0.8, 1.2)
    spot = stage.light("SPOT", 200.0, (-1.5, -1.5, 2.5), (0.5, -0.5, 0), spot_size=0.8)
    for item in (stage.lamp, spot):
        item.parent = parent


def _sun_nodes(stage: Stage) -> None:
    """A sun that is brighter for shadow rays than for others, with its color by a ramp."""
    lamp = stage.replace_lamp("SUN", 2.0, angle=0.05)
    tree = stage.tree(lamp.data)
    emission = next(node for node in tree.nodes if node.type == "EMISSION")
    ramp = stage.node("ShaderNodeValToRGB", lamp.data)
    ramp.color_ramp.elements[0].color = (1.0, 0.5, 0.2, 1)
    ramp.inputs[0].default_value = 0.3
    stage.link(ramp.outputs[0], emission.inputs["Color"])
    emission.inputs["Strength"].default_value = 1.7


def _excluded(stage: Stage) -> None:
    """A lamp that leaves the ball out, and another that the floor alone blocks."""
    receivers, blockers = (bpy.data.collections.new(name) for name in ("Receivers", "Blockers"))
    receivers.objects.link(stage.ball)
    receivers.collection_objects[0].light_linking.link_state = "EXCLUDE"
    stage.lamp.light_linking.receiver_collection = receivers
    second = stage.light("POINT", 200.0, (-2, -2, 3), shadow_soft_size=0.1)
    blockers.objects.link(stage.floor)
    second.light_linking.blocker_collection = blockers


feature("unusual/lamps under a mirrored parent", _parented)
feature("unusual/sun with nodes", _sun_nodes)
feature("unusual/lamps that leave objects out", _excluded)
feature("unusual/sun that ends after a bounce", _then(_lamp("SUN", 3.0), lambda s: setattr(
    s.lamp.data.cycles, "max_bounces", 1)))  # fmt: skip
feature("unusual/emissive ball that the camera does not see", lambda s: (
    s.shader("ShaderNodeEmission", Strength=4.0), setattr(s.ball, "visible_camera", False)))  # fmt: skip
feature("unusual/emission from the front alone", lambda s: (s.shader("ShaderNodeEmission", Strength=3.0), setattr(
    s.material_of_ball.cycles, "emission_sampling", "FRONT")))  # fmt: skip

# --- cameras --------------------------------------------------------------------------------------------------------


def _open(**values: Any) -> Callable[[Stage], None]:
    return _set("dof", use_dof=True, focus_distance=4.0, aperture_fstop=0.1, **values)


feature("unusual/orthographic with shift, blades and a flat aperture", _then(
    _set("camera", type="ORTHO", ortho_scale=5.0, shift_x=-0.15, shift_y=0.1),
    _open(aperture_blades=6, aperture_ratio=0.5, aperture_rotation=0.7)), 2)  # fmt: skip
feature("unusual/wide lens with shift and blades", _then(_set("camera", lens=24.0, shift_y=0.2), _open(
    aperture_blades=3)), 2)  # fmt: skip
feature("unusual/fisheye with a long lens", _set("camera", type="PANO", panorama_type="FISHEYE_EQUISOLID",
        fisheye_lens=8.0, fisheye_fov=2.0))  # fmt: skip
feature("unusual/equirectangular window", _set("camera", type="PANO", panorama_type="EQUIRECTANGULAR",
        latitude_min=-0.5, latitude_max=0.4, longitude_min=-0.8, longitude_max=0.6))  # fmt: skip
feature("unusual/panorama out of focus", _then(_set("camera", type="PANO", panorama_type="FISHEYE_EQUIDISTANT",
        fisheye_fov=1.2), _open()), 2)  # fmt: skip
feature("unusual/tall picture", _then(_set("render", resolution_x=36, resolution_y=64), _set("camera", lens=40.0)))


def _carried_camera(stage: Stage) -> None:
    parent = stage.object("Rig", None, (0, 0, 0.3), (0, 0, 0.2))
    parent.scale = (1.2, 0.9, 1.1)
    stage.camera.parent = parent


feature("unusual/camera under a scaled parent", _carried_camera)

# --- motion ---------------------------------------------------------------------------------------------------------


def _keyed(stage: Stage, item: Any, name: str, *values: Any) -> None:
    """Values at the frames 0, 1, 2, …, and the shutter open for two frames around frame 1."""
    for frame, value in enumerate(values):
        setattr(item, name, value)
        item.keyframe_insert(name, frame=frame)
    stage.scene.frame_set(1)
    stage.scene.render.use_motion_blur, stage.scene.render.motion_blur_shutter = True, 2.0


def _steps(item: str, count: int) -> Callable[[Stage], None]:
    return lambda stage: setattr(getattr(stage, item).cycles, "motion_steps", count)


def _shape_in_motion(stage: Stage) -> None:
    stage.ball.shape_key_add(name="Basis")
    key = stage.ball.shape_key_add(name="Wide")
    for point in key.data:
        point.co.x *= 2.0
    _keyed(stage, key, "value", 0.0, 0.2, 1.0)


def _turned_parent(stage: Stage) -> None:
    """The ball on an arm that turns by 120° while the shutter is open."""
    arm = stage.object("Arm", None, (0, 0, 0))
    stage.ball.parent, stage.ball.scale, stage.ball.location = arm, (0.4, 0.4, 0.4), (1.2, 0, 0.5)
    _keyed(stage, arm, "rotation_euler", (0, 0, -1.0), (0, 0, 0), (0, 0, 1.0))


_CAMERA = ((-0.6, -6, 2.4), (0.0, -5.0, 2.4), (0.6, -6, 2.4))
_TURN = ((1.35, 0, -0.3), (1.35, 0.2, 0), (1.2, 0, 0.3))
feature("unusual/camera on an arc", lambda s: _keyed(s, s.camera, "location", *_CAMERA), 2)
feature("unusual/camera that turns", lambda s: _keyed(s, s.camera, "rotation_euler", *_TURN), 2)
feature("unusual/camera on an arc in five steps", _then(_steps("camera", 2), lambda s: _keyed(
    s, s.camera, "location", *_CAMERA)), 2)  # fmt: skip
feature("unusual/ball on a turning arm", _turned_parent, 2)
feature("unusual/ball on a turning arm in nine steps", _then(_steps("ball", 3), _turned_parent), 2)
feature("unusual/shape in motion", _shape_in_motion, 2)
feature("unusual/shape in motion at the end", _then(_shape_in_motion, _set(
    "render", motion_blur_position="END")), 2)  # fmt: skip
feature("unusual/ball without motion blur at the start", lambda s: (_keyed(
    s, s.ball, "location", (-1, 0, 1), (0, 0, 1), (1, 0, 1)), setattr(s.ball.cycles, "use_motion_blur", False),
    setattr(s.scene.render, "motion_blur_position", "START")), 2)  # fmt: skip
feature("unusual/lamp that moves, at the start", lambda s: (_keyed(
    s, s.lamp, "location", (-1, -2, 4), (1, -2, 4), (3, -2, 4)), setattr(
    s.scene.render, "motion_blur_position", "START")), 2)  # fmt: skip

# --- films and layers -----------------------------------------------------------------------------------------------


def _group(stage: Stage, item: Any, flag: str) -> None:
    own = bpy.data.collections.new(f"Own {flag}")
    stage.scene.collection.children.link(own)
    stage.scene.collection.objects.unlink(item)
    own.objects.link(item)
    setattr(stage.layer.layer_collection.children[own.name], flag, True)


feature("unusual/holdout ball over an indirect floor", lambda s: (
    setattr(s.scene.render, "film_transparent", True), _group(s, s.ball, "holdout"),
    _group(s, s.floor, "indirect_only")))  # fmt: skip
feature("unusual/mirror over a holdout floor", lambda s: (
    s.shader("ShaderNodeBsdfAnisotropic", Roughness=0.0), setattr(s.scene.render, "film_transparent", True),
    setattr(s.floor, "is_holdout", True)))  # fmt: skip
feature("unusual/exposure and wide Gaussian of a transparent film", _then(
    _set("render", film_transparent=True), _set("cycles", film_exposure=0.5, pixel_filter_type="GAUSSIAN",
                                               filter_width=4.0)))  # fmt: skip
feature("unusual/catcher under a sun", lambda s: (s.replace_lamp("SUN", 3.0, angle=0.2), s.set_world((0.3, 0.3, 0.3)),
        setattr(s.floor, "is_shadow_catcher", True), setattr(s.scene.render, "film_transparent", True)), 2)  # fmt: skip
feature("unusual/layer with a material and a world of its own", lambda s: (
    setattr(s.layer, "material_override", s.material("Over", "ShaderNodeBsdfPrincipled", Roughness=0.2)),
    setattr(s.layer, "use_sky", False)))  # fmt: skip
feature("unusual/world hidden from the camera, and mist", lambda s: (
    setattr(s.scene.world.cycles_visibility, "camera", False), setattr(s.layer, "use_pass_mist", True)))  # fmt: skip
feature(
    "unusual/lens that is not clean: border, percentage and aspect",
    _set("render", use_border=True, border_min_x=0.2, border_max_y=0.8, resolution_percentage=75, pixel_aspect_y=1.5),
)

# SPDX-License-Identifier: GPL-3.0-or-later
"""Film and render settings: exposure, filters, transparency, view layers, limits of light paths, blur."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy

from benchmarks.render.features import feature
from benchmarks.render.features.stage import Stage


def _cycles(**values: Any) -> Callable[[Stage], None]:
    def build(stage: Stage) -> None:
        for name, value in values.items():
            setattr(stage.scene.cycles, name, value)

    return build


def _render(**values: Any) -> Callable[[Stage], None]:
    def build(stage: Stage) -> None:
        for name, value in values.items():
            setattr(stage.scene.render, name, value)

    return build


def _then(*steps: Callable[[Stage], object]) -> Callable[[Stage], None]:
    def build(stage: Stage) -> None:
        for step in steps:
            step(stage)

    return build


def _glass(stage: Stage) -> None:
    stage.shader("ShaderNodeBsdfGlass", Roughness=0.0, IOR=1.45)


def _mirror(stage: Stage) -> None:
    stage.shader("ShaderNodeBsdfAnisotropic", Roughness=0.1)


def _closed(stage: Stage) -> None:
    """Walls around: light that bounces often matters."""
    white = stage.material("White", Color=(0.8, 0.8, 0.8, 1))
    for location, rotation in (((-2, 0, 0), (0, 1.5708, 0)), ((2, 0, 0), (0, -1.5708, 0)), ((0, 2, 0), (1.5708, 0, 0))):
        stage.plane(12.0, white, location, rotation)
    stage.lamp.location, stage.lamp.rotation_euler = (0, -1.0, 3.5), (0, 0, 0)


def _panes(stage: Stage) -> None:
    """Panes of colored, transparent film in front of the ball."""
    film = stage.material("Film", "ShaderNodeBsdfTransparent", Color=(0.8, 0.9, 0.7, 1))
    for k in range(6):
        stage.plane(2.5, film, (0, -1.5 - 0.1 * k, 1.2), (1.5708, 0, 0))


def _through(material: Callable[[Stage], object]) -> Callable[[Stage], None]:
    """A material whose glass the transparent film is seen through."""
    return _then(material, _render(film_transparent=True), _cycles(film_transparent_glass=True))


feature("film/stage", lambda s: None)
feature("film/exposure", _cycles(film_exposure=2.0))
feature("film/view exposure", lambda s: setattr(s.scene.view_settings, "exposure", 1.0))
feature("film/transparent", _render(film_transparent=True))
feature("film/transparent glass", _through(_glass), 2)
feature(
    "film/transparent glass of Principled",
    _through(lambda s: s.shader("ShaderNodeBsdfPrincipled", Roughness=0.0, Transmission_Weight=1.0)),
    2,
)
feature(
    "film/transparent glass, rough",
    _through(lambda s: s.shader("ShaderNodeBsdfGlass", Roughness=0.4, IOR=1.45)),
    2,
)
feature("film/transparent behind glass", _then(_glass, _render(film_transparent=True)), 2)
feature("film/transparent behind a pane", _then(_panes, _render(film_transparent=True)))
for _kind in ("BOX", "GAUSSIAN", "BLACKMAN_HARRIS"):
    feature(f"film/filter {_kind.lower()}", _cycles(pixel_filter_type=_kind, filter_width=3.0))
feature("film/render filter size", _render(filter_size=5.0))
feature("film/percentage", _render(resolution_percentage=50))
feature("film/pixel aspect", _render(pixel_aspect_x=2.0))
feature("film/border", _render(use_border=True, border_min_x=0.25, border_max_x=0.75, border_min_y=0.25))
feature("film/border cropped", _render(use_border=True, use_crop_to_border=True, border_min_x=0.25, border_max_x=0.75))
for _name in ("max_bounces", "diffuse_bounces"):
    for _value in (0, 1, 3):
        feature(f"film/{_name} {_value}", _then(_closed, _cycles(**{_name: _value})))
for _value in (0, 1):
    feature(f"film/glossy_bounces {_value}", _then(_mirror, _cycles(glossy_bounces=_value)))
    feature(f"film/transmission_bounces {_value}", _then(_glass, _cycles(transmission_bounces=_value)), 2)
    feature(f"film/transparent_max_bounces {_value}", _then(_panes, _cycles(transparent_max_bounces=_value)))
feature("film/min light bounces", _cycles(min_light_bounces=4))
feature("film/clamp direct", _cycles(sample_clamp_direct=0.2))
feature("film/clamp indirect", _then(_closed, _cycles(sample_clamp_indirect=0.1)))
feature("film/no reflective caustics", _then(_mirror, _closed, _cycles(caustics_reflective=False)))
feature("film/no refractive caustics", _then(_glass, _cycles(caustics_refractive=False)), 2)
feature("film/filter glossy", _then(_mirror, _closed, _cycles(blur_glossy=5.0)))
feature("film/light threshold", _cycles(light_sampling_threshold=0.5))
feature("film/light tree off", _cycles(use_light_tree=False))
feature("film/fast gi replace", _cycles(use_fast_gi=True, fast_gi_method="REPLACE", ao_bounces_render=1), 2)
feature("film/fast gi add", _then(_cycles(use_fast_gi=True, fast_gi_method="ADD")), 2)
feature("film/denoising", _cycles(use_denoising=True))
feature("film/adaptive sampling", _cycles(use_adaptive_sampling=True))
feature("film/simplify", _then(
    lambda s: setattr(s.ball.modifiers.new("S", "SUBSURF"), "render_levels", 2),
    _render(use_simplify=True, simplify_subdivision_render=0)))  # fmt: skip
feature("film/camera cull", _then(lambda s: setattr(s.ball.cycles, "use_camera_cull", True), lambda s: setattr(
    s.ball, "location", (6, 0, 1)), _render(use_simplify=True), _cycles(use_camera_cull=True)))  # fmt: skip


# --- view layers ---------------------------------------------------------------------------------------------------


def _layer(**values: Any) -> Callable[[Stage], None]:
    def build(stage: Stage) -> None:
        for name, value in values.items():
            setattr(stage.layer, name, value)

    return build


def _collection(flag: str) -> Callable[[Stage], None]:
    """The ball in a collection of its own with a flag of the view layer set."""

    def build(stage: Stage) -> None:
        own = bpy.data.collections.new("Own")
        stage.scene.collection.children.link(own)
        stage.scene.collection.objects.unlink(stage.ball)
        own.objects.link(stage.ball)
        setattr(stage.layer.layer_collection.children["Own"], flag, True)
        stage.scene.render.film_transparent = True

    return build


feature("film/layer without environment", _layer(use_sky=False))
feature("film/layer without surfaces", _layer(use_solid=False))
feature("film/layer without volumes", _layer(use_volumes=False))
feature("film/layer without hair", _layer(use_strand=False))
feature("film/layer samples", _layer(samples=8))
feature("film/layer material override", lambda s: setattr(
    s.layer, "material_override", s.material("Over", Color=(0.1, 0.6, 0.2, 1))))  # fmt: skip


def _world_override(stage: Stage) -> None:
    kept = stage.scene.world
    stage.set_world((0.8, 0.2, 0.1))
    stage.layer.world_override, stage.scene.world = stage.scene.world, kept


feature("film/layer world override", _world_override)
for _flag in ("holdout", "indirect_only", "exclude"):
    feature(f"film/layer collection {_flag}", _collection(_flag))
feature("film/layer hidden", lambda s: s.ball.hide_set(True))
feature("film/holdout object", _then(lambda s: setattr(s.ball, "is_holdout", True), _render(film_transparent=True)))
feature("film/holdout object over sky", lambda s: setattr(s.ball, "is_holdout", True))
feature("film/shadow catcher", _then(lambda s: setattr(s.floor, "is_shadow_catcher", True), _render(
    film_transparent=True)))  # fmt: skip


# --- motion --------------------------------------------------------------------------------------------------------


def _moving(which: str, **values: Any) -> Callable[[Stage], None]:
    def build(stage: Stage) -> None:
        mover = getattr(stage, which)
        start = mover.location.copy()
        mover.keyframe_insert("location", frame=0)
        mover.location = (start[0] + 1.5, start[1], start[2] + 0.5)
        mover.keyframe_insert("location", frame=2)
        stage.scene.frame_set(1)
        stage.scene.render.use_motion_blur = True
        for name, value in values.items():
            setattr(stage.scene.render, name, value)

    return build


feature("film/motion blur of an object", _moving("ball", motion_blur_shutter=1.0), 2)
feature("film/motion blur of the camera", _moving("camera", motion_blur_shutter=1.0), 2)
feature("film/motion blur of a lamp", _moving("lamp", motion_blur_shutter=1.0), 2)
feature("film/motion blur at the start", _moving("ball", motion_blur_position="START"), 2)
feature("film/motion blur off for the object", _then(
    lambda s: setattr(s.ball.cycles, "use_motion_blur", False), _moving("ball")), 2)  # fmt: skip
feature("film/motion blur without motion", _render(use_motion_blur=True))

# SPDX-License-Identifier: GPL-3.0-or-later
"""Overlapping faces, directions on stretched objects, settings of instancers: all were wrong without a note."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from benchmarks.render.features import feature
from benchmarks.render.features.stage import Stage

Build = Callable[[Stage], object]
MIRRORED, SQUEEZED = (-1.0, 1.0, 0.8), (1.0, 1.0, 0.3)


def _poster(stage: Stage) -> None:
    """A square in the plane of the floor."""
    stage.plane(2.2, stage.material("Poster", Color=(0.5, 0.5, 0.5, 1)), (0.3, -1.0, 0.0), (0, 0, 0.4))


def _boxes(stage: Stage) -> None:
    """Two turned boxes whose tops and sides overlap in part."""
    stage.ball.hide_render = True
    paint = stage.material("Box", Color=(0.6, 0.6, 0.2, 1))
    for along in (-0.4, 0.4):
        stage.cube(paint, (along * np.cos(0.5), along * np.sin(0.5), 0.6), 1.2, (0, 0, 0.5))


def _normal_map(stage: Stage, scale: tuple[float, float, float]) -> None:
    """A strong normal map over a second UV map that is turned, mirrored and stretched."""
    data = stage.ball.data
    first, second = data.uv_layers[0], data.uv_layers.new(name="Two")
    values = np.zeros(2 * len(first.uv), np.float32)
    first.uv.foreach_get("vector", values)
    second.uv.foreach_set("vector", (values.reshape(-1, 2)[:, ::-1] * (2, -1.5)).astype(np.float32).ravel())
    image = stage.node("ShaderNodeTexImage")
    image.image = stage.image()
    image.image.colorspace_settings.name = "Non-Color"
    bent = stage.node("ShaderNodeNormalMap", uv_map="Two", Strength=0.8)
    stage.link(image.outputs[0], bent.inputs["Color"])
    stage.link(bent.outputs[0], stage.tree().nodes["shader"].inputs["Normal"])
    stage.ball.scale = scale


def _tangent(stage: Stage) -> None:
    """The tangent of a UV map, shown as a color, on a turned and squeezed ball."""
    stage.glow(stage.node("ShaderNodeTangent", direction_type="UV_MAP").outputs[0])
    stage.ball.scale, stage.ball.rotation_euler = (1.0, 1.0, 0.4), (0.5, 0.2, 0.3)


def _displaced(stage: Stage, scale: tuple[float, float, float]) -> None:
    """Vector displacement of tangent space by colored noise."""
    stage.material_of_ball.displacement_method = "DISPLACEMENT"
    moved = stage.node("ShaderNodeVectorDisplacement", space="TANGENT", Scale=0.3)
    noise = stage.node("ShaderNodeTexNoise", Scale=2.0)
    stage.link(stage.node("ShaderNodeTexCoord").outputs["Generated"], noise.inputs["Vector"])
    stage.link(noise.outputs["Color"], moved.inputs["Vector"])
    stage.link(moved.outputs[0], stage.tree().nodes["output"].inputs["Displacement"])
    stage.ball.scale = scale


def _quaternions(stage: Stage) -> None:
    layer = stage.ball.data.attributes.new("Turn", "QUATERNION", "POINT")
    values = np.random.default_rng(1).uniform(0, 1, 4 * len(layer.data))
    layer.data.foreach_set("value", values.astype(np.float32))
    stage.into_color(stage.node("ShaderNodeAttribute", attribute_name="Turn").outputs["Color"])


def _shown_by(stage: Stage, setting: str, *, value: bool) -> None:
    """A ball in a collection that an empty shows; a setting of the empty."""
    stage.ball.location = (0, 0, 0)
    stage.instance_at(stage.ball, (0.3,))
    empty = stage.scene.objects["Empty 0.3"]
    empty.location.z, empty.scale = 1.0, (0.8, 0.8, 0.8)
    setattr(empty, setting, value)
    stage.scene.render.film_transparent = setting in ("is_holdout", "is_shadow_catcher")


_SCENES: dict[str, Build] = {
    "poster in the plane of the floor": _poster,
    "boxes that overlap in part": _boxes,
    "normal map on a squeezed ball": lambda stage: _normal_map(stage, SQUEEZED),
    "normal map on a mirrored ball": lambda stage: _normal_map(stage, MIRRORED),
    "tangent of a squeezed ball": _tangent,
    "vector displacement of a squeezed ball": lambda stage: _displaced(stage, SQUEEZED),
    "vector displacement of a mirrored ball": lambda stage: _displaced(stage, MIRRORED),
    "attribute of quaternions": _quaternions,
    "empty that is a holdout": lambda stage: _shown_by(stage, "is_holdout", value=True),
    "empty that is a shadow catcher": lambda stage: _shown_by(stage, "is_shadow_catcher", value=True),
    "empty that the camera does not see": lambda stage: _shown_by(stage, "visible_camera", value=False),
    "empty that casts no shadow": lambda stage: _shown_by(stage, "visible_shadow", value=False),
}  # fmt: skip
for _name, _build in _SCENES.items():
    feature(f"placed/{_name}", _build)

# SPDX-License-Identifier: GPL-3.0-or-later
"""Image textures: alpha, color spaces, projections, extensions, interpolations, several UV maps."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from benchmarks.render.features import feature
from benchmarks.render.features.stage import Stage


def _textured(
    options: dict[str, Any] | None = None, *, coordinate: str | None = None, **image: Any
) -> Callable[[Stage], Any]:
    """An image as the color of the ball; returns the texture node."""

    def build(stage: Stage) -> Any:
        node = stage.node("ShaderNodeTexImage", **(options or {}))
        node.image = stage.image(**image)
        if coordinate is not None:
            stage.link(stage.node("ShaderNodeTexCoord").outputs[coordinate], node.inputs["Vector"])
        stage.into_color(node.outputs["Color"])
        return node

    return build


feature("images/color", _textured())
feature("images/float", _textured(float_buffer=True))
feature("images/large", _textured(size=(256, 128)))
for _kind in ("Linear", "Closest", "Cubic", "Smart"):
    feature(f"images/{_kind.lower()}", _textured({"interpolation": _kind}, size=(8, 8)))
for _coordinate in ("Generated", "Object", "Normal", "Window", "Camera", "Reflection"):
    feature(f"images/over {_coordinate}", _textured(coordinate=_coordinate))
for _projection in ("BOX", "SPHERE", "TUBE"):
    feature(f"images/projection {_projection.lower()}", _textured({"projection": _projection}, coordinate="Object"))
feature("images/projection box blended", _textured({"projection": "BOX", "projection_blend": 0.5}, coordinate="Object"))
for _extension in ("REPEAT", "EXTEND", "CLIP", "MIRROR"):

    def _extended(stage: Stage, extension: str = _extension) -> None:
        node = _textured({"extension": extension})(stage)
        mapping = stage.node("ShaderNodeMapping", Scale=(2.5, 2.5, 1.0), Location=(-0.4, -0.6, 0.0))
        stage.link(stage.node("ShaderNodeTexCoord").outputs["UV"], mapping.inputs["Vector"])
        stage.link(mapping.outputs["Vector"], node.inputs["Vector"])

    feature(f"images/extension {_extension.lower()}", _extended)
for _space in ("sRGB", "Non-Color", "Linear Rec.709", "Linear Rec.2020", "ACEScg", "Filmic sRGB", "AgX Base sRGB",
               "Linear CIE-XYZ D65"):  # fmt: skip

    def _spaced(stage: Stage, space: str = _space) -> None:
        _textured()(stage).image.colorspace_settings.name = space

    feature(f"images/space {_space}", _spaced)
for _mode in ("STRAIGHT", "PREMUL", "CHANNEL_PACKED", "NONE"):
    for _used in (False, True):

        def _alpha(stage: Stage, mode: str = _mode, used: bool = _used) -> None:
            stage.shader("ShaderNodeBsdfPrincipled", Roughness=1.0)
            node = _textured(alpha=True)(stage)
            node.image.alpha_mode = mode
            if used:
                stage.link(node.outputs["Alpha"], stage.tree().nodes["shader"].inputs["Alpha"])

        feature(f"images/alpha {_mode.lower()} {'linked' if _used else 'unlinked'}", _alpha)


def _float_alpha(stage: Stage) -> None:
    stage.shader("ShaderNodeBsdfPrincipled", Roughness=1.0)
    node = _textured(alpha=True, float_buffer=True)(stage)
    stage.link(node.outputs["Alpha"], stage.tree().nodes["shader"].inputs["Alpha"])


feature("images/alpha of floats", _float_alpha)


def _two_maps(stage: Stage) -> None:
    uvs = stage.ball.data.uv_layers.new(name="Second")
    values = np.empty(len(uvs.uv) * 2, np.float32)
    stage.ball.data.uv_layers[0].uv.foreach_get("vector", values)
    uvs.uv.foreach_set("vector", (values * 3.0).astype(np.float32))
    first = _textured()(stage)
    second = stage.node("ShaderNodeTexImage")
    second.image = stage.image("Other")
    stage.link(stage.node("ShaderNodeUVMap", uv_map="Second").outputs[0], second.inputs["Vector"])
    mix = stage.node("ShaderNodeMixRGB", blend_type="MULTIPLY")
    mix.inputs[0].default_value = 1.0
    stage.link(first.outputs["Color"], mix.inputs[1])
    stage.link(second.outputs["Color"], mix.inputs[2])
    stage.into_color(mix.outputs[0])


feature("images/two uv maps", _two_maps)
feature("images/missing", lambda s: setattr(_textured()(s), "image", None))
feature("images/as mix factor", lambda s: (lambda node: (
    s.link(_textured()(s).outputs["Color"], node.inputs[0]), s.into_color(node.outputs[0])))(
    s.node("ShaderNodeMixRGB")))  # fmt: skip


def _turned(stage: Stage, **values: Any) -> None:
    node = _textured()(stage)
    mapping = stage.node("ShaderNodeMapping", **values)
    stage.link(stage.node("ShaderNodeTexCoord").outputs["UV"], mapping.inputs["Vector"])
    stage.link(mapping.outputs["Vector"], node.inputs["Vector"])


feature("images/mapping", lambda s: _turned(s, Rotation=(0.0, 0.0, 0.6), Scale=(2.0, 3.0, 1.0)))
feature("images/mapping tilted", lambda s: _turned(s, Rotation=(0.6, 0.3, 0.0)))


def _saved(stage: Stage, name: str, number: int, size: int = 16) -> Path:
    """A picture of one color per number, with the test picture's changes in it, as a file in a folder that stays."""
    folder = Path(tempfile.gettempdir()) / "spectral_feature_images"
    folder.mkdir(exist_ok=True)
    made = stage.image(f"{name} {number}", (size, size))
    pixels = np.array(made.pixels[:]).reshape(-1, 4)
    pixels[:, :3] *= [(0.3 + 0.2 * (number % 3)), 1.0 - 0.2 * (number % 4), 0.4 + 0.1 * (number % 5)]
    made.pixels.foreach_set(pixels.astype(np.float32).ravel())
    made.update()
    path = folder / f"{name}{number}.png"
    made.filepath_raw, made.file_format = str(path), "PNG"
    made.save()
    bpy.data.images.remove(made)
    return path


def _udim(numbers: tuple[int, ...], sizes: tuple[int, ...] = (16,)) -> Callable[[Stage], Any]:
    """UV maps that reach over three columns and two rows of tiles."""

    def build(stage: Stage) -> Any:
        for k, number in enumerate(numbers):
            _saved(stage, "udim.", number, sizes[k % len(sizes)])
        image = bpy.data.images.load(str(_saved(stage, "udim.", numbers[0], sizes[0])))
        image.source = "TILED"
        image.filepath = str(Path(image.filepath).with_name("udim.<UDIM>.png"))
        for number in numbers:
            if all(tile.number != number for tile in image.tiles):
                image.tiles.new(number)
        node = stage.node("ShaderNodeTexImage")
        node.image = image
        mapping = stage.node("ShaderNodeMapping", Scale=(3.0, 2.0, 1.0))
        stage.link(stage.node("ShaderNodeTexCoord").outputs["UV"], mapping.inputs["Vector"])
        stage.link(mapping.outputs["Vector"], node.inputs["Vector"])
        stage.into_color(node.outputs["Color"])
        return node

    return build


def _missing(stage: Stage) -> None:
    image = _textured()(stage).image
    image.unpack(method="REMOVE")
    image.source, image.filepath = "FILE", "/nowhere/lost.png"


def _missing_sky(stage: Stage) -> None:
    texture = stage.node("ShaderNodeTexEnvironment", stage.world)
    stage.link(texture.outputs["Color"], stage.tree(stage.world).nodes["Background"].inputs["Color"])


feature("images/missing file", _missing)
feature("images/no image", lambda s: setattr(_textured()(s), "image", None))
feature("images/environment without image", _missing_sky)


ALL_TILES = (1001, 1002, 1003, 1011, 1012, 1013)
feature("images/udim", _udim(ALL_TILES))
feature("images/udim of several sizes", _udim(ALL_TILES, (16, 32)))
feature("images/udim with tiles missing", _udim((1001, 1003, 1012)))
feature("images/udim closest", lambda s: setattr(_udim(ALL_TILES)(s), "interpolation", "Closest"))


def _sequence(frame: int, **user: Any) -> Callable[[Stage], None]:
    def build(stage: Stage) -> None:
        for number in range(1, 6):
            _saved(stage, "frame_000", number)
        image = bpy.data.images.load(str(_saved(stage, "frame_000", 1)))
        image.source = "SEQUENCE"
        node = stage.node("ShaderNodeTexImage")
        node.image = image
        node.image_user.frame_duration, node.image_user.use_auto_refresh = 5, True
        for name, value in user.items():
            setattr(node.image_user, name, value)
        stage.scene.frame_set(frame)
        stage.into_color(node.outputs["Color"])

    return build


feature("images/sequence", _sequence(3))
feature("images/sequence that starts later", _sequence(6, frame_start=3))
feature("images/sequence with an offset", _sequence(2, frame_offset=2))
feature("images/sequence that repeats", _sequence(9, use_cyclic=True))
feature("images/sequence past its end", _sequence(30))

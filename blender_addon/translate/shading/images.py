# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender images as pixels with a stated color space; a missing image gives a Note and, as in Cycles, magenta."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import partial
from typing import Any, Literal

import bpy
import numpy as np
from numpy.typing import NDArray

from spectral_core.scene import ImageTexture
from spectral_core.spectra.color import linear_from_display_rgb

from ..context import ReadImage, Translation
from ..ledger import note_changed
from ..questions import state_of_file
from .image_files import frame_image, frame_of, tile_image, tiles_of
from .image_files.alpha import averaged, file_bytes, is_from_file, is_gray_file, multiplied, multiplied_floats
from .image_files.color_spaces import VIDEO_SPACES, VIDEO_WHITE, as_in_file, holds_numbers, is_linear, scene_linear
from .image_files.layered import colors_of_layer, first_layer, is_layered
from .tree import Output, is_read, wanted_aovs

Array = NDArray[Any]

EXTENSIONS: dict[str, Literal["repeat", "clip", "extend", "mirror"]] = {
    "REPEAT": "repeat",
    "EXTEND": "extend",
    "CLIP": "clip",
    "MIRROR": "mirror",
}
INTERPOLATIONS: dict[str, Literal["nearest", "cubic"]] = {"Closest": "nearest", "Cubic": "cubic", "Smart": "cubic"}
CHUNK = 1 << 16
"""Numbers of an image that are converted at once."""
MOVING = ("SEQUENCE", "MOVIE")
"""Sources of images that show another picture at each frame."""
WHOLE, FRAME, TILE, STACKED, USE = "whole", "frame", "tile", "stacked", "use"
"""First words of the keys of images that were read, by what they are; Blender's image follows, as ``_image_key``."""


def image_of_node(translation: Translation, output: Output, owner: str) -> ImageTexture | None:
    """Image of an Image or Environment Texture node with the node's interpolation and extension.

    ``output``: its Color or its Alpha (one raw channel); ``owner``: owner of the node. None, with a Note, without a
    picture; None for an alpha that is 1 beside the picture as well.
    """
    node, channel, image = output.node, output.socket.name, output.node.image
    if image is None:
        translation.note(owner, f"{node.name!r} has no image; it is magenta, as in Cycles")
        return None
    if image.source in MOVING:
        texture = _frame(translation, node, channel, alpha_is_read(translation, output))
    else:
        texture = read_image(translation, image, channel, alpha_is_read=alpha_is_read(translation, output))
    if texture is None or (channel == "Alpha" and is_gray_file(image)):
        return None
    extension = EXTENSIONS.get(getattr(node, "extension", "REPEAT"), "repeat")
    interpolation: Literal["linear", "nearest", "cubic"] = INTERPOLATIONS.get(node.interpolation, "linear")
    if (texture.extension, texture.interpolation) == (extension, interpolation):
        return texture
    # one object per use, so that the renderer stores it once
    key = (USE, *_image_key(image), id(texture), extension, interpolation)
    used = replace(texture, extension=extension, interpolation=interpolation)
    return translation.image(key, lambda: used)


def _frame(translation: Translation, node: Any, channel: str, reads_alpha: bool) -> ImageTexture | None:
    """The file of a sequence, or the picture of a movie, that a node shows at the scene's frame."""
    translation.reads_elsewhere = True  # the scene's frame
    image, number = node.image, frame_of(node.image_user, int(translation.scene.frame_current))
    key = (FRAME, *_image_key(image), channel, reads_alpha, number)

    def make() -> ImageTexture | None:
        with frame_image(image, number) as found:
            if found is not None:
                return _read(translation, found, channel, reads_alpha)
        where = f"{image.filepath}, file {number}" if image.source == "SEQUENCE" else image.filepath or "no file"
        translation.note(image.name, f"the image could not be read ({where}); it is magenta, as in Cycles")
        return None

    return translation.image(key, make)


def tiles_of_node(translation: Translation, output: Output) -> list[tuple[tuple[int, ...], ImageTexture]]:
    """Tiles of an Image Texture whose image is a UDIM set: those of one size are stacked in one image."""
    node, channel, reads_alpha = output.node, output.socket.name, alpha_is_read(translation, output)
    image = node.image
    groups: dict[Any, list[tuple[int, ImageTexture]]] = {}
    for number in tiles_of(image):
        key = (TILE, *_image_key(image), channel, reads_alpha, number)
        tile = translation.image(key, partial(_tile, translation, image, number, channel, reads_alpha))
        if tile is None:
            translation.note(image.name, f"tile {number} of this UDIM image could not be read; it is magenta")
            continue
        groups.setdefault((tile.pixels.shape, tile.pixels.dtype, tile.color_space), []).append((number, tile))
    return [(tuple(n for n, _ in of), _stacked(translation, node, of, channel)) for of in groups.values()]


def _tile(translation: Translation, image: Any, number: int, channel: str, reads_alpha: bool) -> ImageTexture | None:
    with tile_image(image, number) as found:
        return None if found is None else _read(translation, found, channel, reads_alpha)


def _stacked(translation: Translation, node: Any, of: list[tuple[int, ImageTexture]], channel: str) -> ImageTexture:
    """Tiles of one size as one image, made once per use."""
    extension = EXTENSIONS.get(node.extension, "repeat")
    interpolation: Literal["linear", "nearest", "cubic"] = INTERPOLATIONS.get(node.interpolation, "linear")
    key = (STACKED, *_image_key(node.image), *(id(tile) for _, tile in of), extension, interpolation)

    def make() -> ImageTexture:
        pixels = np.concatenate([tile.pixels for _, tile in of])
        stacked = replace(of[0][1], name=f"{node.image.name} ({channel}, {len(of)} tiles)", pixels=pixels)
        return replace(stacked, extension=extension, interpolation=interpolation)

    found = translation.image(key, make)
    assert found is not None
    return found


def alpha_is_read(translation: Translation, output: Output) -> bool:
    """True if the Alpha of an image's node counts: its color is then not multiplied by alpha, as in Cycles."""
    return is_read(output, "Alpha", wanted_aovs(translation.depsgraph))


def read_image(
    translation: Translation, image: Any, channel: str = "Color", *, alpha_is_read: bool = True
) -> ImageTexture | None:
    """Pixels of a ``bpy.types.Image``, read once per translation and use; None, with a Note, without pixels.

    ``alpha_is_read``: True if the alpha is used too; otherwise colors are multiplied by it, as in Cycles.
    """
    key = (WHOLE, *_image_key(image), channel, alpha_is_read)
    return translation.image(
        key, partial(_read, translation, image, channel, alpha_is_read), _source_of(image, is_read=True)
    )


def _source_of(image: Any, *, is_read: bool = False) -> tuple[int, ...] | None:
    """The state of the file from which Blender loads an image; None if it cannot be told.

    ``is_read``: True if the image is read now, from what Blender has loaded, at an unknown time, or painted.
    """
    if is_read and image.is_dirty:
        return None
    if image.packed_file is not None:
        return (int(image.packed_file.size),)
    if image.source == "GENERATED":
        return ()
    if image.source != "FILE" or (is_read and image.has_data):
        return None
    return state_of_file(bpy.path.abspath(image.filepath, library=image.library))


def _image_key(image: Any) -> tuple[int, tuple[Any, ...]]:
    """Session number of an image, and what its pixels follow from beside its file, if nobody has painted on it."""
    made = image.generated_type, tuple(image.generated_color), image.generated_width, image.generated_height
    state = image.name_full, image.filepath, image.source, image.colorspace_settings.name, image.alpha_mode
    return image.session_uid, (image.is_dirty, *state, *made, image.use_generated_float)


def outdated(read: Mapping[Any, ReadImage], images: Iterable[Any]) -> set[int]:
    """Session numbers of the images whose pixels Blender has freed since they were read, unless it loads the same ones
    again. It frees them at an undo, and at ``Image.reload()`` in a script, of which it reports materials alone.

    ``read``: as ``Translation.images``; ``images``: Blender's.
    """
    whole = [(key[1], found.source) for key, found in read.items() if key[0] == WHOLE and found.texture is not None]
    numbers = {number for number, _ in whole}
    freed = {image.session_uid: image for image in images if image.session_uid in numbers and not image.has_data}
    now = {number: _source_of(image) for number, image in freed.items()}
    return {number for number, source in whole if number in now and (source is None or source != now[number])}


def exchanged(read: Iterable[Any], images: Iterable[Any]) -> set[int]:
    """Session numbers of the images whose pixels an undo may have exchanged: painted ones, and those that are read from
    several files.
    """
    kept = {image.session_uid for image in images if image.source in ("FILE", "GENERATED") and not image.is_dirty}
    return {key[1] for key in read} - kept


def moving(images: Iterable[Any]) -> set[int]:
    """Session numbers of the images that each frame may change without a report."""
    return {image.session_uid for image in images if image.source in MOVING}


def _read(translation: Translation, image: Any, channel: str, alpha_is_read: bool) -> ImageTexture | None:
    width, height = image.size
    if width == 0 or height == 0 or len(image.pixels) == 0:
        where, layer = image.filepath or "no file", first_layer(image) if is_layered(image) else None
        if layer is not None:
            return _layer(translation, image, layer, channel, alpha_is_read)
        translation.note(image.name, f"the image could not be read ({where}); it is magenta, as in Cycles")
        return None
    note_changed(translation, image.name, image)
    if image.is_dirty and is_from_file(image):
        translation.note(image.name, "it shows what was painted and not saved; a final render of Cycles reads the file")
    if image.source == "TILED":
        translation.note(image.name, "only the first tile of this tiled (UDIM) image is used")
    values = np.empty(len(image.pixels), dtype=np.float32)
    image.pixels.foreach_get(values)
    pixels = (values if image.is_float else _levels(values)).reshape(height, width, -1)
    if image.is_float and not np.isfinite(pixels).all():
        translation.note(image.name, "pixels that are not finite numbers were taken as black")
        pixels = np.where(np.isfinite(pixels), pixels, np.float32(0))
    has_alpha = pixels.shape[2] == 4 and image.alpha_mode != "NONE"
    if channel == "Alpha":
        alpha = pixels[..., 3:4] if has_alpha else np.full((height, width, 1), 255, np.uint8)
        return ImageTexture(f"{image.name} (alpha)", np.ascontiguousarray(alpha), color_space="raw")
    colors = np.ascontiguousarray(pixels[..., :3] if pixels.shape[2] >= 3 else pixels[..., :1])
    multiplies = has_alpha and image.alpha_mode != "CHANNEL_PACKED" and not holds_numbers(image)
    coverage = pixels[..., 3:4] if multiplies else None
    read = _float_image if image.is_float else _byte_image
    return read(translation, image, colors, coverage, alpha_is_read)


def _layer(translation: Translation, image: Any, layer: Array, channel: str, alpha_is_read: bool) -> ImageTexture:
    """The first layer (height, width, 4) of a file of several, whose colors are multiplied by its alpha."""
    layer = np.where(np.isfinite(layer), layer, np.float32(0))
    if channel == "Alpha":
        return ImageTexture(f"{image.name} (alpha)", np.ascontiguousarray(layer[..., 3:]), color_space="raw")
    colors = _with_alpha(colors_of_layer(translation, image, layer), layer[..., 3:], alpha_is_read)
    return ImageTexture(image.name, colors, color_space="raw" if holds_numbers(image) else "linear")


def _levels(values: Array) -> Array:
    """The bytes 0 to 255 of a byte image, whose ``values`` Blender gives as shares; in parts that fit into a cache."""
    levels = np.empty(values.shape, dtype=np.uint8)
    for start in range(0, len(values), CHUNK):
        levels[start : start + CHUNK] = values[start : start + CHUNK] * np.float32(255) + np.float32(0.5)
    return levels


def _float_image(
    translation: Translation, image: Any, colors: Array, alpha: Array | None, alpha_is_read: bool
) -> ImageTexture:
    """The image of floats, which Blender has already brought to its scene-linear space.

    ``alpha``: (height, width, 1) by which colors are multiplied; None for none.
    """
    divided, space, colors = None, image.colorspace_settings.name, averaged(image, colors)
    if alpha is not None:
        colors, divided = multiplied_floats(image, colors, alpha)
    if space in VIDEO_SPACES and is_from_file(image):
        colors = colors * VIDEO_WHITE
    colors = _with_alpha(colors, alpha, alpha_is_read)
    if holds_numbers(image):
        return ImageTexture(image.name, colors, color_space="raw")
    if space == "sRGB" and is_from_file(image) and not translation.converts_colors:
        return ImageTexture(image.name, as_in_file(colors, divided), color_space="srgb")
    if colors.shape[2] >= 3 and translation.converts_colors:
        colors = np.concatenate([translation.linear_rgb(colors), colors[..., 3:]], axis=2)
    return ImageTexture(image.name, colors.astype(np.float32), color_space="linear")


def _with_alpha(colors: Array, alpha: Array | None, alpha_is_read: bool) -> Array:
    """Colors with the alpha by which they are divided after filtering, as in Cycles, if it is read."""
    return np.concatenate([colors, alpha], axis=2) if alpha is not None and alpha_is_read else colors


def _byte_image(
    translation: Translation, image: Any, colors: Array, alpha: Array | None, alpha_is_read: bool
) -> ImageTexture:
    """The image of bytes; ``alpha``: as for ``_float_image``."""
    space = image.colorspace_settings.name
    if alpha is not None:
        colors = file_bytes(translation, image, colors, alpha)
    kind: Literal["raw", "linear", "srgb"] = "raw" if holds_numbers(image) else "linear" if is_linear(image) else "srgb"
    if kind != "srgb" or space == "sRGB":
        if alpha is not None:
            colors = multiplied(image, colors, alpha)
        return ImageTexture(image.name, _with_alpha(colors, alpha, alpha_is_read), color_space=kind)
    # Cycles converts the colors as they are, and keeps those that no display shows
    rgb = np.broadcast_to(colors[..., :3] / np.float32(255), (*colors.shape[:2], 3))
    linear = averaged(image, scene_linear(rgb, space))
    if translation.converts_colors:
        linear = translation.linear_rgb(linear)
    if alpha is not None:
        alpha = alpha / np.float32(255)
        linear = multiplied(image, linear, alpha)
    return ImageTexture(image.name, _with_alpha(linear, alpha, alpha_is_read).astype(np.float32), color_space="linear")


def linear_pixels(texture: ImageTexture) -> Array:
    """Colors (h, w, 3) or numbers (h, w, 1), float32, without the display curve."""
    pixels = texture.pixels[..., :3] if texture.pixels.shape[2] >= 3 else texture.pixels[..., :1]
    if pixels.dtype == np.uint8:
        table = np.arange(256) / 255
        if texture.color_space == "srgb":
            table = linear_from_display_rgb(table)
        return table.astype(np.float32)[pixels]
    linear = linear_from_display_rgb(pixels) if texture.color_space == "srgb" else pixels
    return np.asarray(linear, dtype=np.float32)

# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender images as pixels with a stated color space; a missing image gives a Note and, as in Cycles, magenta."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from spectral_core.scene import ImageTexture
from spectral_core.spectra.color import display_rgb_from_linear, linear_from_display_rgb

from ..context import Translation
from ..ledger import note_changed
from .image_files import frame_image, frame_of, tile_image, tiles_of
from .image_files.color_spaces import scene_linear

Array = NDArray[Any]

MOST_OF_BYTES = 1.02
"""Value from which a color is brighter than white, beyond the rounding of color spaces."""
EXTENSIONS: dict[str, Literal["repeat", "clip", "extend", "mirror"]] = {
    "REPEAT": "repeat",
    "EXTEND": "extend",
    "CLIP": "clip",
    "MIRROR": "mirror",
}
INTERPOLATIONS: dict[str, Literal["nearest", "cubic"]] = {"Closest": "nearest", "Cubic": "cubic", "Smart": "cubic"}
LINEAR_SPACES = ("Linear Rec.709", "Linear", "scene_linear")
NUMBER_SPACES = ("Non-Color", "Raw")
WHOLE = "whole"
"""First word of the keys of images that are neither a tile nor a frame; the session number follows."""


def image_of_node(translation: Translation, node: Any, owner: str, channel: str = "Color") -> ImageTexture | None:
    """Image of an Image or Environment Texture node with the node's interpolation and extension.

    ``owner``: owner of the node; ``channel``: its output, ``"Color"`` or ``"Alpha"`` (one raw channel). None, with a
    Note, without a picture.
    """
    image = node.image
    if image is None:
        translation.note(owner, f"{node.name!r} has no image; it is magenta, as in Cycles")
        return None
    if image.source == "SEQUENCE":
        texture = _frame(translation, node, channel)
    else:
        texture = read_image(translation, image, channel, alpha_is_read=alpha_is_read(node))
    if texture is None:
        return None
    extension = EXTENSIONS.get(getattr(node, "extension", "REPEAT"), "repeat")
    interpolation: Literal["linear", "nearest", "cubic"] = INTERPOLATIONS.get(node.interpolation, "linear")
    if (texture.extension, texture.interpolation) == (extension, interpolation):
        return texture
    key = (id(texture), extension, interpolation)  # one object per use, so that the renderer stores it once
    if key not in translation.images:
        translation.images[key] = replace(texture, extension=extension, interpolation=interpolation)
    return translation.images[key]


def _frame(translation: Translation, node: Any, channel: str) -> ImageTexture | None:
    """The file of a sequence that a node shows at the scene's frame."""
    translation.reads_elsewhere = True  # the scene's frame
    image, number = node.image, frame_of(node.image_user, int(translation.scene.frame_current))
    key = (image.name_full, channel, alpha_is_read(node), number)
    if key not in translation.images:
        with frame_image(image, number) as found:
            if found is None:
                where = f"{image.filepath}, file {number}"
                translation.note(image.name, f"the image could not be read ({where}); it is magenta, as in Cycles")
            texture = None if found is None else _read(translation, found, channel, alpha_is_read(node))
        translation.images[key] = texture
    return translation.images[key]


def tiles_of_node(translation: Translation, node: Any, channel: str) -> list[tuple[tuple[int, ...], ImageTexture]]:
    """Tiles of an Image Texture whose image is a UDIM set: those of one size are stacked in one image."""
    image, reads_alpha = node.image, alpha_is_read(node)
    groups: dict[Any, list[tuple[int, ImageTexture]]] = {}
    for number in tiles_of(image):
        key = (image.name_full, channel, reads_alpha, "tile", number)
        if key not in translation.images:
            with tile_image(image, number) as found:
                made = None if found is None else _read(translation, found, channel, reads_alpha)
            translation.images[key] = made
        tile = translation.images[key]
        if tile is None:
            translation.note(image.name, f"tile {number} of this UDIM image could not be read; it is magenta")
            continue
        groups.setdefault((tile.pixels.shape, tile.pixels.dtype, tile.color_space), []).append((number, tile))
    return [(tuple(n for n, _ in of), _stacked(translation, node, image.name, of, channel)) for of in groups.values()]


def _stacked(
    translation: Translation, node: Any, name: str, of: list[tuple[int, ImageTexture]], channel: str
) -> ImageTexture:
    """Tiles of one size as one image, made once per use."""
    extension = EXTENSIONS.get(node.extension, "repeat")
    interpolation: Literal["linear", "nearest", "cubic"] = INTERPOLATIONS.get(node.interpolation, "linear")
    key = ("stacked", *(id(tile) for _, tile in of), extension, interpolation)
    if key not in translation.images:
        pixels = np.concatenate([tile.pixels for _, tile in of])
        stacked = replace(of[0][1], name=f"{name} ({channel}, {len(of)} tiles)", pixels=pixels)
        translation.images[key] = replace(stacked, extension=extension, interpolation=interpolation)
    found = translation.images[key]
    assert found is not None
    return found


def alpha_is_read(node: Any) -> bool:
    """True if anything is linked to the node's Alpha: its color is then not multiplied by alpha, as in Cycles."""
    socket = next((socket for socket in node.outputs if socket.name == "Alpha"), None)
    return socket is not None and socket.is_linked and not all(link.is_muted for link in socket.links)


def read_image(
    translation: Translation, image: Any, channel: str = "Color", *, alpha_is_read: bool = True
) -> ImageTexture | None:
    """Pixels of a ``bpy.types.Image``, read once per translation and use; None, with a Note, without pixels.

    ``alpha_is_read``: True if the alpha is used too; otherwise colors are multiplied by it, as in Cycles.
    """
    key = (WHOLE, image.session_uid, image.name_full, channel, alpha_is_read)
    if key not in translation.images:
        translation.images[key] = _read(translation, image, channel, alpha_is_read)
    return translation.images[key]


def are_outdated(read: Mapping[Any, ImageTexture | None], images: Iterable[Any]) -> bool:
    """True if Blender has freed pixels that were read: it loads them again from a file that may have changed.

    ``read``: as ``Translation.images``; ``images``: Blender's. ``Image.reload()`` in a script reports materials alone.
    """
    whole = {key[1] for key, texture in read.items() if key[0] == WHOLE and texture is not None}
    return bool(whole) and any(image.session_uid in whole and not image.has_data for image in images)


def _read(translation: Translation, image: Any, channel: str, alpha_is_read: bool) -> ImageTexture | None:
    width, height = image.size
    if width == 0 or height == 0 or len(image.pixels) == 0:
        where = image.filepath or "no file"
        translation.note(image.name, f"the image could not be read ({where}); it is magenta, as in Cycles")
        return None
    note_changed(translation, image.name, image)
    if image.source in ("SEQUENCE", "MOVIE"):
        translation.note(image.name, "this movie or sequence shows the frame that Blender has loaded")
    if image.source == "TILED":
        translation.note(image.name, "only the first tile of this tiled (UDIM) image is used")
    values = np.empty(len(image.pixels), dtype=np.float32)
    image.pixels.foreach_get(values)
    pixels = values.reshape(height, width, -1)
    if not np.isfinite(pixels).all():
        translation.note(image.name, "pixels that are not finite numbers were taken as black")
        pixels = np.where(np.isfinite(pixels), pixels, np.float32(0))
    has_alpha = pixels.shape[2] == 4 and image.alpha_mode != "NONE"
    if channel == "Alpha":
        alpha = pixels[..., 3:4] if has_alpha else np.ones((height, width, 1), dtype=np.float32)
        return ImageTexture(f"{image.name} (alpha)", _compact(alpha, image.is_float), color_space="raw")
    colors = pixels[..., :3] if pixels.shape[2] >= 3 else pixels[..., :1]
    space = image.colorspace_settings.name
    if has_alpha and image.alpha_mode != "CHANNEL_PACKED" and space not in NUMBER_SPACES:
        colors = _associated(translation, image, colors, pixels[..., 3:4])
        if alpha_is_read:  # stored premultiplied and divided after filtering, as in Cycles
            colors = np.concatenate([colors, pixels[..., 3:4]], axis=2)
    if image.is_float:  # Blender has already brought these to its scene-linear space
        return _float_image(translation, image.name, colors, is_color=space not in NUMBER_SPACES)
    return _byte_image(translation, image.name, colors, space)


def _associated(translation: Translation, image: Any, colors: Array, alpha: Array) -> Array:
    """Colors multiplied by alpha in the file's own encoding, as Cycles stores them."""
    is_from_file = image.packed_file is None and image.source == "FILE"
    if image.is_float:  # float buffers are premultiplied, straight files by Blender; Cycles reads the file itself
        undone = image.alpha_mode == "STRAIGHT" and is_from_file
        return np.asarray(colors / np.where(alpha > 0, alpha, 1), dtype=np.float32) if undone else colors
    if image.alpha_mode == "PREMUL" and is_from_file:
        # Blender divided the file's colors by alpha; Cycles reads the file itself, whose colors count as undivided
        translation.note(image.name, "its colors are stored multiplied by alpha; where they exceed it they are limited")
        colors = colors * alpha
    # Cycles multiplies bytes and rounds down
    levels = np.floor(np.rint(np.clip(colors, 0, 1) * 255) * np.rint(alpha * 255) / 255)
    return np.asarray(levels / 255, dtype=np.float32)


def _float_image(translation: Translation, name: str, colors: Array, *, is_color: bool) -> ImageTexture:
    if not is_color:
        return ImageTexture(name, colors, color_space="raw")
    if colors.shape[2] >= 3 and not np.array_equal(translation.rgb_from_working, np.eye(3)):
        colors = np.concatenate([translation.linear_rgb(colors), colors[..., 3:]], axis=2).astype(np.float32)
    return ImageTexture(name, colors, color_space="linear")


def _byte_image(translation: Translation, name: str, colors: Array, space: str) -> ImageTexture:
    if space in NUMBER_SPACES or space in LINEAR_SPACES:
        return ImageTexture(name, _compact(colors), color_space="raw" if space in NUMBER_SPACES else "linear")
    if space == "sRGB":
        return ImageTexture(name, _compact(colors), color_space="srgb")
    # Cycles stores such colors as bytes of its scene-linear space, with the curve of sRGB
    rgb = np.broadcast_to(colors[..., :3], (*colors.shape[:2], 3))
    unbounded = scene_linear(rgb, space)
    if unbounded.max(initial=0.0) > MOST_OF_BYTES:
        translation.note(name, f"colors of its color space {space!r} that are brighter than 1 are limited to 1")
    linear = np.clip(unbounded, 0, 1)
    if np.array_equal(translation.rgb_from_working, np.eye(3)):
        curved = np.concatenate([display_rgb_from_linear(linear), colors[..., 3:]], axis=2)
        return ImageTexture(name, _compact(curved), color_space="srgb")
    linear = np.concatenate([translation.linear_rgb(linear), colors[..., 3:]], axis=2)
    return ImageTexture(name, linear.astype(np.float32), color_space="linear")


def _compact(values: Array, is_float: bool = False) -> Array:
    """Values of a byte image as bytes again: a quarter of the memory."""
    return np.ascontiguousarray(values) if is_float else np.rint(np.clip(values, 0, 1) * 255).astype(np.uint8)


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

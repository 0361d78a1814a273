# SPDX-License-Identifier: GPL-3.0-or-later
"""Spectral textures between Blender and the core: the node becomes a SpectralImage, its file a picture for Blender."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path
from typing import Any, Literal

import bpy
import numpy as np

from spectral_core.errors import InvalidInputError
from spectral_core.files.guarded import is_file, no_file
from spectral_core.palette.texture.file import read_texture
from spectral_core.palette.texture.reach import TEXTURE_GRID
from spectral_core.palette.texture.texture import SpectralTexture
from spectral_core.scene import SpectralImage
from spectral_core.spectra.catalogue import illuminant
from spectral_core.spectra.color import display_rgb_from_linear

from ...properties.texture import NODE

EXTENSIONS: dict[str, Literal["repeat", "extend", "mirror"]] = {
    "REPEAT": "repeat",
    "EXTEND": "extend",
    "MIRROR": "mirror",
}
MOST_PREVIEW_SIDE = 1024
"""The picture for Blender's own views has at most this many rows and columns."""


def texture_of(node: Any) -> SpectralTexture:
    """The texture of a node's file.

    Raises InvalidInputError if no file is chosen or there is none, FileFormatError if it is no spectral texture.
    """
    if not node.filepath:
        raise InvalidInputError("no file is chosen; choose the texture.exr that `spectral-scene texture` wrote")
    path = file_of(node)
    if not is_file(path):
        raise InvalidInputError(no_file(path, "choose the texture.exr again"))
    state = path.stat()
    return _read(path, state.st_mtime_ns, state.st_size)


def spectral_texture_nodes() -> Iterator[Any]:
    """All nodes of spectral textures in the file, those without a file included."""
    return (node for node in shader_nodes() if node.bl_idname == NODE)


def shader_nodes() -> Iterator[Any]:
    """All nodes of materials, worlds, lights and their groups."""
    for block in (*bpy.data.node_groups, *bpy.data.materials, *bpy.data.worlds, *bpy.data.lights):
        yield from shader_nodes_of(block)


def shader_nodes_of(block: Any) -> Iterator[Any]:
    """The nodes of a material, world, light or group."""
    tree = block if isinstance(block, bpy.types.NodeTree) else block.node_tree
    return (node for node in (tree.nodes if tree else ()) if isinstance(node, bpy.types.ShaderNode))


def file_of(node: Any) -> Path:
    """The path of a node's file."""
    return Path(bpy.path.abspath(node.filepath, library=node.id_data.library))


@lru_cache(maxsize=4)
def _read(path: Path, _changed_ns: int, _size: int) -> SpectralTexture:
    return read_texture(path)


def spectral_image_of(node: Any) -> SpectralImage:
    """The node for the renderer. Raises the same errors as ``texture_of``."""
    texture = texture_of(node)
    return SpectralImage(
        node.name,
        texture.weights[:, ::-1],
        texture.spectra,
        TEXTURE_GRID,
        extension=EXTENSIONS[node.extension],
        interpolation="linear" if node.interpolation == "Linear" else "nearest",
    )


def preview_pixels(texture: SpectralTexture) -> np.ndarray[Any, np.dtype[np.float32]]:
    """Display colors (height, width, 4) under D65, bottom row first, thinned to MOST_PREVIEW_SIDE."""
    step = max(1, -(-max(texture.weights.shape[1:]) // MOST_PREVIEW_SIDE))
    thinned = SpectralTexture(texture.weights[:, ::step, ::step], texture.spectra, texture.lights)
    colors = display_rgb_from_linear(np.clip(thinned.picture(illuminant("D65")), 0.0, 1.0))[::-1]
    alpha = np.ones((*colors.shape[:2], 1))
    return np.concatenate([colors, alpha], axis=2).astype(np.float32)

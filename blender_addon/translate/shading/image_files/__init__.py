# SPDX-License-Identifier: GPL-3.0-or-later
"""Files behind one Blender image: tiles of a UDIM set, and the frame of a sequence or movie that is shown now."""

from __future__ import annotations

import os
import re
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import bpy

from spectral_core.files.guarded import is_file

from .permitted import permitted

MISSING = (1.0, 0.0, 1.0)
"""The color that Cycles shows where a picture or a tile is missing; its alpha is 1."""


def tiles_of(image: Any) -> list[int]:
    """Numbers of a tiled image's tiles: 1001 and on, ten to a row."""
    return sorted(int(tile.number) for tile in image.tiles)


@contextmanager
def tile_image(image: Any, number: int) -> Iterator[Any]:
    """An image of one tile's file alone, None if it has none; gone afterward."""
    packed = next((each for each in image.packed_files if each.tile_number == number), None)
    if packed is not None:
        handle, path = tempfile.mkstemp(suffix=Path(packed.filepath).suffix)
        try:
            with os.fdopen(handle, "wb") as file:
                file.write(packed.packed_file.data)
            with _loaded(image, path) as found:
                found.pack()  # Cycles has Blender's pixels of it, as of any image that is packed
                yield found
        finally:
            Path(path).unlink(missing_ok=True)
        return
    u, v = (number - 1001) % 10 + 1, (number - 1001) // 10 + 1
    name = image.filepath.replace("<UDIM>", str(number)).replace("<UVTILE>", f"u{u}_v{v}")
    with _loaded(image, bpy.path.abspath(name, library=image.library)) as found:
        yield found


def frame_of(user: Any, frame: int) -> int:
    """Number of the file of a sequence, or of the picture of a movie, at a frame (Blender's
    ``BKE_image_user_frame_get``).

    Without Auto Refresh, too: the setting redraws editors alone, and each render computes the number anew.
    """
    length = int(user.frame_duration)
    if length == 0:
        return 0
    place = frame - int(user.frame_start) + 1
    if user.use_cyclic:
        place = place % length or length
    return min(max(place, 0), length) + int(user.frame_offset)


@contextmanager
def frame_image(image: Any, number: int) -> Iterator[Any]:
    """An image of one file of a sequence, or of one picture of a movie, None without one; gone afterward."""
    path = bpy.path.abspath(image.filepath, library=image.library)
    if image.source == "MOVIE":
        with _loaded(image, path) as found:
            if found is not None:
                permitted(lambda: _wind(found, number))
            yield found
        return
    digits = list(re.finditer(r"\d+", Path(path).stem))  # those of an extension, as .jp2, do not count
    if not digits:
        yield None
        return
    last, folder, name = digits[-1], Path(path).parent, Path(path).name
    written = f"{number:0{last.end() - last.start()}d}"
    with _loaded(image, str(folder / (name[: last.start()] + written + name[last.end() :]))) as found:
        yield found


def _read_as(like: Any, path: str) -> Any:
    made = bpy.data.images.load(path, check_existing=False)
    try:
        if like.colorspace_settings.name:  # else it follows from the file: nothing has read the image so far
            made.colorspace_settings.name = like.colorspace_settings.name
        made.alpha_mode = like.alpha_mode
        made.use_deinterlace = like.use_deinterlace
    except AttributeError:  # see ``permitted``
        bpy.data.images.remove(made)
        raise
    return made


def _wind(movie: Any, number: int) -> None:
    """Let the pixels of a movie be those of one of its pictures; beyond its ends, those of the first or last one.

    Scripts have no way to choose it: ``pixels`` are those that Blender has read last, as it does for a texture.
    """
    texture = bpy.data.textures.new("Picture", "IMAGE")
    try:
        texture.image, texture.image_user.frame_current = movie, number
        texture.evaluate((0.0, 0.0, 0.0))
    finally:
        bpy.data.textures.remove(texture)


@contextmanager
def _loaded(like: Any, path: str) -> Iterator[Any]:
    """A file as an image of the same settings."""
    if not is_file(path):
        yield None
        return
    made = permitted(lambda: _read_as(like, path))
    try:
        yield made
    finally:
        bpy.data.images.remove(made)

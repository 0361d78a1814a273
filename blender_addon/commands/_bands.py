# SPDX-License-Identifier: GPL-3.0-or-later
"""Spectral bands of ``render``: a file for each view layer and each eye, since the layout holds one picture."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from spectral_core.errors import InvalidInputError


@dataclass
class Pictures:
    """The pictures of a frame, as the engine gives them.

    ``made``: result, name of the view layer, and name of the view ("" except for stereo) of each picture, if they are
    kept. ``passes``: names of the passes of all of them, as the keys of a dictionary, in order.
    """

    keeps: bool
    made: list[tuple[Any, str, str]] = field(default_factory=list)
    passes: dict[str, None] = field(default_factory=dict)

    def add(self, result: Any, layer: str, view: str) -> None:
        """Add a picture."""
        self.passes.update(dict.fromkeys(result.passes))
        if self.keeps:
            self.made.append((result, layer, view))


def options(count: int | None) -> dict[str, Any]:
    """Spectral channels to measure beside the picture."""
    from spectral_core.render import Bands

    return {} if count is None else {"bands": Bands.uniform(count=count)}


def write(path: Path, pictures: Pictures, scene: Any) -> list[str]:
    """Write every picture of a frame, as large and with pixels of the shape as F12 writes it; returns the files."""
    from spectral_core.render.images.spectral_exr import write_spectral_exr

    render = scene.render
    targets = _paths(path, [(layer, view) for _, layer, view in pictures.made], render)
    for target, (result, _, _) in zip(targets, pictures.made, strict=True):
        write_spectral_exr(target, _framed(result, scene), pixel_aspect=render.pixel_aspect_x / render.pixel_aspect_y)
    return list(map(str, targets))


def _framed(result: Any, scene: Any) -> Any:
    """The result at its place in the frame, empty around the render border, unless Blender crops to that border."""
    from ..editing.dial.picture import in_frame

    if scene.render.use_crop_to_border:
        return result
    return replace(result, pixels=in_frame(scene, result.pixels), band_pixels=in_frame(scene, result.band_pixels))


def _paths(path: Path, places: list[tuple[str, str]], render: Any) -> list[Path]:
    """Name of each file: ``path``, with the layer if there are several, and with Blender's suffix of each eye."""
    import bpy

    several = len({layer for layer, _ in places}) > 1
    made = []
    for layer, view in places:
        name = f"_{bpy.path.clean_name(layer)}" if several else ""
        suffix = render.views[view].file_suffix if view else ""
        made.append(path.with_name(f"{path.stem}{name}{suffix}{path.suffix}"))
    if len(set(made)) < len(made):
        names = ", ".join(dict.fromkeys(layer for layer, _ in places))
        raise InvalidInputError(
            f"the view layers {names} have the same name in a file's name; rename them with letters and digits"
        )
    return made

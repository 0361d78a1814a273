# SPDX-License-Identifier: GPL-3.0-or-later
"""Spectral bands of ``render``: a file for each view layer and each eye, since the layout holds one picture."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from spectral_core.errors import InvalidInputError

Pictures = list[tuple[Any, str, str]]
"""Result, name of the view layer, and name of the view ("" except for stereo) of each picture of a frame."""


def options(count: int | None) -> dict[str, Any]:
    """Spectral channels to measure beside the picture."""
    from spectral_core.render import Bands

    return {} if count is None else {"bands": Bands.uniform(count=count)}


def write(path: Path, pictures: Pictures, render: Any) -> list[str]:
    """Write every picture of a frame; returns the files."""
    from spectral_core.render.spectral_exr import write_spectral_exr

    targets = _paths(path, [(layer, view) for _, layer, view in pictures], render)
    for target, (result, _, _) in zip(targets, pictures, strict=True):
        write_spectral_exr(target, result)
    return list(map(str, targets))


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

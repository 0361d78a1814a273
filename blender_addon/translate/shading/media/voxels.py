# SPDX-License-Identifier: GPL-3.0-or-later
"""Grids of an OpenVDB file at common voxels."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.errors import FileFormatError, InvalidInputError
from spectral_core.volume.field import ScalarVolume

MOST_RESAMPLED = 1 << 24
"""Voxels of the finest grid of a Volume object onto which its other grids are resampled."""
MOST_VOXELS = 1 << 28
"""Voxels of a Volume object that are rendered by its material; larger ones are refused."""


@dataclass(frozen=True, eq=False)
class Lattice:
    """Grids of a Volume object at common voxels, (n,) or (n, 3) by name; ``object_from_index``: to voxel centers.

    ``differences``: what Cycles renders differently, in words.
    """

    shape: tuple[int, int, int]
    object_from_index: NDArray[np.float64]
    grids: dict[str, NDArray[Any]]
    differences: tuple[str, ...] = ()


@lru_cache(maxsize=2)
def lattice_of(path: Path, names: tuple[str, ...], _modified: int, _size: int) -> Lattice:
    """Grids of a file by name. Raises InvalidInputError, OSError, FileFormatError."""
    from spectral_core.volume.files.vdb.read import grid_names

    held = grid_names(path)
    wanted = [name for name in names if name in held]
    if not wanted:
        reads = f"reads {', '.join(map(repr, names))}" if names else "reads no grid"
        raise InvalidInputError(
            f"the shader {reads}, and {path.name} holds {', '.join(map(repr, held))}: nothing is seen; "
            "name one of these grids in the shader"
        )
    found = {name: _grid(path, name) for name in wanted}
    # The finest voxels, unless the box of all grids has too many of them: those of the first grid then.
    by_size = sorted((parts[0] for parts in found.values()), key=_voxel_size)
    for first in (*by_size, found[wanted[0]][0]):
        low, shape = _common_box(found, first)
        if np.prod(shape, dtype=float) <= MOST_RESAMPLED:
            break
    if np.prod(shape, dtype=float) > MOST_VOXELS:
        sizes = "×".join(map(str, shape))
        raise InvalidInputError(f"{path.name} has {sizes} voxels; at most {MOST_VOXELS:,} are rendered: resample it")
    matrix = first.world_from_index.copy()
    matrix[:3, 3] += matrix[:3, :3] @ low
    grids = {name: _on_lattice(parts, (shape[0], shape[1], shape[2]), matrix) for name, parts in found.items()}
    return Lattice((shape[0], shape[1], shape[2]), matrix, grids, tuple(_differences(path, found)))


def _differences(path: Path, found: dict[str, list[ScalarVolume]]) -> Iterator[str]:
    """What Cycles renders differently, in words."""
    from spectral_core.volume.files.vdb.read import background_of

    for name, parts in found.items():
        outside = np.zeros(1)
        with suppress(FileFormatError):  # of a tree that only OpenVDB itself reads
            outside = background_of(path, name)
        if outside.dtype != bool and np.any(np.nan_to_num(outside) != 0):
            value = ", ".join(f"{number:g}" for number in outside)
            yield (
                f"its grid {name!r} has the background {value}: Cycles shows a rim of it around the active voxels, "
                "here there is nothing outside of them; save the grid with background 0"
            )
        if np.linalg.det(parts[0].world_from_index[:3, :3]) < 0:
            yield (
                f"the transform of its grid {name!r} is mirrored: Cycles shows nothing of it, here it is seen; mirror "
                "the object, not the grid"
            )


def _voxel_size(volume: ScalarVolume) -> float:
    """Rounded, so that equal voxels count as equal."""
    return float(f"{abs(np.linalg.det(volume.world_from_index[:3, :3])):.4g}")


def _common_box(found: dict[str, list[ScalarVolume]], first: ScalarVolume) -> tuple[NDArray[Any], tuple[int, ...]]:
    """Lowest index and number of voxels of the box around all grids, in the voxels of one of them."""
    low, high = np.full(3, -1.0), np.array(first.shape, dtype=np.float64)
    for parts in found.values():
        corners = _corners(parts[0], first)
        low, high = np.minimum(low, corners.min(axis=0)), np.maximum(high, corners.max(axis=0))
    low, high = np.floor(low + 1e-3), np.ceil(high - 1e-3)
    return low, tuple(int(n) for n in high - low + 1)


def _grid(path: Path, name: str) -> list[ScalarVolume]:
    """The components of a grid: one, or three of a vector."""
    from spectral_core.volume.files import read_volume

    try:
        return [read_volume(path, field=name)]
    except InvalidInputError:
        return [read_volume(path, field=name, component=k) for k in range(3)]


def _corners(volume: ScalarVolume, first: ScalarVolume) -> NDArray[np.float64]:
    """The corners of a volume, with a voxel over which it fades out, in the voxels of another."""
    ends = np.array(np.meshgrid(*((-1.0, float(n)) for n in volume.shape))).reshape(3, 8).T
    matrix = np.linalg.inv(first.world_from_index) @ volume.world_from_index
    return np.asarray(ends @ matrix[:3, :3].T + matrix[:3, 3])


def _on_lattice(
    parts: list[ScalarVolume], shape: tuple[int, int, int], object_from_index: NDArray[np.float64]
) -> NDArray[Any]:
    """Values of a grid at the voxels of a lattice, 0 outside of it."""
    from scipy.ndimage import affine_transform

    columns = []
    for part in parts:
        matrix = np.linalg.inv(part.world_from_index) @ object_from_index
        offset = np.round(matrix[:3, 3])
        data = np.asarray(part.data, np.float32)
        if np.allclose(matrix[:3, :3], np.eye(3), atol=1e-5) and np.allclose(matrix[:3, 3], offset, atol=1e-3):
            placed = np.zeros(shape, np.float32)
            start = (-offset).astype(int)
            placed[tuple(slice(s, s + n) for s, n in zip(start, data.shape, strict=True))] = data
        else:
            placed = affine_transform(data, matrix, output_shape=shape, order=1, mode="grid-constant", cval=0.0)
        columns.append(placed.ravel())
    return columns[0] if len(columns) == 1 else np.stack(columns, axis=1)

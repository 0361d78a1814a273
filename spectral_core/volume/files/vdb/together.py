# SPDX-License-Identifier: GPL-3.0-or-later
"""Several grids of one OpenVDB file at common voxels, as a shader that reads all of them needs them."""

from __future__ import annotations

import math
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.errors import FileFormatError, InvalidInputError
from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.files import read_volume
from spectral_core.volume.files.payload import EmptyGridError
from spectral_core.volume.files.vdb.read import first_of_name, grid_background, grid_names
from spectral_core.volume.files.vdb.walk import tiles_begin

MOST_RESAMPLED = 1 << 24
"""Common voxels onto which coarser grids are resampled; beyond these the voxels of the first grid serve."""
MOST_VOXELS = 1 << 28
"""Common voxels that are made; more are refused."""
ALIKE = 1.001
"""Ratio of the volumes of voxels below which one grid is as fine as another."""

Box = tuple[NDArray[np.int64], NDArray[np.int64]]
"""Index of the first and of the last voxel of a box."""


@dataclass(frozen=True, eq=False)
class CommonVoxels:
    """Grids by name, (n,) or (n, 3) with z fastest, at the same voxels; ``world_from_index`` (4, 4): to their centers.

    ``interpolated``: names of the grids that have other voxels. ``resampled``: names of those of them whose own voxels
    are finer, so that details are lost. ``mirrored``: names of the grids whose transforms mirror. ``repeated``: names
    that several grids of the file share, of which the first one is here. ``is_clipped``: true if voxels at the ends of
    the grids were too small to count. ``begins``: (3,) index along each axis at which the volume begins: -0.5, or that
    of the first voxel where this one is in a tile (a cube of one value), which in Cycles does not fade in.
    """

    shape: tuple[int, int, int]
    world_from_index: NDArray[np.float64]
    grids: dict[str, NDArray[Any]]
    interpolated: tuple[str, ...] = ()
    resampled: tuple[str, ...] = ()
    mirrored: tuple[str, ...] = ()
    repeated: tuple[str, ...] = ()
    is_clipped: bool = False
    begins: NDArray[np.float64] = field(default_factory=lambda: np.full(3, -0.5))

    def surrounded(self) -> CommonVoxels:
        """The same grids with one more voxel on each side, which has the value of the outermost one."""
        nx, ny, nz = (n + 2 for n in self.shape)
        wide = {name: values.reshape(*self.shape, *values.shape[1:]) for name, values in self.grids.items()}
        grids = {
            name: np.pad(values, [(1, 1)] * 3 + [(0, 0)] * (values.ndim - 3), mode="edge").reshape(
                -1, *values.shape[3:]
            )
            for name, values in wide.items()
        }
        matrix = self.world_from_index.copy()
        matrix[:3, 3] -= matrix[:3, :3].sum(axis=1)
        begins = np.where(self.begins > 0, self.begins + 1, self.begins)
        return replace(self, shape=(nx, ny, nz), world_from_index=matrix, grids=grids, begins=begins)


@dataclass(frozen=True, eq=False)
class _Grid:
    """A grid's components, one or three, and the value of each where the grid has no voxels; no component if it has
    none anywhere. ``fades_in``: (3,) voxels over which it fades in before its first one.
    """

    parts: list[ScalarVolume]
    outside: NDArray[np.float64]
    fades_in: NDArray[np.float64]

    @property
    def voxel(self) -> float:
        """Volume of a voxel, below 0 where the transform mirrors."""
        return float(np.linalg.det(self.parts[0].world_from_index[:3, :3]))

    def box(self, least: float | None) -> Box | None:
        """The first and the last voxel of the box of those that have a component beyond ``least``, of either sign; of
        all if it is None. None if there are no such voxels.
        """
        ends = [(0, n) for n in self.parts[0].shape]
        if least is not None:
            for axis in range(3):
                within = tuple(slice(*end) for end in ends)
                slabs = [np.moveaxis(np.asarray(part.data)[within], axis, 0) for part in self.parts]
                count = ends[axis][1]
                first = next((k for k in range(count) if _exceeds(slabs, k, least)), None)
                if first is None:
                    return None
                last = next(k for k in reversed(range(count)) if _exceeds(slabs, k, least))
                ends[axis] = first, last + 1
        return np.array([start for start, _ in ends]), np.array([stop - 1 for _, stop in ends])


def _exceeds(slabs: list[NDArray[Any]], k: int, least: float) -> bool:
    return any(bool(((slab[k] > least) | (slab[k] < -least)).any()) for slab in slabs)


def grids_together(path: Path, names: Iterable[str], least: float | None = None) -> CommonVoxels:
    """The grids of ``names`` that a file holds, on the voxels of the finest one, the first of several.

    One voxel more surrounds the box of each grid, because it fades out over it. ``least``: voxels at the ends of a grid
    whose absolute values are at most this do not count for its box, as Cycles has it (*Clipping*); those within the box
    of all grids keep their values; None counts all. A grid has its background value where it has no voxels, as in
    OpenVDB. If the finest voxels are more than ``MOST_RESAMPLED``, those of a coarser grid are used. Raises
    InvalidInputError if the file holds none of the grids, or if there are too many voxels; EmptyGridError if no voxel
    counts; FileFormatError and OSError as ``read_volume``.
    """
    names, held = list(names), grid_names(path)
    stored = {name: first_of_name(held, name) for name in names}
    wanted = [name for name in names if stored[name] in held]
    if not wanted:
        reads = f"reads {', '.join(map(repr, names))}" if names else "reads no grid"
        raise InvalidInputError(
            f"the shader {reads}, and {path.name} holds {', '.join(map(repr, held))}: nothing is seen; "
            "name one of these grids in the shader"
        )
    read = {name: _read(path, stored[name]) for name in wanted}
    found = {name: grid for name, grid in read.items() if grid.parts}
    if not found:
        raise EmptyGridError(f"{', '.join(map(repr, wanted))} of {path.name} has no active voxel; nothing is seen")
    boxes = {name: grid.box(least) for name, grid in found.items()}
    seen = {name: box for name, box in boxes.items() if box is not None}
    if not seen:
        raise EmptyGridError(
            f"{', '.join(map(repr, found))} of {path.name} has no voxel above {least:g}; nothing is seen; "
            "lower Clipping in the properties of the volume"
        )
    # of grids that are as fine as each other, the sort keeps the first one first
    by_size = sorted((found[name] for name in seen), key=lambda grid: float(f"{abs(grid.voxel):.4g}"))
    for base in (*by_size, next(found[name] for name in seen)):
        shape, matrix = _region(base.parts[0], [(found[name].parts[0], box) for name, box in seen.items()])
        if np.prod(shape, dtype=float) <= MOST_RESAMPLED:
            break
    if np.prod(shape, dtype=float) > MOST_VOXELS:
        sizes = "×".join(map(str, shape))
        raise InvalidInputError(f"{path.name} has {sizes} voxels; at most {MOST_VOXELS:,} are rendered: resample it")
    placed = {name: _placed(grid, shape, matrix) for name, grid in read.items()}
    finer = tuple(name for name, grid in found.items() if abs(grid.voxel) * ALIKE < abs(base.voxel))
    mirrored = tuple(name for name, grid in found.items() if grid.voxel < 0)
    others = tuple(name for name, grid in found.items() if _offset(grid.parts[0], matrix) is None)
    repeated = tuple(name for name in read if stored[name] != name)
    is_clipped = any(
        box is None or not np.array_equal(box[1] - box[0] + 1, found[name].parts[0].shape)
        for name, box in boxes.items()
    )
    begins = _begin([(found[name], box) for name, box in seen.items()], matrix)
    return CommonVoxels(shape, matrix, placed, others, finer, mirrored, repeated, is_clipped, begins)


def _read(path: Path, name: str) -> _Grid:
    """A grid of a file."""
    try:
        parts = [read_volume(path, field=name)]
    except EmptyGridError:  # the flames of a fire before it burns
        parts = []
    except InvalidInputError:  # a vector
        parts = [read_volume(path, field=name, component=k) for k in range(3)]
    outside = np.zeros(max(len(parts), 1))
    with suppress(FileFormatError):  # of a tree that only OpenVDB itself reads
        outside = np.atleast_1d(np.asarray(grid_background(path, name), np.float64))
    return _Grid(parts, np.nan_to_num(outside), _fades_in(path, name, parts))


def _fades_in(path: Path, name: str, parts: list[ScalarVolume]) -> NDArray[np.float64]:
    """Voxels over which a grid fades in before its first one along each axis: 1, or 0 where tiles begin.

    Cycles widens the box of the active voxels by one, but not where they are in tiles. The last voxel of a tile fades
    out all the same, because the box ends behind it.
    """
    firsts = [[part.data.take(0, axis) for part in parts] for axis in range(3)]
    if any(all(first.min() == first.max() for first in axis) for axis in firsts if axis):
        with suppress(FileFormatError):  # of a tree that only OpenVDB itself reads
            return np.where(tiles_begin(path, name), 0.0, 1.0)
    return np.ones(3)


def _region(
    base: ScalarVolume, grids: list[tuple[ScalarVolume, Box]]
) -> tuple[tuple[int, int, int], NDArray[np.float64]]:
    """Shape and matrix of the voxels of ``base`` continued over boxes of voxels, each with one of its own around it."""
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for volume, box in grids:
        corners = _corners(volume, box, base.world_from_index)
        low, high = np.minimum(low, corners.min(axis=0)), np.maximum(high, corners.max(axis=0))
    low, high = np.floor(low + 1e-3), np.ceil(high - 1e-3)
    nx, ny, nz = (int(n) for n in high - low + 1)
    matrix = base.world_from_index.copy()
    matrix[:3, 3] += matrix[:3, :3] @ low
    return (nx, ny, nz), matrix


def _begin(grids: list[tuple[_Grid, Box]], world_from_index: NDArray[np.float64]) -> NDArray[np.float64]:
    """Index (3,) at which a volume begins among voxels that hold all of it and what it fades in over: see
    ``CommonVoxels.begins``.
    """
    low = np.full(3, np.inf)
    for grid, box in grids:
        fades_in = np.where(box[0] == 0, grid.fades_in, 1.0)
        low = np.minimum(low, _corners(grid.parts[0], box, world_from_index, fades_in).min(axis=0))
    return np.where(low > 0.5, low, -0.5)


def _corners(
    volume: ScalarVolume, box: Box, world_from_index: NDArray[np.float64], before: float | NDArray[np.float64] = 1.0
) -> NDArray[np.float64]:
    """The corners (8, 3) of a box of a volume's voxels and of one voxel behind it, in other voxels; ``before``: voxels
    before it, (3,) or one number.
    """
    ends = np.array(np.meshgrid(*np.stack([box[0] - before, box[1] + 1.0], axis=1))).reshape(3, 8).T
    matrix = np.linalg.inv(world_from_index) @ volume.world_from_index
    return np.asarray(ends @ matrix[:3, :3].T + matrix[:3, 3])


def _offset(volume: ScalarVolume, world_from_index: NDArray[np.float64]) -> NDArray[np.int64] | None:
    """Index of the first of some voxels among those of a volume; None if they are not the same voxels."""
    matrix = np.linalg.inv(volume.world_from_index) @ world_from_index
    offset = np.round(matrix[:3, 3])
    is_same = np.allclose(matrix[:3, :3], np.eye(3), atol=1e-5) and np.allclose(matrix[:3, 3], offset, atol=1e-3)
    return offset.astype(np.int64) if is_same else None


def _between(starts: NDArray[np.int64], stops: NDArray[np.int64]) -> tuple[slice, ...]:
    return tuple(slice(int(start), int(stop)) for start, stop in zip(starts, stops, strict=True))


def _placed(grid: _Grid, shape: tuple[int, int, int], world_from_index: NDArray[np.float64]) -> NDArray[Any]:
    """Values of a grid at voxels, (n,) or (n, 3)."""
    from scipy.ndimage import affine_transform

    columns = [] if grid.parts else [np.full(math.prod(shape), value, np.float32) for value in grid.outside]
    for part, outside in zip(grid.parts, grid.outside, strict=bool(grid.parts)):
        offset, data = _offset(part, world_from_index), np.asarray(part.data, np.float32)
        if offset is not None:
            placed = np.full(shape, outside, np.float32)
            starts, stops = np.maximum(offset, 0), np.minimum(offset + shape, data.shape)
            if (starts < stops).all():
                placed[_between(starts - offset, stops - offset)] = data[_between(starts, stops)]
        else:
            matrix = np.linalg.inv(part.world_from_index) @ world_from_index
            # one voxel of the background around the grid, into which its values fade
            data = np.pad(data, 1, constant_values=outside)
            matrix[:3, 3] += 1.0
            placed = affine_transform(data, matrix, output_shape=shape, order=1, mode="constant", cval=float(outside))
        columns.append(placed.ravel())
    return columns[0] if len(columns) == 1 else np.stack(columns, axis=1)

# SPDX-License-Identifier: GPL-3.0-or-later
"""Regions of space in which volume shaders are computed: the box of a mesh, the voxels of a Volume object."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.scene import ScatteringMedium
from spectral_core.scene.shading.program import Program

from .... import compat
from .filling import Filling
from .shaders import GRID

Array = NDArray[Any]

SIZES = (24, 48, 96, 144)
"""Voxels along the longest side of a mesh's box: the first size at which twice as many change little."""
COARSE, TOO_COARSE = 0.02, 0.10
"""Error of linear interpolation at which a size is enough, and at which the largest gets a note: root mean square over
the mean.
"""
PROBES = 4096
ALPHA = "attribute_alpha:"
"""Beginning of the names of grids whose alpha nodes read: 1 everywhere, as in Cycles."""
NAMED = ("attribute:", "attribute_factor:", "attribute_uv:", ALPHA)
"""Beginnings of the names of grids that nodes read; a missing grid is 0."""
CHUNK = 1 << 18
FINER, MOST_FINER = (1, 2, 4, 8), 1 << 22
"""Parts of a voxel of a Volume object along each axis where its shader is not linear, and most voxels so divided."""


@dataclass(frozen=True, eq=False)
class Region:
    """A grid of voxels. ``center`` and ``half``: the object's texture space, for Generated coordinates.

    ``facts``: what Object Info and attributes of the object give, by their names in programs; ``grids``: the values of
    a Volume object at the voxels, (n,) or (n, 3), by name. ``is_cubic``: between the voxels they are cubic B-splines,
    else linear.
    """

    shape: tuple[int, int, int]
    world_from_index: NDArray[np.float64]
    world_from_object: NDArray[np.float64]
    camera_from_world: NDArray[np.float64]
    center: NDArray[np.float64]
    half: NDArray[np.float64]
    facts: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    grids: Mapping[str, Array] = field(default_factory=dict)
    is_cubic: bool = False

    def at_voxels(self, program: Program) -> Array:
        """Values of a program at the voxel centers, (n,) or (n, 3)."""
        count = int(np.prod(self.shape))
        parts = []
        for start in range(0, count, CHUNK):
            stop = min(start + CHUNK, count)
            index = np.stack(np.unravel_index(np.arange(start, stop), self.shape), axis=1)
            grids = {name: values[start:stop] for name, values in self.grids.items()}
            parts.append(self._values(program, index.astype(np.float64), grids))
        return np.concatenate(parts)

    def at(self, program: Program, index: Array) -> Array:
        """Values of a program at positions (n, 3) in voxels."""
        cubic = self.is_cubic
        grids = {name: _between(values, self.shape, index, is_cubic=cubic) for name, values in self.grids.items()}
        return self._values(program, index, grids)

    def divided(self, parts: int) -> Region:
        """The same region, each voxel divided along each axis: the outermost centers stay in their places. Between the
        new voxels it is linear.
        """
        if parts == 1 and not self.is_cubic:
            return self
        shape = tuple((n - 1) * parts + 1 for n in self.shape)
        matrix = self.world_from_index @ np.diag([*(1.0 / parts,) * 3, 1.0])
        made = replace(self, shape=(shape[0], shape[1], shape[2]), world_from_index=matrix, grids={}, is_cubic=False)
        grids = {name: self.between(values, parts).astype(np.float32) for name, values in self.grids.items()}
        return replace(made, grids=grids)

    def of_other(self, other: Region, program: Program) -> Array:
        """Values of a program at the voxels, interpolated between those of another region."""
        values, parts = other.at_voxels(program), []
        if other is self:
            return values
        matrix = np.linalg.inv(other.world_from_index) @ self.world_from_index
        for start in range(0, int(np.prod(self.shape)), CHUNK):
            numbers = np.arange(start, min(start + CHUNK, int(np.prod(self.shape))))
            index = np.stack(np.unravel_index(numbers, self.shape), axis=1)
            parts.append(_between(values, other.shape, _moved(matrix, index), is_cubic=self.is_cubic))
        return np.concatenate(parts)

    def between(self, values: Array, parts: int, *, is_sampled: bool = False) -> Array:
        """Values (n,) or (n, k) of the voxels at those of ``divided``. ``is_sampled``: they are those of a curve, and
        linear in between, not numbers that it is interpolated from.
        """
        is_cubic = self.is_cubic and not is_sampled
        if parts == 1:
            return _smoothed(values, self.shape) if is_cubic else values
        shape = tuple((n - 1) * parts + 1 for n in self.shape)
        index = np.stack(np.unravel_index(np.arange(np.prod(shape)), shape), axis=1) / parts
        return _between(values, self.shape, index, is_cubic=is_cubic)

    def _values(self, program: Program, index: Array, grids: Mapping[str, Array]) -> Array:
        world = _moved(self.world_from_index, index)
        widths = {str(i.settings[0]): i.width for i in program.instructions if i.operation.endswith("_input")}

        def read(name: str, shift: int) -> Any:
            values = self._quantity(name, world, grids)
            if widths[name] == 1:
                return values.mean(axis=1)
            return tuple(values[:, k] for k in range(3))

        def transform(vector: Any, kind: str, space: str, inverse: bool) -> Any:
            matrix = self.camera_from_world if space == "CAMERA" else np.linalg.pinv(self.world_from_object)
            matrix = np.linalg.pinv(matrix) if inverse else matrix
            if kind == "NORMAL":
                matrix = np.linalg.pinv(matrix).T
            moved = tuple(sum(matrix[i, j] * vector[j] for j in range(3)) for i in range(3))
            return tuple(m + matrix[i, 3] for i, m in enumerate(moved)) if kind == "POINT" else moved

        values = program.evaluate(read, np.float32, transform)
        return np.asarray(np.broadcast_to(values, (len(index), *values.shape[1:])))

    def _quantity(self, name: str, world: Array, grids: Mapping[str, Array]) -> Array:
        """A quantity of points, (n, 3)."""
        if name == "position":
            return world
        if name == "generated":
            local = _moved(np.linalg.pinv(self.world_from_object), world)
            return np.asarray((local - self.center) / (2 * self.half) + 0.5)
        for prefix, missing in ((GRID, 1.0), *((prefix, 0.0) for prefix in NAMED)):
            if name.startswith(prefix):
                values = grids.get(name.removeprefix(prefix))
                if values is None or prefix == ALPHA:
                    values = np.full(1, missing if values is None else 1.0)
                return np.broadcast_to(values if values.ndim == 2 else values[:, None], (len(world), 3))
        if name == "ray:Is Camera Ray":
            return np.ones((len(world), 3))
        fact = self.facts.get(name, (0.0, 0.0, 0.0))
        wide = fact[:3] if len(fact) >= 3 else (fact[0],) * 3
        return np.broadcast_to(np.array(wide), (len(world), 3))


def _moved(matrix: NDArray[np.float64], points: Array) -> Array:
    return np.asarray(points @ matrix[:3, :3].T + matrix[:3, 3])


def _between(values: Array, shape: tuple[int, int, int], index: Array, *, is_cubic: bool = False) -> Array:
    """Values (n,) or (n, k) of voxels at positions between them, (m,) or (m, k): linear, or a cubic B-spline whose
    coefficients they are.
    """
    from scipy.ndimage import map_coordinates

    flat, rest = np.nan_to_num(values).reshape(*shape, -1), {"order": 3 if is_cubic else 1, "mode": "nearest"}
    read = [map_coordinates(flat[..., k], index.T, prefilter=False, **rest) for k in range(flat.shape[-1])]
    return np.asarray(np.stack(read, axis=1) if values.ndim == 2 else read[0])


def _smoothed(values: Array, shape: tuple[int, int, int]) -> Array:
    """Values (n,) or (n, k) at the voxels of the cubic B-spline whose coefficients they are."""
    from scipy.ndimage import correlate1d

    made = np.nan_to_num(values).reshape(*shape, -1)
    for axis in range(3):
        made = correlate1d(made, np.array([1.0, 4.0, 1.0]) / 6.0, axis=axis, mode="nearest")
    return np.asarray(made.reshape(values.shape))


def depends_on_place(filling: Filling) -> bool:
    """True if a shader's values in a mesh, which has no grids, differ between points."""
    same = ("object_", "ray:", GRID, *NAMED)
    return any(not name.startswith(same) for name in filling.inputs)


def medium_in_box(
    filling: Filling, box: NDArray[np.float64], placed: Region, seed: int = 0
) -> tuple[ScatteringMedium | None, float]:
    """The medium in a mesh's box (2, 3) in object space, and its error of interpolation.

    ``placed``: the mesh's placement; its voxels do not count.
    """
    if not depends_on_place(filling):
        single = _resized(placed, box, (1, 1, 1))
        return filling.alike(single.at_voxels), 0.0
    edges = np.linalg.norm(placed.world_from_object[:3, :3], axis=0) * np.maximum(box[1] - box[0], 1e-12)
    rng = np.random.default_rng(seed)
    found, error = None, 0.0
    for size in SIZES:
        counts = np.maximum(np.ceil(size * edges / edges.max()), 2).astype(int)
        region = _resized(placed, box, (int(counts[0]), int(counts[1]), int(counts[2])))
        values = {program: region.at_voxels(program) for program in filling.programs_of}
        error = max(_error(region, program, values[program], rng) for program in filling.programs_of)
        if error <= COARSE or size == SIZES[-1]:
            found = filling.inside(values.__getitem__, region.shape, region.world_from_index)
            break
    return found, error


def medium_of_grids(
    filling: Filling, region: Region, alone: Callable[[str], Region], seed: int = 0
) -> tuple[ScatteringMedium | None, tuple[int, int, int], int, float]:
    """The medium of a Volume object, the size of its grid, parts of a voxel, and its error of interpolation.

    The grids are linear between the voxels, or cubic. Where the shader is not linear, as a threshold, or where it has a
    pattern of its own, the voxels are divided. From Blender 5.0 on, Principled Volume reads each of its own grids at
    one voxel nearby that is drawn at random: what it makes of one grid, as a blackbody, is interpolated between the
    voxels of this grid. ``alone``: the region of one grid, at its own voxels.
    """
    rng = np.random.default_rng(seed)
    programs = () if compat.is_before_5_0() else filling.programs_of
    own = {p: alone(name) for p in programs if (name := _only_grid(p))}
    drawn = {p: region.of_other(other, p) for p, other in own.items()}

    def read(program: Program, finer: Region, parts: int) -> Array:
        if program not in drawn:
            return finer.at_voxels(program)
        return region.between(drawn[program], parts, is_sampled=own[program] is not region)

    # curves between the voxels need one more step where the memory suffices
    is_small = np.prod(region.shape, dtype=float) * 8 <= MOST_FINER
    for parts in FINER[1:] if region.is_cubic and is_small else FINER:
        finer = region.divided(parts)
        values = {p: read(p, finer, parts) for p in filling.programs_of}
        others = [p for p in filling.programs_of if p not in drawn]
        error = max((_lost(region, finer, parts, program, values[program], rng) for program in others), default=0.0)
        if error <= COARSE or parts == FINER[-1] or np.prod(finer.shape, dtype=float) * 8 > MOST_FINER:
            break
    medium = filling.inside(values.__getitem__, finer.shape, finer.world_from_index)
    return medium, finer.shape, parts, error


def _only_grid(program: Program) -> str:
    """The grid of Principled Volume that is all that a program reads of its place; "" if it reads others."""
    names = [name.removeprefix(GRID) for name in program.inputs if name.startswith(GRID)]
    return names[0] if len(program.inputs) == len(names) == 1 else ""


def _lost(
    region: Region, finer: Region, parts: int, program: Program, values: Array, rng: np.random.Generator
) -> float:
    """Mean error of linear interpolation between voxels, over the mean value, at random points where grids are not
    0.
    """
    filled = np.zeros(int(np.prod(region.shape)), bool)
    for grid in region.grids.values():
        filled |= (grid != 0) if grid.ndim == 1 else (grid != 0).any(axis=1)
    chosen = rng.choice(np.flatnonzero(filled) if filled.any() else len(filled), PROBES)
    place = np.stack(np.unravel_index(chosen, region.shape), axis=1) + rng.uniform(-1.0, 1.0, (PROBES, 3))
    place = np.clip(place, 0, np.array(region.shape) - 1.0)
    exact = np.maximum(np.nan_to_num(region.at(program, place)).reshape(PROBES, -1), 0.0)
    read = np.maximum(values, 0.0).reshape(len(values), -1)
    size = float(exact.mean())
    return float(np.abs(_between(read, finer.shape, place * parts) - exact).mean() / size) if size > 0 else 0.0


def _resized(placed: Region, box: NDArray[np.float64], shape: tuple[int, int, int]) -> Region:
    """The region with voxels that fill a box in object space."""
    edge = np.maximum(box[1] - box[0], 1e-12) / shape
    object_from_index = np.eye(4)
    object_from_index[:3, :3] = np.diag(edge)
    object_from_index[:3, 3] = box[0] + edge / 2
    return Region(
        shape, placed.world_from_object @ object_from_index, placed.world_from_object, placed.camera_from_world,
        placed.center, placed.half, placed.facts,
    )  # fmt: skip


def _error(region: Region, program: Program, values: Array, rng: np.random.Generator) -> float:
    """Error of linear interpolation between voxels at random points: root mean square over the mean value."""
    place = rng.random((PROBES, 3)) * (np.array(region.shape) - 1)
    exact = np.nan_to_num(region.at(program, place)).reshape(PROBES, -1)
    read = _between(values.reshape(len(values), -1), region.shape, place)
    size = float(np.abs(exact).mean())
    return float(np.sqrt(np.mean((read - exact) ** 2)) / size) if size > 0 else 0.0

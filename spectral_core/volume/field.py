# SPDX-License-Identifier: GPL-3.0-or-later
"""The scalar field that every part of the volume package uses.

Convention: ``data[i, j, k]`` is the value at the *center* of voxel (i, j, k); the center has index coordinates
(i, j, k), x first. A voxel is one unit wide, so the field fills the index box [-0.5, n - 0.5] on each axis. Between
centers the field is trilinear; in the outer half voxel it keeps the value of the face (a texture's clamp). So a
volume of a single slice is a slab one voxel thick, not nothing. ``world_from_index`` takes index coordinates to world
coordinates and may scale, shear, rotate and mirror.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spectral_core.checks import (
    as_array,
    frozen_array,
    read_only,
    read_only_when_copied,
    require_finite,
    require_range,
    require_unmasked,
)
from spectral_core.errors import InvalidInputError
from spectral_core.volume.fill_values import range_without_fill_values

LEAST_VOXEL, GREATEST_VOXEL = 1e-30, 1e30
"""World lengths of the edges of a voxel that is rendered: those times an extinction fit into single precision."""
VOLUME_SOURCES = "read_volume of spectral_core.volume.files reads a file, sample_volume makes a sample"
"""Hint for a name or a path in place of a volume."""


@read_only_when_copied
@dataclass(frozen=True, eq=False)
class ScalarVolume:
    """A scalar field on a regular grid and its position in the world.

    ``data`` has shape (nx, ny, nz), each at least 1, any integer or float type, and keeps that type and its memory
    order (x fastest, as most files store it, is the order that renders without a second copy). A writeable array
    is copied; a read-only array is used without a copy. ``world_from_index`` is a 4×4 affine matrix from index
    coordinates (see the module) to world coordinates, default identity. Raises InvalidInputError for another
    shape or type, for an empty axis, for NaN or Inf (the message names the first bad voxel) and for a matrix that
    is not affine or not invertible.
    """

    name: str
    data: NDArray[Any]
    world_from_index: NDArray[np.float64] = field(default_factory=lambda: np.eye(4))

    def __post_init__(self) -> None:
        object.__setattr__(self, "data", _frozen_data(self.name, self.data))
        object.__setattr__(self, "world_from_index", _frozen_affine(self.name, self.world_from_index))

    def __repr__(self) -> str:
        size = "×".join(map(str, self.shape))
        low, high = self.value_range
        return f"ScalarVolume({self.name!r}, {size} {self.data.dtype}, values {low:g} to {high:g})"

    @classmethod
    def from_spacing(
        cls, name: str, data: ArrayLike, spacing: ArrayLike = (1.0, 1.0, 1.0), origin: ArrayLike = (0.0, 0.0, 0.0)
    ) -> ScalarVolume:
        """Axis-parallel voxels of size ``spacing`` (3,), voxel (0, 0, 0) centered at ``origin`` (3,), world units."""
        matrix = np.eye(4)
        matrix[:3, :3] = np.diag(frozen_array("spacing", spacing, (3,)))
        matrix[:3, 3] = frozen_array("origin", origin, (3,))
        return cls(name, np.asarray(data), matrix)

    @property
    def shape(self) -> tuple[int, int, int]:
        """Number of voxels (nx, ny, nz)."""
        nx, ny, nz = self.data.shape
        return nx, ny, nz

    @cached_property
    def value_range(self) -> tuple[float, float]:
        """Least and greatest value of the field."""
        return float(self.data.min()), float(self.data.max())

    @cached_property
    def range_without_fill_values(self) -> tuple[float, float]:
        """Least and greatest value, without values far beyond all others that mark missing data (-9999, 1e20)."""
        return range_without_fill_values(self.data)

    @cached_property
    def index_from_world(self) -> NDArray[np.float64]:
        """The inverse of ``world_from_index``, 4×4: world to index coordinates."""
        inverse = np.linalg.inv(self.world_from_index)
        inverse[3] = (0.0, 0.0, 0.0, 1.0)
        return read_only(inverse)

    @cached_property
    def corners_world(self) -> NDArray[np.float64]:
        """The eight corners of the filled box in world coordinates, shape (8, 3)."""
        n = np.array(self.shape, dtype=np.float64)
        unit = np.array(np.meshgrid([0, 1], [0, 1], [0, 1], indexing="ij"), dtype=np.float64).reshape(3, 8).T
        return read_only((unit * n - 0.5) @ self.world_from_index[:3, :3].T + self.world_from_index[:3, 3])

    @cached_property
    def voxel_size(self) -> NDArray[np.float64]:
        """World length of one voxel along each index axis, shape (3,)."""
        return read_only(np.linalg.norm(self.world_from_index[:3, :3], axis=0))

    def require_renderable(self) -> None:
        """Raise InvalidInputError for voxels shorter than ``LEAST_VOXEL`` or longer than ``GREATEST_VOXEL``."""
        for edge in self.voxel_size:
            require_range(f"the edge of a voxel of volume {self.name!r}", float(edge), LEAST_VOXEL, GREATEST_VOXEL)


def _frozen_data(name: str, values: ArrayLike) -> NDArray[Any]:
    require_unmasked(f"volume {name!r}", values)
    array = values if isinstance(values, np.ndarray) else as_array(f"volume {name!r} is of", values, None)
    if array.dtype.kind not in "iuf":
        raise InvalidInputError(
            f"volume {name!r} holds {array.dtype}; expected an integer or float type, convert it with astype first"
        )
    if array.ndim != 3 or 0 in array.shape:
        raise InvalidInputError(f"volume {name!r} has shape {array.shape}; expected (nx, ny, nz) with each at least 1")
    if not array.dtype.isnative:
        array = array.astype(array.dtype.newbyteorder("="))
    elif array.flags.writeable:
        array = array.copy(order="K")
    require_finite(f"volume {name!r}", array)
    array.setflags(write=False)
    return array


def _frozen_affine(name: str, matrix: ArrayLike) -> NDArray[np.float64]:
    affine = frozen_array(f"world_from_index of volume {name!r}", matrix, (4, 4))
    if not np.array_equal(affine[3], (0.0, 0.0, 0.0, 1.0)):
        raise InvalidInputError(
            f"world_from_index of volume {name!r} has last row {affine[3].tolist()}; expected 0 0 0 1"
        )
    lengths = np.linalg.norm(affine[:3, :3], axis=0)
    # The determinant of the unit axes does not depend on scale, so that voxels 1e-6 wide are accepted.
    if not lengths.all() or abs(np.linalg.det(affine[:3, :3] / lengths)) < 1e-9:
        raise InvalidInputError(
            f"world_from_index of volume {name!r} is not invertible; its voxels have no extent in some direction"
        )
    return affine

# SPDX-License-Identifier: GPL-3.0-or-later
"""OpenVDB grids, dense within the box of their active voxels, through the ``openvdb`` module that Blender ships.

The module is looked for as ``openvdb``, as ``pyopenvdb`` (its earlier name) and inside an installed ``bpy`` package,
which keeps it off the module path. A grid's sample (i, j, k) stands at ``transform(i, j, k)``, which is where
``ScalarVolume`` puts the centre of its voxel.
"""

from __future__ import annotations

import importlib
import importlib.util
import math
import struct
import sys
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from spectral_core.errors import FileFormatError, InvalidInputError, MissingDependencyError
from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.files.payload import affine, make_volume, pick_component
from spectral_core.volume.files.request import ReadRequest
from spectral_core.volume.files.vtk_format import choose_array

DENSITY_GRID = "density"
"""The name under which a volume is written: what Blender's materials look for."""
_DTYPES = {
    "float": "f4",
    "half": "f4",
    "double": "f8",
    "bool": "?",
    "int32": "i4",
    "int64": "i8",
    "vec3s": "f4",
    "vec3d": "f8",
    "vec3i": "i4",
}
_MOST_VOXELS = 1 << 32
_FIRST_KNOWN_VERSION = 222
"""File versions from OpenVDB 3 on; older ones have another head and are left to OpenVDB."""
_SHAPE_KEY, _TYPE_KEY, _NAME_KEY = "spectral_shape", "spectral_dtype", "spectral_name"


def read(path: Path, request: ReadRequest) -> ScalarVolume:
    """The volume of one grid, ``request.field`` by name; vector grids need ``request.component``.

    Files that ``write`` made come back with their own type, size and name; other grids with the value type of the
    grid and the box of their active voxels.
    """
    openvdb = require_openvdb("reading OpenVDB files")
    _refuse_cut(path)
    try:
        held = {str(grid.name): grid for grid in openvdb.readAllGridMetadata(str(path))}
        name = str(choose_array(held, request.field, path, DENSITY_GRID).name)
        grid = openvdb.read(str(path), name)
    except (RuntimeError, OSError, ValueError) as error:
        if isinstance(error, InvalidInputError):
            raise
        raise FileFormatError(f"{path.name} is not an OpenVDB file that can be read, or it is cut: {error}") from error
    if grid.valueTypeName not in _DTYPES:
        raise FileFormatError(f"grid {name!r} of {path.name} holds {grid.valueTypeName}; expected numbers")
    low, shape = _box(grid, path)
    array = _dense(grid, low, shape)
    if array.ndim == 4:
        array = pick_component(array, 3, request.component, path)
    stored = grid.metadata.get(_TYPE_KEY)
    if stored is not None:
        array = array.astype(stored)
    title = grid.metadata.get(_NAME_KEY) or path.stem
    return make_volume(title, array, _to_world(grid, low, path), path)


def write(volume: ScalarVolume, path: Path) -> None:
    """Write one grid named ``density``: float where that is exact for the data's type, double otherwise.

    Voxels of value 0 are left to the background. Shape, type and name go into the grid's metadata.
    Raises InvalidInputError for integers that double cannot hold.
    """
    openvdb = require_openvdb("writing OpenVDB files")
    stored = _exact_float(volume)
    grid = (openvdb.FloatGrid if stored == np.float32 else openvdb.DoubleGrid)(0.0)
    # The binding takes no read-only array, so this copies one that is of the right type already.
    grid.copyFromArray(np.require(volume.data, stored, ["C", "W"]))
    grid.name = DENSITY_GRID
    grid.gridClass = openvdb.GridClass.FOG_VOLUME
    grid.transform = openvdb.createLinearTransform(volume.to_world.T.tolist())  # row vectors, as everywhere in OpenVDB
    grid[_SHAPE_KEY] = " ".join(map(str, volume.shape))
    grid[_TYPE_KEY] = volume.data.dtype.name
    grid[_NAME_KEY] = volume.name
    openvdb.write(str(path), grids=[grid])


@cache
def find_openvdb() -> ModuleType | None:
    """The OpenVDB module of this Python or of the bpy package beside it; None where there is none."""
    for name in ("openvdb", "pyopenvdb"):
        if importlib.util.find_spec(name) is not None:
            try:
                return importlib.import_module(name)
            except ImportError:  # a wheel for another Python or a missing shared library: look further
                continue
    package = importlib.util.find_spec("bpy")
    if package is None or package.origin is None:
        return None
    for library in sorted(Path(package.origin).parent.glob("*/python/lib/**/site-packages/*openvdb*")):
        if library.suffix in (".so", ".pyd"):
            name = library.name.split(".")[0]
            spec = importlib.util.spec_from_file_location(name, library)
            if spec is not None and spec.loader is not None:
                module = importlib.util.module_from_spec(spec)
                spec.loader.exec_module(module)
                sys.modules[name] = module
                return module
    return None


def require_openvdb(purpose: str) -> Any:
    """The OpenVDB module, or MissingDependencyError."""
    module = find_openvdb()
    if module is None:
        raise MissingDependencyError(
            f"{purpose} needs OpenVDB's Python module; Blender ships it: run inside Blender, or pip install "
            "'spectral-scene[blender]' (pip install openvdb on platforms that have it)"
        )
    return module


def _refuse_cut(path: Path) -> None:
    """Compare the grids' stated ends with the file's size: OpenVDB itself reads zeros where a file has ended.

    The head holds magic (8 bytes), versions (3×4), a flag, an identifier (36), metadata, and the number of grids; each
    grid's descriptor (names, then begin, block and end positions) stands right before the grid.
    """
    size = path.stat().st_size
    try:
        with path.open("rb") as stream:
            _, file_version = struct.unpack("<qI", stream.read(12))
            if file_version < _FIRST_KNOWN_VERSION:
                return
            stream.seek(8 + 1 + 36, 1)
            for _ in range(_word(stream)):
                _text(stream), _text(stream)
                stream.seek(_word(stream), 1)
            for _ in range(_word(stream)):
                _text(stream), _text(stream), _text(stream)
                _, _, end = struct.unpack("<3q", stream.read(24))
                if end > size:
                    raise FileFormatError(f"{path.name} is cut: its grids end at byte {end}, the file at byte {size}")
                stream.seek(end)
    except struct.error as error:
        raise FileFormatError(f"{path.name} is cut: it ends within its list of grids") from error


def _word(stream: BinaryIO) -> int:
    return int(struct.unpack("<I", stream.read(4))[0])


def _text(stream: BinaryIO) -> bytes:
    return stream.read(_word(stream))


def _box(grid: Any, path: Path) -> tuple[tuple[int, int, int], tuple[int, ...]]:
    """First index and size of the voxels to read."""
    stated = str(grid.metadata.get(_SHAPE_KEY, "")).split()
    if stated:
        return (0, 0, 0), tuple(int(n) for n in stated)
    if grid.activeVoxelCount() == 0:
        raise FileFormatError(f"grid {grid.name!r} of {path.name} has no active voxel; there is nothing to read")
    low, high = grid.evalActiveVoxelBoundingBox()
    shape = tuple(b - a + 1 for a, b in zip(low, high, strict=True))
    if math.prod(shape) > _MOST_VOXELS:
        raise FileFormatError(
            f"grid {grid.name!r} of {path.name} spans {'×'.join(map(str, shape))} voxels, more than memory holds when "
            "dense; crop or resample it"
        )
    return (int(low[0]), int(low[1]), int(low[2])), shape


def _dense(grid: Any, low: tuple[int, int, int], shape: tuple[int, ...]) -> NDArray[Any]:
    components = (3,) if grid.valueTypeName.startswith("vec3") else ()
    array = np.zeros((*shape, *components), _DTYPES[grid.valueTypeName])
    grid.copyToArray(array, ijk=low)
    return array


def _to_world(grid: Any, low: tuple[int, int, int], path: Path) -> NDArray[np.float64]:
    if not grid.transform.isLinear:
        raise FileFormatError(
            f"grid {grid.name!r} of {path.name} has a frustum transform; only linear ones are volumes here"
        )
    corner = np.array(grid.transform.indexToWorld(low))
    steps = [(*low[:a], low[a] + 1, *low[a + 1 :]) for a in range(3)]
    columns = [np.array(grid.transform.indexToWorld(step)) - corner for step in steps]
    return affine(np.stack(columns, axis=1), corner)


def _exact_float(volume: ScalarVolume) -> type:
    dtype = volume.data.dtype
    if dtype.kind == "f":
        return np.float32 if dtype.itemsize <= 4 else np.float64
    low, high = int(volume.data.min()), int(volume.data.max())
    for kind, bits in ((np.float32, 24), (np.float64, 53)):
        if -(1 << bits) <= low and high <= 1 << bits:
            return kind
    raise InvalidInputError(
        f"volume {volume.name!r} holds integers from {low} to {high}, which no float grid of OpenVDB holds exactly; "
        "convert it to float64 first, or write NRRD"
    )

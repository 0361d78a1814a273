# SPDX-License-Identifier: GPL-3.0-or-later
"""OpenVDB grids, dense within the box of their active voxels, through the ``openvdb`` module that Blender ships.

Without the module (Debian's Blender has none), this package reads plain and zipped files and writes zipped ones; files
that OpenVDB packed with Blosc need the module. It is searched as ``openvdb``, as ``pyopenvdb`` (its earlier name) and
inside an installed ``bpy`` package, which is not on the module path. A grid's sample (i, j, k) is at ``transform(i, j,
k)``, the center of its voxel in ``ScalarVolume``.
"""

from __future__ import annotations

import importlib
import importlib.util
import math
import sys
import threading
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.errors import FileFormatError, InvalidInputError
from spectral_core.files.guarded import FREE_BYTES, MOST_EXPANSION, half_of_memory
from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.files.formats.vtk_format import choose_array
from spectral_core.volume.files.payload import EmptyGridError, affine, make_volume, pick_component, require_choice
from spectral_core.volume.files.request import ReadRequest
from spectral_core.volume.files.vdb.read import grid_names, read_grid
from spectral_core.volume.files.vdb.walk import sound_metadata
from spectral_core.volume.files.vdb.write import write_grid

DENSITY_GRID = "density"
"""Name of the written grid, which Blender's materials expect."""
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
_WRITTEN = {f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64)} | {"float16", "float32", "float64"}
_SHAPE_KEY, _TYPE_KEY, _NAME_KEY = "spectral_shape", "spectral_dtype", "spectral_name"


def read(path: Path, request: ReadRequest) -> ScalarVolume:
    """The volume of one grid, ``request.field`` by name; vector grids need ``request.component``.

    Files of ``write`` keep their type, size and name; other grids have the value type of the grid and the box of their
    active voxels; Booleans are 0 and 1.
    """
    names = grid_names(path)
    name = str(choose_array({name: name for name in names}, request.field, path, DENSITY_GRID))
    array, metadata, world_from_index = _read_with_openvdb(path, name) if find_openvdb() else _read_plainly(path, name)
    require_choice(request.component, array.shape[3:], path)
    if array.ndim == 4:
        array = pick_component(array, 3, request.component, path)
    array = _restored(array, str(metadata.get(_TYPE_KEY)))
    return make_volume(str(metadata.get(_NAME_KEY) or path.stem), array, world_from_index, path)


def write(volume: ScalarVolume, path: Path) -> None:
    """Write one grid named ``density``: float if that is exact for the data's type, else double.

    Voxels of value 0 become background. Shape, type and name are stored in the grid's metadata. Raises
    InvalidInputError for integers that double cannot represent.
    """
    name = volume.name.encode("utf-8", "replace").decode("utf-8")  # of a file whose name is not UTF-8
    texts = {_SHAPE_KEY: " ".join(map(str, volume.shape)), _TYPE_KEY: volume.data.dtype.name, _NAME_KEY: name}
    # The binding takes no read-only array, so this copies even an array of the right type.
    data = np.require(volume.data, _exact_float(volume), ["C", "W"])
    openvdb: Any = find_openvdb()
    # The binding keeps all threads from Python while it writes, the one of an interface, too.
    if openvdb is None or threading.current_thread() is not threading.main_thread():
        write_grid(path, data, volume.world_from_index, DENSITY_GRID, texts)
        return
    grid = (openvdb.FloatGrid if data.dtype == np.float32 else openvdb.DoubleGrid)(0.0)
    grid.copyFromArray(data)
    grid.name = DENSITY_GRID
    grid.gridClass = openvdb.GridClass.FOG_VOLUME
    # Transposed: OpenVDB multiplies row vectors by matrices.
    grid.transform = openvdb.createLinearTransform(volume.world_from_index.T.tolist())
    for key, text in texts.items():
        grid[key] = text
    openvdb.write(str(path), grids=[grid])


def require_whole(path: Path) -> None:
    """Raise FileFormatError if a file that was just written is truncated: OpenVDB does not report a full disk."""
    grid_names(path)


@cache
def find_openvdb() -> ModuleType | None:
    """The OpenVDB module of this Python or of the bpy package; None if there is none."""
    for name in ("openvdb", "pyopenvdb"):
        if importlib.util.find_spec(name) is not None:
            try:
                return importlib.import_module(name)
            except ImportError:  # a wheel for another Python or a missing shared library: look further
                continue
    package = importlib.util.find_spec("bpy")
    if package is None or package.origin is None or not Path(package.origin).is_file():  # Blender's own is "built-in"
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


def _read_with_openvdb(path: Path, name: str) -> tuple[NDArray[Any], dict[str, Any], NDArray[np.float64]]:
    openvdb: Any = find_openvdb()
    metadata = sound_metadata(path, name)  # never grid.metadata, which ends Blender if a text is not UTF-8
    try:
        grid = openvdb.read(str(path), name)
    except (RuntimeError, OSError, ValueError, KeyError) as error:  # KeyError: a name that is not UTF-8
        raise FileFormatError(
            f"{path.name} is not an OpenVDB file that can be read, or it is truncated: {error}"
        ) from error
    if grid.valueTypeName not in _DTYPES:
        raise FileFormatError(f"grid {name!r} of {path.name} holds {grid.valueTypeName}; expected numbers")
    active = None if grid.activeVoxelCount() == 0 else grid.evalActiveVoxelBoundingBox()
    low, shape = _box(metadata, active)
    components = (3,) if grid.valueTypeName.startswith("vec3") else ()
    _require_holdable(name, (*shape, *components), np.dtype(_DTYPES[grid.valueTypeName]), path)
    array = np.zeros((*shape, *components), _DTYPES[grid.valueTypeName])
    grid.copyToArray(array, ijk=low)
    if not grid.transform.isLinear:
        raise FileFormatError(
            f"grid {name!r} of {path.name} has a frustum transform; only linear ones are volumes here"
        )
    corner = np.array(grid.transform.indexToWorld(low))
    steps = [(*low[:a], low[a] + 1, *low[a + 1 :]) for a in range(3)]
    columns = [np.array(grid.transform.indexToWorld(step)) - corner for step in steps]
    return array, metadata, affine(np.stack(columns, axis=1), corner)


def _read_plainly(path: Path, name: str) -> tuple[NDArray[Any], dict[str, Any], NDArray[np.float64]]:
    grid = read_grid(path, name)
    low, shape = _box(grid.metadata, grid.active_box())
    whole = (*shape, *grid.leaves.shape[4:])
    _require_holdable(name, whole, grid.leaves.dtype, path)
    array = np.empty(whole, grid.leaves.dtype)
    grid.fill(array, low)
    matrix = grid.world_from_index.copy()
    matrix[:3, 3] += matrix[:3, :3] @ low
    return array, grid.metadata, matrix


def _box(metadata: dict[str, Any], active: Any) -> tuple[tuple[int, int, int], tuple[int, ...]]:
    """First index and size of the voxels to read: as ``write`` stated if that holds all, else the active box."""
    words = str(metadata.get(_SHAPE_KEY, "")).split()
    if len(words) == 3 and all(word.isascii() and word.isdigit() for word in words):
        stated = tuple(int(word) for word in words)
        reach = ((0, 0, 0), (0, 0, 0)) if active is None else active
        if min(reach[0]) >= 0 and all(0 <= b < n for b, n in zip(reach[1], stated, strict=True)):
            return (0, 0, 0), stated
    if active is None:
        return (0, 0, 0), (0, 0, 0)
    low, high = active
    return (int(low[0]), int(low[1]), int(low[2])), tuple(b - a + 1 for a, b in zip(low, high, strict=True))


def _require_holdable(name: str, shape: tuple[int, ...], dtype: np.dtype, path: Path) -> None:
    """Raise FileFormatError if a grid is empty, or too large or too sparse for a dense array."""
    dense = math.prod(shape) * dtype.itemsize
    if dense == 0:
        raise EmptyGridError(f"grid {name!r} of {path.name} has no active voxel; there is nothing to read")
    sparse = dense > FREE_BYTES and dense > MOST_EXPANSION * path.stat().st_size
    if sparse or dense > half_of_memory():
        raise FileFormatError(
            f"grid {name!r} of {path.name} spans {'×'.join(map(str, shape[:3]))} voxels, {dense / 2**30:.1f} GiB when "
            "dense: it is nearly empty, or too much for this machine; crop or resample it"
        )


def _restored(array: NDArray[Any], dtype: str) -> NDArray[Any]:
    """The data type that ``write`` recorded, if the values still fit it: other programs copy unknown metadata."""
    if dtype not in _WRITTEN:
        return array
    back = array.astype(dtype)
    return back if np.array_equal(back, array) else array


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

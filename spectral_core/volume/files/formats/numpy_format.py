# SPDX-License-Identifier: GPL-3.0-or-later
"""NumPy arrays: ``array[i, j, k]`` is voxel (i, j, k), so axis 0 is x. An .npz may hold the geometry beside the data.

In an .npz the data are the only array of three or more axes (or ``field``); ``to_world`` (4, 4), or ``spacing`` and
``origin`` (3,), are taken when they are there.
"""

from __future__ import annotations

import zipfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.errors import FileFormatError, InvalidInputError, UnknownNameError
from spectral_core.files.guarded import require_room
from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.files.payload import affine, make_volume, pick_component, require_choice
from spectral_core.volume.files.request import ReadRequest

_MOST_ARRAYS = 1000
_GEOMETRY = ("to_world", "spacing", "origin")


def read(path: Path, request: ReadRequest) -> ScalarVolume:
    """The volume of an .npy or .npz; a fourth axis (the last) needs ``request.component``."""
    try:
        _require_bounded(path)
        loaded = np.load(path, allow_pickle=False)
        if isinstance(loaded, np.ndarray):
            if request.field is not None:
                raise InvalidInputError(f"{path.name} holds one array without a name; leave field out")
            arrays = {path.stem: loaded}
        else:
            with loaded:
                if len(loaded.files) > _MOST_ARRAYS:
                    raise FileFormatError(
                        f"{path.name} holds {len(loaded.files)} arrays; expected a volume, among {_MOST_ARRAYS} at most"
                    )
                arrays = {key: loaded[key] for key in loaded.files}
    except InvalidInputError:
        raise
    except Exception as error:
        raise FileFormatError(
            f"{path.name} is not a NumPy file of plain numbers, or it is truncated: {error}"
        ) from error
    name = _choose(arrays, request.field, path)
    array = arrays[name]
    require_choice(request.component, array.shape[3:], path)
    if array.ndim == 4:
        array = pick_component(array, 3, request.component, path)
    if array.ndim != 3:
        raise FileFormatError(
            f"array {name!r} of {path.name} has shape {array.shape}; expected three axes (nx, ny, nz)"
        )
    return make_volume(name if request.field else path.stem, array, _world_from_index(arrays, path), path)


def _require_bounded(path: Path) -> None:
    """Raise FileFormatError if an .npz unpacks to, or an .npy states, more than memory or the file can hold."""
    size = path.stat().st_size
    if not zipfile.is_zipfile(path):
        return require_room(size, path)
    with zipfile.ZipFile(path) as archive:
        return require_room(sum(entry.file_size for entry in archive.infolist()), path, held=size)


def _choose(arrays: dict[str, NDArray[Any]], field: str | None, path: Path) -> str:
    if field is not None:
        if field not in arrays:
            raise UnknownNameError.among(f"array of {path.name}", field, arrays)
        return field
    if len(arrays) == 1:
        return next(iter(arrays))
    candidates = [key for key, array in arrays.items() if array.ndim >= 3 and key not in _GEOMETRY]
    if len(candidates) != 1:
        shapes = ", ".join(f"{key} {array.shape}" for key, array in arrays.items()) or "no array"
        raise InvalidInputError(f"{path.name} holds {shapes}; say which is the volume with field")
    return candidates[0]


def _world_from_index(arrays: dict[str, NDArray[Any]], path: Path) -> NDArray[np.float64]:
    if "to_world" in arrays:
        return _geometry(arrays, "to_world", np.eye(4), path)
    spacing = _geometry(arrays, "spacing", np.ones(3), path)
    return affine(np.diag(spacing), _geometry(arrays, "origin", np.zeros(3), path))


def _geometry(arrays: dict[str, NDArray[Any]], key: str, default: NDArray, path: Path) -> NDArray[np.float64]:
    given = arrays.get(key, default)
    if given.shape != default.shape or given.dtype.kind not in "iuf":
        raise FileFormatError(
            f"{key} of {path.name} has shape {given.shape} of {given.dtype}; expected {default.shape} numbers"
        )
    return given.astype(np.float64)

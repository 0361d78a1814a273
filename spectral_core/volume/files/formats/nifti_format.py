# SPDX-License-Identifier: GPL-3.0-or-later
"""NIfTI-1 and -2, single files and pairs, gzipped or not, through nibabel; the world is RAS+ in the file's unit."""

from __future__ import annotations

import glob
import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.errors import FileFormatError, InvalidInputError, MissingDependencyError
from spectral_core.files.guarded import require_regular, require_room
from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.files.payload import make_volume, pick_component, require_choice
from spectral_core.volume.files.request import ReadRequest

_LARGEST_SINGLE, _LEAST_SINGLE = 1e38, 1e-30
_FINEST_STEP = 1.0 / 16.0
"""Spacing of float32 up to which it holds scaled integers, in steps of them."""
_MOST_INTERCEPT = 16.0
"""Ratio of the intercept to the largest scaled number up to which float32 holds scaled floats: four bits are lost."""


def read(path: Path, request: ReadRequest) -> ScalarVolume:
    """The volume of a NIfTI file; a time series needs ``request.component``.

    The stored type is kept where the header scales nothing; scaled data become float32, or float64 where float32 cannot
    tell apart what is stored: wide integers, or an intercept far greater than the data.
    """
    try:
        import nibabel
    except ImportError as error:
        raise MissingDependencyError.package("nibabel", "reading NIfTI files", "volumes") from error
    try:
        for beside in path.parent.glob(f"{glob.escape(path.name.split('.')[0])}.*"):  # the other half of a pair
            if beside.suffix.lower() in (".img", ".gz", ".bz2") and not beside.is_dir():
                require_regular(beside)
        image: Any = nibabel.load(path)
        shape, dtype = image.dataobj.shape, image.dataobj.dtype
        is_scaled = (image.dataobj.slope, image.dataobj.inter) != (1.0, 0.0)
        require_room(math.prod(int(n) for n in shape) * (8 if is_scaled else dtype.itemsize), path)
        array = _values(image)
    except InvalidInputError:
        raise
    except Exception as error:
        raise FileFormatError(
            f"{path.name} is not a NIfTI file that can be read, or it is truncated: {error}"
        ) from error
    require_choice(request.component, array.shape[3:], path)
    while array.ndim > 3:
        array = pick_component(
            array, array.ndim - 1, request.component if array.shape[-1] > 1 else None, path, "time steps"
        )
    if array.ndim != 3:
        raise FileFormatError(
            f"{path.name} has shape {array.shape}; expected a volume with three axes, not a single slice or curve"
        )
    if array.dtype.kind not in "iufb":
        raise InvalidInputError(f"{path.name} holds {array.dtype} (colors or complex numbers); expected scalars")
    name = path.name.removesuffix(".gz")
    return make_volume(Path(name).stem, array, _placement(image), path)


def _placement(image: Any) -> NDArray[np.float64]:
    """The file's affine; without one, of either code, the sizes of its voxels alone, as NIfTI's method 1 says.

    nibabel would mirror the first axis there, by a custom of ANALYZE, which a file without an orientation does not ask
    for.
    """
    header = image.header
    codes = [int(header[key]) for key in ("qform_code", "sform_code") if key in header]
    if codes and not any(codes):
        return np.diag([*(float(size) for size in header.get_zooms()[:3]), 1.0])
    return np.asarray(image.affine, float)


def _values(image: Any) -> NDArray[Any]:
    """The voxels: as stored if the header's slope and intercept change nothing, else slope · stored + intercept."""
    proxy = image.dataobj
    stored = np.array(proxy.get_unscaled(), order="K")
    if (proxy.slope, proxy.inter) == (1.0, 0.0):
        return stored if stored.dtype.isnative else stored.astype(stored.dtype.newbyteorder("="))
    scaled: NDArray[Any] = stored.astype(_scaled_type(stored, float(proxy.slope), float(proxy.inter)), order="K")
    np.multiply(scaled, proxy.slope, out=scaled)
    return np.add(scaled, proxy.inter, out=scaled)


def _scaled_type(stored: NDArray[Any], slope: float, inter: float) -> type:
    """float32 if slope · stored + intercept keeps in it what is stored, else float64."""
    if stored.dtype.kind not in "iuf":  # colors and complex numbers, which are refused
        return np.float32
    largest = abs(slope) * max(abs(float(stored.min(initial=0))), abs(float(stored.max(initial=0))))
    if stored.dtype.kind == "f":
        is_kept = stored.itemsize <= 4 and abs(inter) <= _MOST_INTERCEPT * largest
    else:
        spacing = float(np.finfo(np.float32).eps) * (largest + abs(inter))
        is_kept = stored.itemsize <= 2 and spacing <= _FINEST_STEP * abs(slope)
    # products outside of the normal numbers of float32 would overflow, or lose digits
    is_normal = largest + abs(inter) < _LARGEST_SINGLE and abs(slope) > _LEAST_SINGLE
    return np.float32 if is_kept and is_normal else np.float64

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


def read(path: Path, request: ReadRequest) -> ScalarVolume:
    """The volume of a NIfTI file; a time series needs ``request.component``.

    The stored type is kept where the header scales nothing; scaled data become float32, or float64 where the stored
    integers are wider than float32 can hold.
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
        require_room(math.prod(int(n) for n in shape) * max(dtype.itemsize, 4), path)
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
    return make_volume(Path(name).stem, array, np.asarray(image.affine, float), path)


def _values(image: Any) -> NDArray[Any]:
    """The voxels: as stored if the header's slope and intercept change nothing, else slope · stored + intercept."""
    proxy = image.dataobj
    stored = np.array(proxy.get_unscaled(), order="K")
    if (proxy.slope, proxy.inter) == (1.0, 0.0):
        return stored if stored.dtype.isnative else stored.astype(stored.dtype.newbyteorder("="))
    wide = stored.itemsize > (2 if stored.dtype.kind in "iu" else 4)
    scaled: NDArray[Any] = stored.astype(np.float64 if wide else np.float32, order="K")
    np.multiply(scaled, proxy.slope, out=scaled)
    return np.add(scaled, proxy.inter, out=scaled)

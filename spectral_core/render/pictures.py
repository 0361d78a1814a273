# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures from files, read by Mitsuba's own readers: PNG, JPEG, EXR, HDR, BMP, TGA."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.errors import FileFormatError, InvalidInputError, MissingDependencyError
from spectral_core.files.guarded import no_file


def read_picture(path: str | Path) -> NDArray[Any]:
    """Pixels (height, width, 3), top row first: integers are display values (sRGB), floats are linear.

    An alpha channel is refused unless it is 1 everywhere; gray pictures have three equal channels.

    Raises
    ------
    InvalidInputError : there is no such file, or it is partly transparent. FileFormatError : it cannot be read.
    """
    path = Path(path)
    if not path.is_file():
        raise InvalidInputError(no_file(path))
    try:
        import mitsuba

        if mitsuba.variant() is None:  # pictures need some variant; that of the caller stays
            mitsuba.set_variant("scalar_rgb")
        bitmap = mitsuba.Bitmap(str(path))
        pixels = np.array(bitmap)
    except ImportError as error:
        raise MissingDependencyError.package("mitsuba", "a picture file", "render") from error
    except RuntimeError as error:
        raise FileFormatError(f"{path} cannot be read as a picture ({str(error).strip().splitlines()[-1]})") from error
    if pixels.ndim == 2:
        pixels = pixels[..., None]
    if pixels.shape[2] in (2, 4):
        alpha = pixels[..., -1]
        if alpha.min() < (np.iinfo(alpha.dtype).max if alpha.dtype.kind == "u" else 1):
            raise InvalidInputError(f"{path} is partly transparent; lay it on a background first")
        pixels = pixels[..., :-1]
    return np.repeat(pixels, 3, axis=2) if pixels.shape[2] == 1 else pixels

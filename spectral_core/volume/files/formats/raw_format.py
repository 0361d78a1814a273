# SPDX-License-Identifier: GPL-3.0-or-later
"""Bare numbers: the layout comes from the caller or from the file's name."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from spectral_core.errors import FileFormatError, InvalidInputError
from spectral_core.files.guarded import open_regular
from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.files.payload import affine, make_volume, read_numbers, require_choice, x_first
from spectral_core.volume.files.request import RawLayout, ReadRequest

HEADERS = (".mhd", ".nhdr", ".dat", ".hdr")
"""Endings of headers whose numbers are in other files."""


def read(path: Path, request: ReadRequest) -> ScalarVolume:
    """The volume with the layout of ``request.raw`` or of the file's name."""
    layout = request.raw or RawLayout.from_name(path.name)
    if layout is None:
        beside = [path.with_suffix(ending).name for ending in HEADERS if path.with_suffix(ending).exists()]
        hint = (
            f"{beside[0]} lies beside it: open that"
            if beside
            else ("give its layout: raw=RawLayout(shape, dtype), or --raw-shape and --raw-type on the command line")
        )
        raise InvalidInputError(
            f"{path.name} is a file of bare numbers and its name does not spell a layout as "
            f"'foot_256x256x256_uint8.raw' does; {hint}"
        )
    return read_layout(path, layout, request.component)


def read_layout(path: Path, layout: RawLayout, component: int | None = None) -> ScalarVolume:
    """The volume of one raw file; a component, or a file whose length differs from the layout, is refused."""
    require_choice(component, (), path)
    count = math.prod(layout.shape)
    expected = count * layout.stored_dtype.itemsize
    with open_regular(path) as stream:
        size = stream.seek(0, 2)
        start = layout.offset if layout.offset >= 0 else size - expected
        if size - start != expected or start < 0:
            raise FileFormatError(
                f"{path.name} has {size} bytes; {'×'.join(map(str, layout.shape))} numbers of type "
                f"{layout.stored_dtype.name} after {max(layout.offset, 0)} bytes of header are "
                f"{expected + max(layout.offset, 0)} bytes. Check shape, type and offset"
            )
        stream.seek(start)
        numbers = read_numbers(stream, layout.stored_dtype, count, path)
    matrix = affine(np.diag(layout.spacing), np.asarray(layout.origin))
    return make_volume(path.stem, x_first(numbers, layout.shape), matrix, path)

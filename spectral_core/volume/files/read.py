# SPDX-License-Identifier: GPL-3.0-or-later
"""The reader for every format."""

from __future__ import annotations

import importlib
from pathlib import Path

from spectral_core.checks import path_of
from spectral_core.errors import InvalidInputError
from spectral_core.files.guarded import reading, require_regular
from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.files.registry import by_name, detect_format
from spectral_core.volume.files.request import RawLayout, ReadRequest


def read_volume(
    path: str | Path, *, field: str | None = None, component: int | None = None, raw: RawLayout | None = None
) -> ScalarVolume:
    """The scalar volume of a file, with the file's own type, spacing, orientation and origin.

    ``field`` selects an array, grid or key by name if a file contains several; ``component`` selects an entry of a
    non-spatial axis (vector component, color channel, time step); ``raw`` is the layout of a file of bare numbers, of
    any name. Raises FileFormatError for a file that is truncated, invalid or of another format, InvalidInputError for a
    choice that is missing or not in the file, and MissingDependencyError if the format's library is not installed.
    """
    path = path_of(path)
    request = ReadRequest(field, component, raw)
    if raw is not None and path.is_dir():
        raise InvalidInputError(f"{path} is a folder; a raw layout describes one file")
    chosen = by_name("raw") if raw is not None else detect_format(path)
    if field is not None and not chosen.names_arrays:
        raise InvalidInputError(f"{path.name} holds one array without a name; leave field out")
    reader = importlib.import_module(f"spectral_core.volume.files.formats.{chosen.name}_format")
    with reading(path, f"a volume in the format {chosen.description}"):
        if not path.is_dir():
            require_regular(path)
        volume: ScalarVolume = reader.read(path, request)
    return volume

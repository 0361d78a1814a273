# SPDX-License-Identifier: GPL-3.0-or-later
"""Volumes to files: OpenVDB for Blender's Volume objects, NRRD for other programs."""

from __future__ import annotations

import importlib
from pathlib import Path

from spectral_core.checks import path_of, require_kind
from spectral_core.errors import InvalidInputError
from spectral_core.files.whole import whole_file
from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.files.registry import FORMATS, by_extension


def write_volume(volume: ScalarVolume, path: str | Path) -> Path:
    """Write ``volume`` in the format of the extension of ``path`` (.vdb or .nrrd); returns the path.

    The file is written completely or not at all. Raises InvalidInputError for another extension or a folder that does
    not exist, FileWriteError if the disk is full.
    """
    require_kind("the volume", volume, ScalarVolume, "volume.files.read_volume(PATH)")
    path = path_of(path)
    chosen = by_extension(path)
    if chosen is None or not chosen.writes or path.suffix == ".nhdr":
        endings = [entry.extensions[0] for entry in FORMATS if entry.writes]
        raise InvalidInputError(
            f"{path.name} names no format that is written here; expected an ending {' or '.join(endings)}"
        )
    if not path.parent.is_dir():
        raise InvalidInputError(f"the folder {path.parent} does not exist; create it before writing {path.name}")
    writer = importlib.import_module(f"spectral_core.volume.files.formats.{chosen.name}_format")
    with whole_file(path, check=getattr(writer, "require_whole", None)) as unfinished:
        writer.write(volume, unfinished)
    return path

# SPDX-License-Identifier: GPL-3.0-or-later
"""A spectral texture as one EXR file: a half-float channel per basis spectrum, spectra and lights in the header.

Channels ``weight.0`` … ``weight.7``; the string attribute ``spectralTexture`` holds the rest as JSON. Any program that
reads EXR can filter, tile and compress the weights: averages of weights are still reflectances within [0, 1].
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from spectral_core.checks import path_of
from spectral_core.errors import FileFormatError, InvalidInputError
from spectral_core.files.exr import openexr, read_exr, write_exr
from spectral_core.files.guarded import reading, require_shallow
from spectral_core.files.whole import make_folder
from spectral_core.palette.texture.basis import MOST_SPECTRA
from spectral_core.palette.texture.reach import TEXTURE_GRID
from spectral_core.palette.texture.texture import SpectralTexture
from spectral_core.spectra.spectrum import Illuminant, SpectralGrid

ATTRIBUTE = "spectralTexture"
VERSION = 1


def write_texture(path: str | Path, texture: SpectralTexture) -> Path:
    """Write ``texture`` to ``path``, whole or not at all; returns ``path``.

    Raises InvalidInputError if the name does not end in .exr, MissingDependencyError without OpenEXR.
    """
    path = path_of(path)
    if path.suffix.lower() != ".exr":
        raise InvalidInputError(
            f"a spectral texture is an EXR file; got the name {path.name!r}, give one ending in .exr"
        )
    module = openexr()
    about = {
        "version": VERSION,
        "wavelengths_nm": TEXTURE_GRID.wavelengths_nm.tolist(),
        "spectra": texture.spectra.tolist(),
        "lights": [
            {"name": light.name, "wavelengths_nm": light.grid.wavelengths_nm.tolist(), "values": light.values.tolist()}
            for light in texture.lights
        ],
    }
    header = {
        "type": module.scanlineimage,
        "compression": module.ZIP_COMPRESSION,
        ATTRIBUTE: json.dumps(about, separators=(",", ":")),
    }
    channels = {f"weight.{k}": np.ascontiguousarray(plane) for k, plane in enumerate(texture.weights)}
    make_folder(path.parent)
    write_exr(path, module.File(header, channels))
    return path


def read_texture(path: str | Path) -> SpectralTexture:
    """Read a spectral texture.

    Raises FileFormatError if the file cannot be read, or holds no complete spectral texture.
    """
    part = read_exr(path, "a spectral texture")[0]
    header, channels = part.header, part.channels
    if ATTRIBUTE not in header:
        raise FileFormatError(
            f"{path} is an EXR file without the attribute {ATTRIBUTE!r}; expected a file of `spectral-scene texture`"
        )
    with reading(path, "a spectral texture"):
        require_shallow(header[ATTRIBUTE], path)
        about = json.loads(header[ATTRIBUTE])
        if not all(np.array_equal(*ends) for ends in zip(header["dataWindow"], header["displayWindow"], strict=True)):
            raise FileFormatError(f"{path} has pixels for another area than its picture; save it with all its pixels")
        names = [f"weight.{k}" for k in range(len(about["spectra"]))]
        if about["version"] != VERSION or not 1 <= len(names) <= MOST_SPECTRA:
            raise FileFormatError(f"{path} has version {about['version']} and {len(names)} spectra; expected version 1")
        missing = [name for name in names if name not in channels]
        if missing:
            raise FileFormatError(f"{path} lacks the channels {', '.join(missing)}")
        if not np.allclose(about["wavelengths_nm"], TEXTURE_GRID.wavelengths_nm):
            raise FileFormatError(f"{path} has spectra on another grid; expected {TEXTURE_GRID}")
        weights = np.stack([channels[name].pixels for name in names]).astype(np.float16)
        try:
            lights = tuple(
                Illuminant(str(light["name"]), SpectralGrid(light["wavelengths_nm"]), light["values"])
                for light in about["lights"]
            )
            return SpectralTexture(weights, np.array(about["spectra"], dtype=np.float64), lights)
        except InvalidInputError as error:
            raise FileFormatError(f"{path}: {error}") from error

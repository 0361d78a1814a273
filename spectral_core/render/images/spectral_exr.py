# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures with spectra in one EXR, in the published layout of Fichet, Pacanowski and Wilkie 2021.

"An OpenEXR layout for spectral images", JCGT 10(3): one channel per wavelength, ``S0.550,000000nm``, beside R, G, B and
A for programs without support of spectra.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from spectral_core.errors import FileFormatError, InvalidInputError
from spectral_core.files.exr import openexr, read_exr, write_exr
from spectral_core.render.result import RenderResult

LAYOUT = {"spectralLayoutVersion": "1.0", "emissiveUnits": "W.m^-2.sr^-1.nm^-1"}
_CHANNEL = re.compile(r"S0\.(\d+,?\d*|,\d+)([eE][+-]?\d+)?([num]?)m")
"""A channel of radiance; the layout allows other units of length, exponents and no fraction: ``S0.0,55um``."""
_NM_PER_PREFIX = {"n": 1.0, "u": 1e3, "m": 1e6, "": 1e9}


def spectral_channel(wavelength_nm: float) -> str:
    """Name of the channel of unpolarized radiance at a wavelength."""
    return f"S0.{wavelength_nm:.6f}".replace(".", ",").replace("S0,", "S0.") + "nm"


def write_spectral_exr(path: str | Path, result: RenderResult, pixel_aspect: float = 1.0) -> Path:
    """Write a render that measured bands; returns ``path``.

    ``pixel_aspect``: width of a pixel over its height. The bands' names must be their wavelengths in nm, as in
    ``Bands.uniform``. Raises InvalidInputError for a render without bands, MissingDependencyError without OpenEXR.
    """
    if result.bands is None or result.band_pixels is None:
        raise InvalidInputError("this render measured no spectral bands; pass bands=Bands.uniform(...) when rendering")
    module = openexr()
    try:
        wavelengths = [float(name) for name in result.bands.names]
    except ValueError as error:
        raise InvalidInputError(f"spectral bands are named by their wavelength in nm; {error}") from error
    planes = {name: result.pixels[..., k] for k, name in enumerate("RGBA")}
    planes |= {spectral_channel(w): result.band_pixels[..., k] for k, w in enumerate(wavelengths)}
    # EXR's first row is the top one
    pixels = {name: np.ascontiguousarray(plane[::-1], dtype=np.float32) for name, plane in planes.items()}
    header = {"type": module.scanlineimage, "compression": module.ZIP_COMPRESSION, **LAYOUT, **result.header}
    header["pixelAspectRatio"] = float(pixel_aspect)
    write_exr(path, module.File(header, pixels))
    return Path(path)


def read_spectral_exr(path: str | Path) -> tuple[NDArray[np.float64], NDArray[np.float32]]:
    """Wavelengths (n,) in nm, ascending, and radiance (height, width, n), row 0 at the bottom, of a spectral EXR.

    Raises FileFormatError for a file that cannot be read or has no spectral channel.
    """
    channels = read_exr(path)[0].channels
    found: dict[float, str] = {}
    for name in channels:
        if match := _CHANNEL.fullmatch(name):
            number, exponent, prefix = match.groups(default="")
            nm = round(float(number.replace(",", ".") + exponent) * _NM_PER_PREFIX[prefix], 6)
            if nm in found:
                raise FileFormatError(f"{path} has two channels of {nm:g} nm, {found[nm]} and {name}; expected one")
            found[nm] = name
    if not found:
        raise FileFormatError(
            f"{path} has no spectral channel such as S0.550,000000nm; its channels: {', '.join(channels)}"
        )
    wavelengths = sorted(found)
    planes = [channels[found[wavelength]].pixels[::-1] for wavelength in wavelengths]
    return np.array(wavelengths), np.stack(planes, axis=-1).astype(np.float32)

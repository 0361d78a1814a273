# SPDX-License-Identifier: GPL-3.0-or-later
"""Denoise finished pictures with Intel Open Image Denoise (the optional package ``pyoidn``).

The filter expects numbers above 0, but saturated colors have negative sRGB components: such a picture is filtered as
XYZ, each component divided by its mean. A single channel, such as a spectral band, is filtered as a gray picture.
"""

from __future__ import annotations

import importlib
import importlib.util
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from spectral_core.checks import require_finite
from spectral_core.errors import InvalidInputError, MissingDependencyError, RenderError, this_python
from spectral_core.spectra.color import linear_rgb_from_xyz, xyz_from_linear_rgb

Pixels = NDArray[np.float32]
Quality = Literal["high", "fast"]
"""Of the filter. ``fast`` takes about half of the time and leaves more noise."""

PACKAGE = "pyoidn"


@dataclass(frozen=True, slots=True, eq=False)
class Guides:
    """Albedo and normals at the first hit, by which the filter distinguishes edges from noise.

    ``albedo``: (height, width, 3) in [0, 1]. ``normal``: (height, width, 3), each component in [-1, 1].
    """

    albedo: Pixels
    normal: Pixels


def is_installed() -> bool:
    """True if a denoiser is installed; does not load it."""
    try:
        return importlib.util.find_spec(PACKAGE) is not None
    except ValueError:  # some other module under this name in sys.modules
        return False


def how_to_install() -> str:
    """One sentence: the missing package, its size and how to install it."""
    return (
        f"denoising needs the Python package {PACKAGE!r} (Open Image Denoise: 88 MB to download, 171 MB on disk), "
        f"which is not installed; install it with: {this_python()} -m pip install {PACKAGE}, or switch denoising off"
    )


def require_denoiser() -> Any:
    """The package ``pyoidn``. Raises MissingDependencyError if it is absent or cannot be loaded."""
    try:
        return importlib.import_module(PACKAGE)
    except (ImportError, OSError, RuntimeError) as error:  # the last two: of the shared library of the package
        if isinstance(error, ModuleNotFoundError) and error.name == PACKAGE:
            raise MissingDependencyError(how_to_install()) from error
        raise MissingDependencyError(f"the package {PACKAGE!r} is installed and does not load: {error}") from error


def denoiser_name() -> str:
    """Name and version, for a file's header."""
    try:
        return f"Open Image Denoise ({PACKAGE} {version(PACKAGE)})"
    except PackageNotFoundError:
        return f"Open Image Denoise ({PACKAGE})"


def denoise(pixels: Pixels, guides: Guides | None = None, *, quality: Quality = "high") -> Pixels:
    """Denoise one picture; a fourth channel, its coverage, stays as it is.

    Parameters
    ----------
    pixels
        (height, width, 3 or 4) linear sRGB, any exposure; premultiplied where there is coverage.
    guides
        Albedo and normals of the same size; None for none.
    quality
        Of the filter.

    Raises
    ------
    InvalidInputError : a wrong shape, NaN or infinity. MissingDependencyError : there is no denoiser.
    RenderError : the denoiser failed.
    """
    if pixels.ndim != 3 or pixels.shape[2] not in (3, 4) or not pixels.size:
        raise InvalidInputError(
            f"the picture to denoise has shape {pixels.shape}; expected (height, width, 3), or 4 with coverage"
        )
    require_finite("the picture to denoise", pixels)
    result = np.array(pixels, dtype=np.float32)
    color = pixels[..., :3]
    if color.min() < 0.0:
        xyz = xyz_from_linear_rgb(color)
        mean = xyz.mean(axis=(0, 1))
        scale = np.where(mean > 0.0, mean, 1.0)  # the filter was trained on pictures that are nearly gray
        result[..., :3] = linear_rgb_from_xyz(_filtered(xyz / scale, guides, quality) * scale)
    else:
        result[..., :3] = _filtered(color, guides, quality)
    return result


def denoise_planes(planes: Pixels, guides: Guides | None = None) -> Pixels:
    """Denoise (height, width, n) numbers of at least 0, such as spectral bands: each plane by itself, with equal
    settings.

    Raises the same errors as ``denoise``.
    """
    if planes.ndim != 3 or not planes.size:
        raise InvalidInputError(f"the planes to denoise have shape {planes.shape}; expected (height, width, n)")
    require_finite("the planes to denoise", planes)
    result = np.empty(planes.shape, np.float32)
    for k in range(planes.shape[2]):
        result[..., k] = _filtered(np.repeat(planes[..., k : k + 1], 3, axis=2), guides).mean(axis=2)
    return result


def _filtered(color: NDArray[Any], guides: Guides | None, quality: Quality = "high") -> Pixels:
    """Output of the filter for (height, width, 3) finite numbers."""
    module = require_denoiser()
    extra: dict[str, Pixels] = {}
    if guides is not None:
        for name, image in (("albedo", guides.albedo), ("normal", guides.normal)):
            if image.shape != color.shape:
                raise InvalidInputError(f"the {name} guide has shape {image.shape}; expected {color.shape}")
            require_finite(f"the {name} guide", image)
            extra[name] = np.ascontiguousarray(image, dtype=np.float32)
    try:
        made = module.denoise(np.ascontiguousarray(color, dtype=np.float32), **extra, hdr=True, quality=quality)
    except (RuntimeError, TypeError, ValueError) as error:
        raise RenderError(f"Open Image Denoise failed: {error}") from error
    require_finite("the denoised picture", made)
    return np.asarray(made, dtype=np.float32)

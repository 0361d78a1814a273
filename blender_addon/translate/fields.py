# SPDX-License-Identifier: GPL-3.0-or-later
"""What a node tree's socket evaluates to, before it is taken as a color or as a number, and arithmetic on it.

A field is a number, a color (3,), an image, a spectrum, or two of them mixed. Arithmetic on an image is done on its
pixels, so that what an artist built from math nodes reaches the renderer exactly.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.scene import Color, ImageTexture, MixedPaint, Paint, Scalar
from spectral_core.spectra.catalogue import illuminant
from spectral_core.spectra.color import LUMINANCE_FROM_RGB, linear_rgb_from_xyz
from spectral_core.spectra.observer import xyz_of
from spectral_core.spectra.spectrum import Illuminant, Spectrum

from .images import linear_pixels, with_pixels

Array = NDArray[Any]
LUMINANCE = LUMINANCE_FROM_RGB
"""Of linear sRGB (IEC 61966-2-1): what Blender takes where a color meets a number socket."""


@dataclass(frozen=True, eq=False)
class Mixed:
    """Two fields mixed by a number or an image."""

    factor: Scalar
    first: Field
    second: Field


Field = float | Array | ImageTexture | Spectrum | Mixed


def paint_of(field: Field) -> Paint:
    """The field as a color."""
    if isinstance(field, Mixed):
        return MixedPaint(field.factor, paint_of(field.first), paint_of(field.second))
    if isinstance(field, Spectrum):
        return field
    if isinstance(field, ImageTexture):
        return field if field.color_space != "raw" else _retagged(field)
    return Color(np.broadcast_to(np.asarray(field, dtype=np.float64), (3,)))


def scalar_of(field: Field) -> Scalar:
    """The field as a number: of colors their luminance, of two mixed images their mix where they lie alike."""
    if isinstance(field, Mixed):
        parts = [scalar_of(field.factor), scalar_of(field.first), scalar_of(field.second)]
        mixed = combine(lambda f, a, b: (1 - f) * a + f * b, parts)
        return scalar_of(mixed)
    if isinstance(field, Spectrum):
        return float(LUMINANCE @ mean_color(field))
    if isinstance(field, ImageTexture):
        pixels = linear_pixels(field)
        if pixels.shape[2] == 1:
            return field if field.color_space != "srgb" else with_pixels(field, pixels, field.name)
        return with_pixels(field, pixels @ LUMINANCE[:, None].astype(np.float32), f"{field.name} (gray)")
    values = np.asarray(field, dtype=np.float64)
    return float(values) if values.ndim == 0 else float(LUMINANCE @ values)


def combine(function: Callable[..., Any], fields: Sequence[Field]) -> Field:
    """``function`` of fields, elementwise over the colors (..., 3) or numbers (..., 1) that they hold.

    Images that do not lie alike on the mesh as the first one (other size or mapping) take part with their mean.
    """
    fields = [_mean_of_mixed(field) for field in fields]
    base = next((field for field in fields if isinstance(field, ImageTexture)), None)
    if base is None:
        constants = [np.atleast_1d(_constant(field)) for field in fields]
        result = np.asarray(function(*constants), dtype=np.float64)
        return float(result[0]) if result.shape == (1,) else result
    operands = [
        linear_pixels(f) if isinstance(f, ImageTexture) and _alike(f, base) else np.atleast_1d(_constant(f))
        for f in fields
    ]
    result = np.asarray(function(*operands), dtype=np.float32)
    finite = np.where(np.isfinite(result), result, np.float32(0))
    return with_pixels(base, np.broadcast_to(finite, (*base.pixels.shape[:2], result.shape[-1])), base.name)


def gray_of(field: Field) -> Field:
    """The field as a socket for numbers takes it: of colors their luminance."""
    return combine(lambda v: v if v.shape[-1] == 1 else (v @ LUMINANCE)[..., None], [field])


def needs_mean(fields: Sequence[Field]) -> bool:
    """Whether combine() would take a mean where the artist has a picture."""
    images = [field for field in fields if isinstance(field, ImageTexture)]
    mixed = any(isinstance(field, Mixed) and not isinstance(_mean_of_mixed(field), ImageTexture) for field in fields)
    return mixed or any(not _alike(image, images[0]) for image in images)


def _mean_of_mixed(field: Field) -> Field:
    if not isinstance(field, Mixed):
        return field
    return combine(lambda f, a, b: (1 - f) * a + f * b, [field.factor, field.first, field.second])


def _alike(field: Field, base: ImageTexture) -> bool:
    return isinstance(field, ImageTexture) and (
        field.pixels.shape[:2] == base.pixels.shape[:2]
        and np.array_equal(field.uv_from_mesh_uv, base.uv_from_mesh_uv)
        and field.extension == base.extension
    )


def _constant(field: Field) -> Array:
    if isinstance(field, (float, int)):
        return np.asarray(float(field))
    return mean_color(field)


def mean_color(field: Field) -> Array:
    """Mean color (3,) or number (1,) of a field, linear sRGB."""
    if isinstance(field, ImageTexture):
        return np.asarray(linear_pixels(field).mean(axis=(0, 1), dtype=np.float64))
    if isinstance(field, Spectrum):
        return color_of_spectrum(field)
    if isinstance(field, Mixed):
        return mean_color(_mean_of_mixed(field))
    return np.atleast_1d(np.asarray(field, dtype=np.float64))


def color_of_spectrum(spectrum: Spectrum) -> Array:
    """Linear sRGB (3,) of a reflectance under D65, or of an illuminant at the luminance of white."""
    light, surface = (spectrum, None) if isinstance(spectrum, Illuminant) else (illuminant("D65"), spectrum)
    white = xyz_of(light)[1]
    return np.asarray(linear_rgb_from_xyz(xyz_of(light, surface) / white)) if white > 0 else np.zeros(3)


def _retagged(field: ImageTexture) -> ImageTexture:
    """Numbers used as a color are linear RGB."""
    return replace(field, color_space="linear")

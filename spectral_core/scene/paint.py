# SPDX-License-Identifier: GPL-3.0-or-later
"""Values of a socket: a color, a spectrum, an image, or a mix of two of them; and limits of numbers."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from spectral_core.checks import (
    as_array,
    frozen_array,
    read_only_when_copied,
    require_declared,
    require_finite,
    require_range,
)
from spectral_core.errors import InvalidInputError
from spectral_core.scene.shading.program import Computed
from spectral_core.scene.spectral_image import SpectralImage
from spectral_core.spectra.color import linear_from_display_rgb
from spectral_core.spectra.spectrum import Spectrum

LARGEST = 1e38
"""Largest number of a closure; larger ones have no precision left in 32 bits."""
IOR = (1e-3, 1000.0)
"""Range of the index of refraction of a dielectric."""
FILM_THICKNESS_NM = (0.0, 1e6)
"""Range of the thickness of a thin film."""
_LIMITS = {
    "ior": IOR,
    "coat_ior": IOR,
    "thin_film_ior": IOR,
    "thin_film_thickness": FILM_THICKNESS_NM,
}

_THREE = "tuple[float, float, float]"
"""Beginning of the type of a field with a number for each of red, green and blue."""


def require_paint(name: str, value: object) -> None:
    """Raise InvalidInputError for numbers or a name in place of a color, a spectrum or an image."""
    if isinstance(value, (int, float, np.number)):
        raise InvalidInputError(
            f"{name} is the number {value}; expected a color, a spectrum or an image: gray({value}) is a color of "
            "equal channels"
        )
    if isinstance(value, (str, tuple, list, np.ndarray)):
        raise InvalidInputError(
            f"{name} is {str(value)[:40]}, of type {type(value).__name__}; expected a color, a spectrum or an image, "
            "such as Color((0.8, 0.2, 0.2))"
        )


class Numbers:
    """Closures and media: plain numbers in them are finite, no number stands for a color, and names are known."""

    __slots__ = ()

    def __post_init__(self) -> None:
        """Raise InvalidInputError that names the first number that is NaN, infinite, outside the range of an index, or
        in the place of a color; UnknownNameError for a name that is none of a field's.
        """
        names: tuple[str, ...] = type(self).__slots__
        fields: dict[str, str] = type(self).__annotations__
        for name in names:
            value = getattr(self, name)
            if str(fields.get(name, "")).startswith("Paint"):
                require_paint(f"{type(self).__name__} {name.replace('_', ' ')}", value)
            if isinstance(value, (int, float, np.number)):
                least, most = _LIMITS.get(name, (-LARGEST, LARGEST))
                require_range(f"{type(self).__name__} {name.replace('_', ' ')}", float(value), least, most)
            elif isinstance(value, Spectrum) and name in _LIMITS:
                for number in (value.values.min(), value.values.max()):
                    require_range(f"{type(self).__name__} {name.replace('_', ' ')}", float(number), *_LIMITS[name])
            elif str(fields.get(name, "")).startswith(_THREE) and not isinstance(value, Computed):
                frozen_array(f"{type(self).__name__} {name.replace('_', ' ')}", value, (3,))
        require_declared(self)


@read_only_when_copied
@dataclass(frozen=True, slots=True, eq=False)
class Color:
    """Linear sRGB, shape (3,). As a reflectance it is upsampled to a smooth spectrum; as a light it tints D65."""

    linear_rgb: NDArray[np.float64]

    def __post_init__(self) -> None:
        object.__setattr__(self, "linear_rgb", frozen_array("linear_rgb", self.linear_rgb, (3,)))


MOST_TEXELS = 1 << 16


def some_texels(pixels: NDArray[Any]) -> NDArray[Any]:
    """(n, channels) of an image (height, width, channels), evenly spread: all of them, or ``MOST_TEXELS`` at most."""
    height, width, channels = pixels.shape
    step = -(-height * width // MOST_TEXELS)
    while np.gcd(step, width) > 1:  # rows begin in different columns
        step += 1
    return pixels.reshape(-1, channels)[::step]


def some_colors(pixels: NDArray[Any], color_space: str) -> NDArray[np.float64]:
    """(n, 3) of an image in linear sRGB, evenly spread."""
    rows = some_texels(pixels[..., :3]).astype(np.float64) / (255 if pixels.dtype == np.uint8 else 1)
    rows = linear_from_display_rgb(rows) if color_space == "srgb" else rows
    return np.repeat(rows, 3, axis=1) if rows.shape[1] == 1 else rows


@read_only_when_copied
@dataclass(frozen=True, slots=True, eq=False)
class ImageTexture:
    """Pixels over a mesh's UV square, row 0 at v = 0 (bottom, as in Blender).

    ``pixels``: (height, width, channels), 1, 3 or 4 channels, float32 or uint8. ``color_space``: ``"srgb"`` (display
    encoded colors), ``"linear"`` (linear sRGB) or ``"raw"`` (numbers, e.g. a mask). ``uv_from_mesh_uv``: (3, 3) affine.
    """

    name: str
    pixels: NDArray[Any]
    color_space: Literal["srgb", "linear", "raw"] = "srgb"
    extension: Literal["repeat", "clip", "extend", "mirror"] = "repeat"
    interpolation: Literal["linear", "nearest", "cubic"] = "linear"
    uv_from_mesh_uv: NDArray[np.float64] = field(default_factory=lambda: np.eye(3))

    def __post_init__(self) -> None:
        pixels = as_array(f"image {self.name!r} has pixels of", self.pixels, None)
        if pixels.ndim != 3 or pixels.shape[2] not in (1, 3, 4) or 0 in pixels.shape:
            raise InvalidInputError(
                f"image {self.name!r} has pixels of shape {pixels.shape}; "
                "expected (height, width, 1, 3 or 4), none of them 0"
            )
        if pixels.dtype not in (np.dtype(np.float32), np.dtype(np.uint8)):
            raise InvalidInputError(f"image {self.name!r} has pixels of type {pixels.dtype}; expected float32 or uint8")
        require_finite(f"image {self.name!r}", pixels)
        require_declared(self)
        object.__setattr__(self, "pixels", pixels)
        object.__setattr__(self, "uv_from_mesh_uv", frozen_array("uv_from_mesh_uv", self.uv_from_mesh_uv, (3, 3)))

    @property
    def shape_key(self) -> tuple[str, str, str, str]:
        """Properties that a kernel depends on: the way in which pixels are read, not their values."""
        return "image", self.color_space, self.extension, self.interpolation


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class DrawnPattern(ImageTexture):
    """An environment drawn from a pattern. Rays from the camera, from mirrors and through glass show the pattern
    itself, which may be finer than the pixels; all other light comes from the pixels.

    ``pattern``: radiance as linear sRGB; its program may read the direction in the environment's axes as ``position``,
    and the opposite direction as ``incoming`` and ``normal``. ``tells_rays``: it depends on the type of ray, so rays
    from all glossy and transmitting lobes show it.
    """

    pattern: Computed
    tells_rays: bool = False

    @property
    def is_only_met(self) -> bool:
        """True if its light is not sampled: for each type of ray it is even. As in Cycles, only rays that meet it,
        which have a type, count.
        """
        inputs = [each for each in self.pattern.program.instructions if each.operation.endswith("_input")]
        return self.tells_rays and all(str(each.settings[0]).startswith("ray:") for each in inputs)


@dataclass(frozen=True, slots=True, eq=False)
class MixedPaint:
    """``(1 - factor) · first + factor · second``, the factor a number in [0, 1] or an image."""

    factor: Scalar
    first: Paint
    second: Paint


Paint = Color | Spectrum | ImageTexture | SpectralImage | MixedPaint | Computed
"""A color that may vary with wavelength, with position, or with both."""
Scalar = float | ImageTexture | Computed
"""A number, constant or varying with position (the mean of an image's color channels)."""


@dataclass(frozen=True, slots=True)
class Weight:
    """A product: ``constant · Π value · Π (1 - value)`` over the ``varying`` values, each clipped to [0, 1]; those that
    are subtracted from 1 are paired with True.
    """

    varying: tuple[tuple[Scalar, bool], ...] = ()
    constant: float = 1.0

    def times(self, value: Scalar, *, complement: bool = False) -> Weight:
        """This weight times ``value`` or ``1 - value``, clipped to [0, 1]."""
        if not isinstance(value, (int, float)):
            return Weight((*self.varying, (value, complement)), self.constant)
        held = min(max(float(value), 0.0), 1.0)
        return Weight(self.varying, self.constant * (1 - held if complement else held))

    def joined(self, other: Weight) -> Weight:
        """The product of two weights."""
        return Weight((*self.varying, *other.varying), self.constant * other.constant)


WHOLE = Weight()
"""The weight 1."""


def gray(value: float) -> Color:
    """The color that is ``value`` in all three channels."""
    return Color(np.full(3, require_range("gray", value, -LARGEST, LARGEST)))

# SPDX-License-Identifier: GPL-3.0-or-later
"""Several pictures in one surface: from one picture per light to the weights of K basis spectra at every texel."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from spectral_core.checks import as_array, frozen_array, read_only_when_copied, require_finite, require_range
from spectral_core.errors import InvalidInputError, UnknownNameError, counted
from spectral_core.palette.given import require_each, sequence_of
from spectral_core.palette.texture.basis import MOST_SPECTRA, TextureBasis, design_basis
from spectral_core.palette.texture.fit import TILE, Fitter, over_tiles, require_importance
from spectral_core.palette.texture.loss import PictureLoss, picture_losses, texel_delta_e
from spectral_core.palette.texture.reach import TEXTURE_GRID, corner_colors, reachable_scales, stimulus_matrix
from spectral_core.spectra.color import linear_from_display_rgb
from spectral_core.spectra.spectrum import Illuminant

Array = NDArray[np.float64]
Mapping = Literal["least_delta_e", "uniform_contrast"]
MOST_FLOOR = 0.5
"""Largest linear gray that black may become."""
_BITS_OF_ONE = int(np.float16(1).view(np.uint16))


@dataclass(frozen=True, slots=True, eq=False)
class Picture:
    """The appearance of a surface under one light. ``pixels``: (H, W, 3), top row first.

    Integer pixels are display values (sRGB) of 8 or 16 bits; floating-point pixels are linear sRGB from 0 to 1.
    """

    name: str
    pixels: NDArray[np.generic]

    def __post_init__(self) -> None:
        pixels = as_array(f"picture {self.name!r} has pixels of", self.pixels, None)
        if pixels.ndim != 3 or pixels.shape[2] != 3 or 0 in pixels.shape:
            raise InvalidInputError(f"picture {self.name!r} has shape {pixels.shape}; expected (height, width, 3)")
        if pixels.dtype not in (np.uint8, np.uint16) and pixels.dtype.kind != "f":
            raise InvalidInputError(
                f"picture {self.name!r} has pixels of type {pixels.dtype}; expected 8 or 16 bit integers or floats"
            )
        require_finite(f"picture {self.name!r}", pixels)
        if pixels.dtype.kind == "f" and (pixels.min() < 0 or pixels.max() > 1):
            raise InvalidInputError(
                f"picture {self.name!r} spans {pixels.min():g} to {pixels.max():g}; a surface shows linear values from "
                "0 to 1, so scale or tone-map the picture first"
            )
        object.__setattr__(self, "pixels", pixels)

    def linear_rows(self, first: int, last: int, floor: float = 0.0, slope: float = 1.0) -> NDArray[np.float32]:
        """``floor`` + ``slope`` x linear sRGB (3, m) of the texels in rows ``first`` to ``last``, float32."""
        rows = self.pixels[first:last].reshape(-1, 3).T
        if rows.dtype.kind == "f":
            linear = np.ascontiguousarray(rows, dtype=np.float32)
            return linear if (floor, slope) == (0.0, 1.0) else linear * np.float32(slope) + np.float32(floor)
        return np.ascontiguousarray(_mapped_values(255 if rows.dtype == np.uint8 else 65535, floor, slope)[rows])


@lru_cache(maxsize=8)
def _mapped_values(top: int, floor: float, slope: float) -> NDArray[np.float32]:
    """``floor`` + ``slope`` x linear value of each display value from 0 to ``top``."""
    return (floor + slope * linear_from_display_rgb(np.arange(top + 1) / top)).astype(np.float32)


@read_only_when_copied
@dataclass(frozen=True, slots=True, eq=False)
class SpectralTexture:
    """A texture of reflectances: ``weights`` (K, H, W) float16 of ``spectra`` (K, n).

    The spectra are at least 0 and sum to 1 at each wavelength of ``TEXTURE_GRID``, and the weights lie in [0, 1], so
    every reflectance does, under any filter of the texture. ``lights``: the lights of the pictures.
    """

    weights: NDArray[np.float16]
    spectra: Array
    lights: tuple[Illuminant, ...]

    def __post_init__(self) -> None:
        weights = as_array("weights of a texture are of", self.weights, np.float16)
        if weights.ndim != 3:
            raise InvalidInputError(f"weights have shape {weights.shape}; expected (spectra, height, width)")
        weights.setflags(write=False)
        object.__setattr__(self, "weights", weights)
        object.__setattr__(self, "spectra", frozen_array("spectra", self.spectra, (len(weights), TEXTURE_GRID.size)))
        # The bits of a half float in [0, 1] are at most those of 1. Those of -0, and of negative, infinite and NaN
        # numbers, are larger; -0 is looked at again.
        is_outside = int(weights.view(np.uint16).max(initial=0)) > _BITS_OF_ONE
        is_outside = is_outside and not (weights.min() >= 0 and weights.max() <= 1)
        sums = self.spectra.sum(axis=0)
        if is_outside or self.spectra.min() < -1e-9 or np.abs(sums - 1).max() > 1e-6:
            raise InvalidInputError(
                f"{'weights are' if is_outside else 'no weight is'} outside [0, 1] and the spectra sum to "
                f"{sums.min():g} … {sums.max():g}; weights must lie in [0, 1], and spectra must be non-negative with "
                "sum 1 at each wavelength"
            )

    def reflectances(self, row: int, column: int) -> Array:
        """Reflectance (n,) of one texel on ``TEXTURE_GRID``."""
        return np.asarray(self.weights[:, row, column].astype(np.float64) @ self.spectra)

    def picture(self, light: Illuminant) -> NDArray[np.float32]:
        """Linear sRGB (H, W, 3) of the texture under ``light``, relative to the light's white."""
        return self.rows(light, 0, self.weights.shape[1])

    def rows(self, light: Illuminant, first: int, last: int) -> NDArray[np.float32]:
        """Linear sRGB (last - first, W, 3) of the rows ``first`` to ``last`` under ``light``."""
        color_from_weights = (stimulus_matrix([light]) @ self.spectra.T).astype(np.float32)
        band = self.weights[:, first:last].astype(np.float32)
        return np.einsum("ck,khw->hwc", color_from_weights, band, optimize=True)


@dataclass(frozen=True, slots=True, eq=False)
class TextureDesign:
    """A texture and its errors: ``losses`` per picture, ``floor`` and ``slope`` of the gamut mapping.

    The target of every linear color v of the pictures is floor + slope v. ``stated_slope``: slope that every
    combination of pictures reaches exactly at this floor. ``compressed``: share of texels whose colors the basis cannot
    show, so that they have an error in ``losses``.
    """

    texture: SpectralTexture
    basis: TextureBasis
    floor: float
    slope: float
    stated_slope: float
    compressed: float
    losses: tuple[PictureLoss, ...]
    seconds: float


def design_texture(
    pictures: Sequence[Picture],
    lights: Sequence[Illuminant],
    *,
    floor: float = 0.02,
    slope: float | None = None,
    mapping: Mapping = "least_delta_e",
    count: int | None = None,
    importance: Sequence[float] | None = None,
    basis: TextureBasis | None = None,
    progress: Callable[[float], None] | None = None,
) -> TextureDesign:
    """Find the texture that shows picture i under light i.

    Parameters
    ----------
    pictures : L pictures of one size, one per light, 1 or 2.
    lights : L illuminants, for example of ``design_lights``.
    floor : linear gray that black becomes, 0 to 0.5: a reflectance that is black under one light is dark under all.
    slope : contrast kept; by default 0.97 - floor, or with ``uniform_contrast`` what every texel can show exactly.
    mapping : ``"least_delta_e"`` shows the nearest color where a texel's colors cannot all be reached;
        ``"uniform_contrast"`` lowers the contrast of all texels until each is exact.
    count : basis spectra K, 3L to 8; by default 6 for two pictures and 3 for one.
    importance : weight of each picture's color differences, positive; by default equal.
    basis : a basis designed before for the same lights; designed here where None.
    progress : called with the share done, from 0 to 1.

    Raises
    ------
    InvalidInputError : sizes differ, counts differ, a number is out of its range, or the mapping is unknown.
    """
    started = time.perf_counter()
    pictures, lights = sequence_of("pictures", pictures), sequence_of("lights", lights)
    require_each("pictures", pictures, Picture, "a Picture")
    _require_alike(pictures, lights)
    require_range("floor", floor, 0.0, MOST_FLOOR)
    if mapping not in get_args(Mapping):
        raise UnknownNameError.among("mapping", str(mapping), get_args(Mapping))
    # All is checked before the basis is designed, which takes seconds.
    importance = [1.0] * len(lights) if importance is None else frozen_array("importance", importance, (None,)).tolist()
    weighed = require_importance(tuple(importance), len(lights))
    if mapping == "least_delta_e":
        slope = require_range("slope", 0.97 - floor if slope is None else slope, 0.0, round(1.0 - floor, 12))
    matrix = stimulus_matrix(lights)
    if basis is None:
        fitting = min(MOST_SPECTRA, 3 * len(lights))
        basis = design_basis(matrix, fitting if count is None else count, floor=max(floor, 0.01))
    color_from_weights = matrix @ basis.spectra.T
    stated = float(reachable_scales(color_from_weights, corner_colors(len(lights)), floor).scales.min())
    kept = stated if mapping == "uniform_contrast" or slope is None else slope
    corners = _corner_weights(color_from_weights, floor, kept) if kept <= stated else None
    fitter = Fitter(color_from_weights, weighed, corners)
    weights, delta_e, compressed = _fit_tiles(pictures, fitter, (floor, kept), progress)
    texture = SpectralTexture(weights, basis.spectra, tuple(lights))
    losses = picture_losses(pictures, texture, delta_e, (floor, kept))
    size = weights[0].size
    return TextureDesign(
        texture, basis, floor, kept, stated, compressed / size, losses, time.perf_counter() - started
    )  # fmt: skip


def _require_alike(pictures: Sequence[Picture], lights: Sequence[Illuminant]) -> None:
    if not 1 <= len(pictures) <= 2 or len(lights) != len(pictures):
        raise InvalidInputError(
            f"{counted(len(pictures), 'picture')} for {counted(len(lights), 'light')}; give one or two pictures "
            "and a light for each"
        )
    require_one_size(pictures)


def require_one_size(pictures: Sequence[Picture]) -> None:
    """Raise InvalidInputError for pictures that differ in width or height."""
    sizes = {picture.pixels.shape[:2] for picture in pictures}
    if len(sizes) > 1:
        named = ", ".join(f"{p.name!r} {p.pixels.shape[1]}×{p.pixels.shape[0]}" for p in pictures)
        raise InvalidInputError(f"the pictures differ in size: {named}; scale them to one size")


def _corner_weights(color_from_weights: Array, floor: float, slope: float) -> Array:
    """Weights (8^L, K) within [0, 1] of every corner of the mapped display colors, all of which can be reached."""
    corners = np.concatenate([np.zeros((1, len(color_from_weights))), corner_colors(len(color_from_weights) // 3)])
    farthest = reachable_scales(color_from_weights, corners[1:], floor)
    gray = np.full((1, color_from_weights.shape[1]), floor)
    # A corner that can be reached beyond its target lies between the gray of the floor and its farthest color.
    share = np.minimum(slope / np.maximum(farthest.scales, 1e-12), 1.0)[:, None]
    return np.concatenate([gray, gray + share * (farthest.reflectances - gray)])


def _fit_tiles(
    pictures: Sequence[Picture],
    fitter: Fitter,
    mapping: tuple[float, float],
    progress: Callable[[float], None] | None,
) -> tuple[NDArray[np.float16], NDArray[np.float16], int]:
    """Weights (K, H, W), color differences (L, H, W), and the count of compressed texels, several tiles at a time."""
    floor, slope = mapping
    height, width = pictures[0].pixels.shape[:2]
    weights = np.empty((fitter.color_from_weights.shape[1], height, width), dtype=np.float16)
    delta_e = np.zeros((len(pictures), height, width), dtype=np.float16)

    def work(tile: slice) -> int:
        wanted = np.concatenate([picture.linear_rows(tile.start, tile.stop, floor, slope) for picture in pictures])
        solved, outside = fitter.solve_tile(wanted)
        half_from_unit(solved, weights[:, tile].reshape(len(weights), -1))
        if not outside.size:
            return 0
        found = texel_delta_e(wanted[:, outside], solved[:, outside], fitter.color_from_weights)
        delta_e[:, tile].reshape(len(pictures), -1)[:, outside] = found
        # With more spectra than colors, the search finds many of them an exact answer.
        return int(np.count_nonzero(found.max(axis=0)))

    rows = max(1, TILE // width)
    tiles = [slice(first, min(first + rows, height)) for first in range(0, height, rows)]
    return weights, delta_e, sum(over_tiles(work, tiles, progress))


def half_from_unit(values: NDArray[np.float32], out: NDArray[np.float16]) -> None:
    """Store float32 numbers from 0 to 1 as half floats, rounded to the nearest: NumPy's own cast takes 4 times as long.

    The exponent of a half float begins 112 powers of two higher than that of a float; 13 bits of the fraction are
    dropped.
    """
    bits = (np.abs(values) * np.float32(2.0**-112)).view(np.uint32)  # abs: -0 becomes 0
    bits += 0x1000
    bits >>= 13
    out.view(np.uint16)[...] = bits

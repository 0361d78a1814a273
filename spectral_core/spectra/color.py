# SPDX-License-Identifier: GPL-3.0-or-later
"""Tristimulus values as display colors (linear sRGB) and as perceived differences (CIELAB, ΔE).

Colors are arrays (..., 3). XYZ and linear RGB are relative: 1 is the perfect white. The white of CIELAB is an
argument; its default is the white of the sRGB matrix, so that linear RGB (1, 1, 1) is L* = 100, a* = b* = 0.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spectral_core.checks import frozen_array, real_numbers
from spectral_core.errors import InvalidInputError

Array = NDArray[np.float64]

RGB_FROM_XYZ: Array = np.array([[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.2040, 1.0570]])
"""IEC 61966-2-1, to the digits that the standard prints (and Blender, OpenColorIO and colour-science agree with)."""
XYZ_FROM_RGB: Array = np.linalg.inv(RGB_FROM_XYZ)
WHITE_XYZ: Array = XYZ_FROM_RGB @ np.ones(3)
"""XYZ of linear RGB (1, 1, 1): D65."""
for _constant in (RGB_FROM_XYZ, XYZ_FROM_RGB, WHITE_XYZ):
    _constant.setflags(write=False)

LUMINANCE_FROM_RGB: Array = XYZ_FROM_RGB[1]
"""Relative luminance of the three primaries: 0.2126, 0.7152, 0.0722, as the matrix above has them."""

_EPSILON = 216 / 24389  # CIE 15:2018, where CIELAB turns from a cube root into a line
_KAPPA = 24389 / 27
LEAST_SHOWN = 1e-6
"""Size of a combination of colors, relative to the largest, below which a light shows nothing of it."""


def linear_rgb_from_xyz(xyz: ArrayLike) -> Array:
    """Linear sRGB (..., 3) from XYZ (..., 3); outside [0, 1] where the color is outside the display gamut."""
    return real_numbers("XYZ", xyz, 3) @ RGB_FROM_XYZ.T


def xyz_from_linear_rgb(linear_rgb: ArrayLike) -> Array:
    """XYZ (..., 3) from linear sRGB (..., 3)."""
    return real_numbers("linear RGB", linear_rgb, 3) @ XYZ_FROM_RGB.T


def luminance_from_linear_rgb(linear_rgb: ArrayLike) -> Array:
    """Relative luminance Y (...) of linear sRGB (..., 3); 1 is the perfect white."""
    luminance: Array = real_numbers("linear RGB", linear_rgb, 3) @ LUMINANCE_FROM_RGB
    return luminance


def display_rgb_from_linear(linear_rgb: ArrayLike) -> Array:
    """sRGB transfer curve (IEC 61966-2-1), odd about zero so that colors outside the gamut are kept."""
    linear = real_numbers("linear RGB", linear_rgb)
    size = np.abs(linear)
    curved = 1.055 * np.power(np.maximum(size, 0.0031308), 1 / 2.4) - 0.055
    return np.sign(linear) * np.where(size <= 0.0031308, 12.92 * size, curved)


def display_hex_from_linear(linear_rgb: ArrayLike) -> str:
    """A linear RGB color (3,) as ``#rrggbb``, each channel limited to what a display shows."""
    color = frozen_array("a color", linear_rgb, (3,))
    shown = np.round(255 * np.clip(display_rgb_from_linear(color), 0, 1)).astype(int)
    return "#" + "".join(f"{channel:02x}" for channel in shown)


def linear_from_display_rgb(display_rgb: ArrayLike) -> Array:
    """Inverse of display_rgb_from_linear."""
    display = real_numbers("display RGB", display_rgb)
    size = np.abs(display)
    curved = np.power((np.maximum(size, 0.04045) + 0.055) / 1.055, 2.4)
    return np.sign(display) * np.where(size <= 0.04045, size / 12.92, curved)


def lab_from_xyz(xyz: ArrayLike, white_xyz: ArrayLike = WHITE_XYZ) -> Array:
    """CIELAB (..., 3) of XYZ (..., 3) relative to a white (3,) (CIE 15:2018)."""
    white = real_numbers("the white of CIELAB", white_xyz, 3)
    if np.any(white <= 0):
        raise InvalidInputError(f"the white of CIELAB is {white.tolist()}; all three XYZ must be positive")
    ratio = real_numbers("XYZ", xyz, 3) / white
    f = np.where(ratio > _EPSILON, np.cbrt(ratio), (_KAPPA * ratio + 16) / 116)
    x, y, z = f[..., 0], f[..., 1], f[..., 2]
    return np.stack([116 * y - 16, 500 * (x - y), 200 * (y - z)], axis=-1)


def lab_from_linear_rgb(linear_rgb: ArrayLike) -> Array:
    """CIELAB (..., 3) of linear sRGB (..., 3) under the white of sRGB (D65)."""
    return lab_from_xyz(xyz_from_linear_rgb(linear_rgb))


def lab_jacobian_from_linear_rgb(linear_rgb: ArrayLike) -> Array:
    """d(L*, a*, b*) / d(linear RGB), shape (..., 3, 3), at linear sRGB (..., 3), under the white of sRGB."""
    ratio = xyz_from_linear_rgb(linear_rgb) / WHITE_XYZ
    # in this order NaN stays NaN
    slope = np.where(ratio <= _EPSILON, _KAPPA / 116, np.cbrt(np.maximum(ratio, _EPSILON)) ** -2 / 3)
    lab_from_f = np.array([[0.0, 116, 0], [500, -500, 0], [0, 200, -200]])
    jacobian: Array = np.matmul(lab_from_f, slope[..., None] * (XYZ_FROM_RGB / WHITE_XYZ[:, None]))
    return jacobian


def _pair(lab_1: ArrayLike, lab_2: ArrayLike) -> tuple[Array, Array]:
    """Two arrays of CIELAB colors. Raises InvalidInputError where they do not fit together."""
    one, two = real_numbers("the first CIELAB", lab_1, 3), real_numbers("the second CIELAB", lab_2, 3)
    if one.shape != two.shape:
        try:
            np.broadcast_shapes(one.shape, two.shape)
        except ValueError:
            raise InvalidInputError(
                f"the CIELAB colors to compare have shapes {one.shape} and {two.shape}; expected equal shapes, or one "
                "color beside many"
            ) from None
    return one, two


def delta_e_1976(lab_1: ArrayLike, lab_2: ArrayLike) -> Array:
    """CIE 1976 color difference: Euclidean distance in CIELAB, shape (...)."""
    lab_a, lab_b = _pair(lab_1, lab_2)
    difference = lab_a - lab_b
    return np.sqrt(np.square(difference).sum(axis=-1))


def delta_e_2000(lab_1: ArrayLike, lab_2: ArrayLike) -> Array:
    """CIEDE2000 color difference, shape (...), all weights 1.

    Sharma, Wu and Dalal 2005, "The CIEDE2000 color-difference formula"; equation numbers are theirs.
    """
    lab_a, lab_b = np.broadcast_arrays(*_pair(lab_1, lab_2))
    (lightness_1, a_1, b_1), (lightness_2, a_2, b_2) = np.moveaxis(lab_a, -1, 0), np.moveaxis(lab_b, -1, 0)
    chroma_7 = ((np.hypot(a_1, b_1) + np.hypot(a_2, b_2)) / 2) ** 7
    stretch = 1.5 - 0.5 * np.sqrt(chroma_7 / (chroma_7 + 25.0**7))  # 1 + G, Eq. (4)
    chroma_1, chroma_2 = np.hypot(stretch * a_1, b_1), np.hypot(stretch * a_2, b_2)
    hue_1, hue_2 = np.arctan2(b_1, stretch * a_1) % (2 * np.pi), np.arctan2(b_2, stretch * a_2) % (2 * np.pi)
    gray = chroma_1 * chroma_2 == 0

    hue_step = hue_2 - hue_1  # Eq. (10): the shorter way round, none where one color has no hue
    hue_step = np.where(
        hue_step > np.pi, hue_step - 2 * np.pi, np.where(hue_step < -np.pi, hue_step + 2 * np.pi, hue_step)
    )
    hue_step = np.where(gray, 0.0, hue_step)
    d_lightness, d_chroma = lightness_2 - lightness_1, chroma_2 - chroma_1
    d_hue = 2 * np.sqrt(chroma_1 * chroma_2) * np.sin(hue_step / 2)

    hue_sum = hue_1 + hue_2  # Eq. (14)
    turned = np.where(hue_sum < 2 * np.pi, hue_sum + 2 * np.pi, hue_sum - 2 * np.pi)
    hue = np.where(gray, hue_sum, np.where(np.abs(hue_1 - hue_2) > np.pi, turned, hue_sum) / 2)
    lightness, chroma = (lightness_1 + lightness_2) / 2, (chroma_1 + chroma_2) / 2
    return _ciede2000_norm(lightness, chroma, hue, (d_lightness, d_chroma, d_hue))


def _ciede2000_norm(lightness: Array, chroma: Array, hue: Array, steps: tuple[Array, Array, Array]) -> Array:
    """Weighted length of the step at the mean color: Eqs. (15) to (22)."""
    degrees = np.degrees(hue)
    tint = (
        1
        - 0.17 * np.cos(hue - np.radians(30))
        + 0.24 * np.cos(2 * hue)
        + 0.32 * np.cos(3 * hue + np.radians(6))
        - 0.20 * np.cos(4 * hue - np.radians(63))
    )
    off_gray = (lightness - 50) ** 2
    scale_lightness = 1 + 0.015 * off_gray / np.sqrt(20 + off_gray)
    scale_chroma = 1 + 0.045 * chroma
    scale_hue = 1 + 0.015 * chroma * tint
    blue_angle = np.radians(60) * np.exp(-(((degrees - 275) / 25) ** 2))
    rotation = -2 * np.sqrt(chroma**7 / (chroma**7 + 25.0**7)) * np.sin(blue_angle)
    step_lightness, step_chroma, step_hue = steps[0] / scale_lightness, steps[1] / scale_chroma, steps[2] / scale_hue
    square = step_lightness**2 + step_chroma**2 + step_hue**2 + rotation * step_chroma * step_hue
    return np.sqrt(np.maximum(square, 0.0))


def whitened(matrix: Array) -> Array:
    """Metric (3, 3) under which the rows of a color matrix (3, n) are orthonormal; of a line lamp, whose rows depend on
    each other, those that do not.
    """
    directions, sizes, _ = np.linalg.svd(matrix, full_matrices=False)
    if sizes[0] == 0:  # a light that shows nothing
        return np.eye(3)
    return np.asarray((directions / np.maximum(sizes, LEAST_SHOWN * sizes[0])).T * sizes[0])

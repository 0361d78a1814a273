# SPDX-License-Identifier: GPL-3.0-or-later
"""Conversion from a color to a spectrum, for surfaces, volumes, lights and previews.

A color in [0, 1] becomes the smooth reflectance of Jakob and Hanika 2019, "A Low-Dimensional Function Space for
Efficient Spectral Upsampling": a sigmoid of a quadratic, with the coefficients that Mitsuba's renderer reads for its
colors and images. The table is read from Mitsuba's package without importing it. Where it is not installed, the
coefficients are solved for each color, which differs from the table by the table's own interpolation error.
"""

from __future__ import annotations

from functools import cache, lru_cache
from importlib.machinery import PathFinder
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spectral_core.checks import frozen_array, real_numbers, require_kind
from spectral_core.errors import InvalidInputError
from spectral_core.spectra import catalogue
from spectral_core.spectra.observer import STANDARD, linear_rgb_from_product, normalized, observer
from spectral_core.spectra.spectrum import WAVELENGTHS_NM, Reflectance, SpectralGrid, Spectrum

Array = NDArray[np.float64]

_HEADER_BYTES = 8
OUTSIDE = 1e-3
"""Negative channel, relative to the largest one, from which on a color is outside of sRGB and not rounded there."""
_SOLVE_GRID = SpectralGrid(WAVELENGTHS_NM[::5])
_NEARNESS = 0.1
"""Weight of the difference from the factor of a color of sRGB, relative to that of its second difference."""


def upsampled(linear_rgb: ArrayLike, wavelengths_nm: ArrayLike) -> Array:
    """Give the smooth reflectance (..., n) at n wavelengths (nm) of linear sRGB (..., 3) in [0, 1].

    Raises InvalidInputError for a color outside [0, 1], which no reflectance has.
    """
    nm = real_numbers("wavelengths", wavelengths_nm)
    coefficients = coefficients_from_linear_rgb(linear_rgb)[..., None, :]
    value = (coefficients[..., 0] * nm + coefficients[..., 1]) * nm + coefficients[..., 2]
    # x / sqrt(1 + x²) without overflow: black and white have coefficients at infinity
    finite = np.where(np.isfinite(value), value, 0.0)
    sigmoid = np.where(np.isfinite(value), finite / np.hypot(1.0, finite), np.sign(value))
    reflectance: Array = 0.5 + sigmoid / 2
    return reflectance


def reflectance_from_rgb(linear_rgb: ArrayLike, grid: SpectralGrid, name: str = "upsampled color") -> Reflectance:
    """Give the smooth reflectance of linear sRGB (3,) in [0, 1] on ``grid``."""
    require_kind("the grid", grid, SpectralGrid, "such as SpectralGrid([400, 550, 700])")
    return Reflectance(name, grid, upsampled(frozen_array("linear_rgb", linear_rgb, (3,)), grid.wavelengths_nm))


def coefficients_from_linear_rgb(linear_rgb: ArrayLike) -> Array:
    """Give coefficients (..., 3) of the quadratic in nm, highest power first, of linear sRGB (..., 3) in [0, 1].

    Black has (0, 0, -inf) and white (0, 0, inf). Raises InvalidInputError for a color outside [0, 1].
    """
    rgb = real_numbers("a reflectance color", linear_rgb)
    if rgb.shape[-1:] != (3,) or not np.all((rgb >= 0) & (rgb <= 1)):
        raise InvalidInputError(
            f"a reflectance color of shape {rgb.shape} spans {rgb.min(initial=np.inf):g} to "
            f"{rgb.max(initial=-np.inf):g}; expected (..., 3) within 0 to 1"
        )
    flat = rgb.reshape(-1, 3)
    table = _table()
    found = _solved(flat) if table is None else _looked_up(flat, *table)
    gray = np.ptp(flat, axis=1) == 0
    level = flat[gray, 0]
    with np.errstate(divide="ignore"):  # a gray reflects all wavelengths alike; black and white are at infinity
        constant = (level - 0.5) / np.sqrt(level * (1 - level))
    found[gray] = np.stack([np.zeros_like(level), np.zeros_like(level), constant], axis=1)
    return found.reshape(rgb.shape)


def is_outside(linear_rgb: ArrayLike) -> bool:
    """True if any color of linear sRGB (..., 3) is outside of sRGB: it has a negative channel beyond rounding.

    Each color is compared with its own largest channel.
    """
    rgb = real_numbers("colors", linear_rgb, last=3)
    return bool(np.any(rgb.min(axis=-1) < -OUTSIDE * np.maximum(rgb.max(axis=-1), OUTSIDE)))


def light_tint(linear_rgb: ArrayLike, white: Spectrum, wavelengths_nm: ArrayLike) -> Array:
    """Give the factor (n,) at n wavelengths (nm) by which ``white`` becomes a light of a color, linear sRGB (3,).

    That of a reflectance for a color of sRGB. A light of a color outside of it has a narrower spectrum than any
    surface shows: the factor of at least 0 that gives the XYZ of the color, and that differs least, and most smoothly,
    from the factor of the color without negative channels. Of a color that no light has, the nearest is given.
    """
    rgb, nm = _light_color(linear_rgb, white), real_numbers("wavelengths", wavelengths_nm)
    size = float(np.max(rgb, initial=0.0))
    if size == 0:
        return np.zeros(nm.shape)
    share = rgb / size
    if not is_outside(rgb):
        share = np.maximum(share, 0.0)
        is_gray = np.ptp(share) == 0  # white does not tint
        return size * (np.ones(nm.shape) if is_gray else upsampled(share, nm))
    return size * np.interp(nm, _SOLVE_GRID.wavelengths_nm, _narrow_tint(tuple(share), white)[0])


def distance_from_light(linear_rgb: ArrayLike, white: Spectrum) -> float:
    """Give the largest difference in a channel between a color, linear sRGB (3,), and the light that ``light_tint``
    gives for it, over its largest channel; 0 for colors of sRGB.
    """
    rgb = _light_color(linear_rgb, white)
    return _narrow_tint(tuple(rgb / rgb.max()), white)[1] if rgb.max() > 0 and is_outside(rgb) else 0.0


def _light_color(linear_rgb: ArrayLike, white: Spectrum) -> Array:
    require_kind("the white", white, Spectrum, "illuminant of spectral_core.spectra.catalogue gives one by its name")
    return frozen_array("the color of a light", linear_rgb, (3,))


@lru_cache(maxsize=256)
def _narrow_tint(share: tuple[float, float, float], white: Spectrum) -> tuple[Array, float]:
    """Factor at the wavelengths of the solve, and its largest error in a channel."""
    from scipy.optimize import nnls

    matrix = linear_rgb_from_product(white, _SOLVE_GRID)
    amount = max(1.0, -min(share))
    bright, dark = (
        upsampled(np.maximum(part, 0.0) / amount, _SOLVE_GRID.wavelengths_nm)
        for part in (np.array(share), -np.array(share))
    )
    wanted = matrix @ (bright - dark) * amount
    near = upsampled(np.maximum(share, 0.0), _SOLVE_GRID.wavelengths_nm)
    changes = _change_of_factor()
    stiff = 1e4 / np.abs(matrix).sum(axis=1).max()
    system = np.concatenate([stiff * matrix, changes])
    found: Array = nnls(system, np.concatenate([stiff * wanted, changes @ near]), maxiter=3000)[0]
    found.setflags(write=False)
    return found, float(np.abs(matrix @ found - wanted).max())


@cache
def _change_of_factor() -> Array:
    """Matrix (n, n) whose product with the difference of two factors is as long as the second difference of that and,
    with less weight, the difference itself, most where the eye sees little.
    """
    viewer = observer(STANDARD)
    seen = np.interp(_SOLVE_GRID.wavelengths_nm, viewer.wavelengths_nm, viewer.cmfs.sum(axis=0))
    # without the difference itself, most of a red light would be at the invisible end, near 830 nm
    sizes = np.diag(_NEARNESS / np.sqrt(seen / seen.max()))
    changes = np.concatenate([np.diff(np.eye(_SOLVE_GRID.size), n=2, axis=0), sizes])
    return np.asarray(np.linalg.qr(changes, mode="r"))


@cache
def _table() -> tuple[Array, Array] | None:
    """Lightness scale (n,) and coefficients (3, n, n, n, 3) by the largest channel; None if Mitsuba is not there."""
    package = PathFinder.find_spec("mitsuba")  # not that of sys.modules, which an imported Mitsuba replaces
    folders = [] if package is None else list(package.submodule_search_locations or [])
    files = [path for folder in folders if (path := Path(folder) / "data" / "srgb.coeff").is_file()]
    if not files:
        return None
    data = files[0].read_bytes()
    size = int.from_bytes(data[4:_HEADER_BYTES], "little")
    numbers = np.frombuffer(data, "<f4", offset=_HEADER_BYTES) if data[:4] == b"SPEC" else np.zeros(0, "<f4")
    entries = size + 9 * size**3
    if not size or numbers.size < entries:
        return None  # another layout than the one published with the paper: solved instead
    return numbers[:size].astype(np.float64), numbers[size:entries].reshape(3, size, size, size, 3).astype(np.float64)


def _looked_up(rgb: Array, scale: Array, table: Array) -> Array:
    """Trilinear interpolation as the renderer does it (rgb2spec of the paper's supplement)."""
    size = scale.size
    largest = 2 - np.argmax(rgb[:, ::-1], axis=1)  # of equal channels the last, as the renderer has it
    rows = np.arange(len(rgb))
    z = np.maximum(rgb[rows, largest], 1e-300)
    x, y = (np.minimum(rgb[rows, (largest + k) % 3] * ((size - 1) / z), size - 1) for k in (1, 2))
    xi, yi = (np.minimum(part.astype(np.intp), size - 2) for part in (x, y))
    zi = np.clip(np.searchsorted(scale, z, side="right") - 1, 0, size - 2)
    fx, fy, fz = x - xi, y - yi, (z - scale[zi]) / (scale[zi + 1] - scale[zi])
    total = np.zeros((len(rgb), 3))
    for corner in range(8):
        dx, dy, dz = corner & 1, corner >> 1 & 1, corner >> 2
        weight = np.where(dx, fx, 1 - fx) * np.where(dy, fy, 1 - fy) * np.where(dz, fz, 1 - fz)
        total += weight[:, None] * table[largest, zi + dz, yi + dy, xi + dx]
    return total


def _solved(rgb: Array) -> Array:
    """Coefficients by Gauss-Newton for each color (Eq. 10 of the paper, in linear sRGB under D65)."""
    return np.stack([_solve(row) for row in rgb])


def _solve(rgb: Array) -> Array:
    matrix = linear_rgb_from_product(normalized(catalogue.illuminant("D65")), _SOLVE_GRID)
    nm = _SOLVE_GRID.wavelengths_nm
    unit = (nm - 595.0) / 235.0  # well-conditioned: the quadratic on [-1, 1]
    basis = np.stack([unit**2, unit, np.ones_like(unit)], axis=1)
    aim: Array = np.clip(rgb, 2e-3, 1 - 2e-3)
    start = float(aim.mean())
    found = np.array([0.0, 0.0, (2 * start - 1) / np.sqrt(1 - (2 * start - 1) ** 2)])
    damping = 1e-3

    def error_of(c: Array) -> tuple[Array, Array]:
        value = basis @ c
        sigmoid = 0.5 + value / (2 * np.hypot(1.0, value))
        slope = 0.5 / np.hypot(1.0, value) ** 3
        return matrix @ sigmoid - aim, matrix @ (basis * slope[:, None])

    error, jacobian = error_of(found)
    for _ in range(200):
        if np.abs(error).max() < 1e-9:
            break
        normal = jacobian.T @ jacobian
        step: Array = np.linalg.solve(normal + damping * np.diag(np.diag(normal) + 1e-12), -jacobian.T @ error)
        trial, trial_jacobian = error_of(found + step)
        if float(trial @ trial) < float(error @ error):
            found, error, jacobian, damping = found + step, trial, trial_jacobian, max(damping / 5, 1e-12)
        else:
            damping *= 4
    a, b, c = found
    return np.array([a / 235**2, b / 235 - 2 * a * 595 / 235**2, a * (595 / 235) ** 2 - b * 595 / 235 + c])

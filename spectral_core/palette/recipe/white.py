# SPDX-License-Identifier: GPL-3.0-or-later
"""White and color rendering of a lamp: CCT, Duv and the CIE color rendering index.

Written for optimization, many lamps at a time on one grid; tests compare it with colour-science.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.checks import read_only
from spectral_core.errors import InvalidInputError, MissingDependencyError
from spectral_core.spectra.catalogue import blackbody
from spectral_core.spectra.observer import integration_points, observer
from spectral_core.spectra.spectrum import WAVELENGTHS_NM, Illuminant, SpectralGrid, Spectrum

Array = NDArray[np.float64]

LAMP_GRID = SpectralGrid(WAVELENGTHS_NM)
RANGE_K = 1_000.0, 45_000.0
"""Correlated color temperatures that are told."""
SCAN_K = 900.0, 50_000.0
"""A wider range that is searched, so that whites near the ends have a point of Planck's locus on either side."""
ROUNDING = 1e-6
DAYLIGHT_FROM_K = 5000.0
"""CIE 13.3: the reference is a black body below this temperature, a phase of daylight above."""


@cache
def xyz_from_spd() -> Array:
    """Matrix (3, n) from the power of a lamp at each whole nm to XYZ; exact for ``power_per_nm``."""
    eye, nm = observer(), LAMP_GRID.wavelengths_nm
    return read_only(np.stack([np.interp(nm, eye.wavelengths_nm, row, left=0, right=0) for row in eye.cmfs]))


def power_per_nm(lamp: Spectrum) -> Array:
    """Power (n,) of a lamp around each knot of LAMP_GRID: its integral with the hat function of the knot.

    Power between two knots is shared by both in proportion to their nearness. So a line narrower than 1 nm counts in
    full wherever it stands, and XYZ is exact, because color matching functions are linear between the knots.
    """
    points, weights = integration_points(lamp.grid.wavelengths_nm, LAMP_GRID.wavelengths_nm)
    return np.asarray(LAMP_GRID.against_hats(points, lamp.at(points) * weights)[0])


def mixed_lamp(channels: Sequence[Illuminant], drives: Array) -> Illuminant:
    """The lamp on the knots of LAMP_GRID and, between them, of its channels, so that their lines keep their power."""
    knots = [channel.grid.wavelengths_nm for channel, drive in zip(channels, drives, strict=True) if drive > 0]
    low, high = LAMP_GRID.wavelengths_nm[[0, -1]]
    every = np.unique(np.concatenate([LAMP_GRID.wavelengths_nm, *knots]))
    grid = SpectralGrid(every[(every >= low) & (every <= high)])
    spectra = np.stack([channel.at(grid.wavelengths_nm) for channel in channels])
    return Illuminant("mixed lamp", grid, drives @ spectra)


def uv_from_xyz(xyz: Array) -> Array:
    """CIE 1960 uv (..., 2) of XYZ (..., 3)."""
    x, y, z = np.moveaxis(np.asarray(xyz, dtype=np.float64), -1, 0)
    total = x + 15 * y + 3 * z
    return np.stack([4 * x / total, 6 * y / total], axis=-1)


def planck_uv(kelvin: float) -> Array:
    """CIE 1960 uv (2,) of a black body."""
    return np.asarray(uv_from_xyz(xyz_from_spd() @ blackbody(kelvin, LAMP_GRID).values))


def cct_and_duv(xyz: Array) -> tuple[float, float]:
    """Correlated color temperature in kelvin and Duv of XYZ (3,): the nearest point of Planck's locus in CIE 1960 uv.

    Duv is positive above the locus (greenish). Raises InvalidInputError outside ``RANGE_K``.
    """
    uv = uv_from_xyz(xyz)
    from scipy.optimize import minimize_scalar

    def distance(reciprocal: float) -> float:
        return float(np.sum((planck_uv(1e6 / reciprocal) - uv) ** 2))

    # In reciprocal megakelvin the speed along the locus is almost constant; a coarse scan finds the right minimum.
    low, high = RANGE_K
    scan = np.linspace(1e6 / SCAN_K[1], 1e6 / SCAN_K[0], 62)
    start = int(np.clip(np.argmin([distance(value) for value in scan]), 1, len(scan) - 2))
    found = minimize_scalar(
        distance, bounds=(scan[start - 1], scan[start + 1]), method="bounded", options={"xatol": 1e-6}
    )
    kelvin = 1e6 / found.x
    if not low * (1 - ROUNDING) <= kelvin <= high * (1 + ROUNDING):
        raise InvalidInputError(f"the light's color is not near Planck's locus between {low:,.0f} and {high:,.0f} K")
    # The sign: the side of the locus, seen along growing temperature, with the larger v.
    return kelvin, float(np.sqrt(found.fun)) * (1.0 if uv[1] > planck_uv(kelvin)[1] else -1.0)


def white_xyz(kelvin: float, duv: float = 0.0) -> Array:
    """XYZ (3,) with Y = 1 of the white of a temperature, ``duv`` off Planck's locus, perpendicular to it."""
    step = 0.01
    center, along = planck_uv(kelvin), planck_uv(kelvin + step) - planck_uv(kelvin - step)
    normal = np.array([-along[1], along[0]]) / np.linalg.norm(along)
    u, v = center + duv * (normal if normal[1] > 0 else -normal)
    x, y = 3 * u / (2 * u - 8 * v + 4), 2 * v / (2 * u - 8 * v + 4)
    return np.array([x / y, 1.0, (1 - x - y) / y])


@cache
def reference_spd(kelvin: float) -> Array:
    """Reference illuminant of CIE 13.3 on LAMP_GRID: a black body, or a phase of daylight from 5,000 K on."""
    if kelvin < DAYLIGHT_FROM_K:
        return np.asarray(blackbody(kelvin, LAMP_GRID).values)
    return daylight_spd(kelvin)


@cache
def daylight_spd(kelvin: float) -> Array:
    """Phase of daylight (n,) on LAMP_GRID, from 4,000 to 25,000 K."""
    colour = colour_science()
    x_y = colour.temperature.CCT_to_xy_CIE_D(kelvin)
    daylight = colour.sd_CIE_illuminant_D_series(x_y)
    return read_only(np.interp(LAMP_GRID.wavelengths_nm, daylight.wavelengths, daylight.values))


def colour_science() -> Any:
    """The package colour-science. Raises MissingDependencyError if it is not installed."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # it names the plotting packages that it does not find, which nobody needs
            import colour
    except ImportError as error:
        raise MissingDependencyError.package("colour-science", "color rendering of lamps", "catalogue") from error
    return colour


@cache
def _test_colors() -> Array:
    """Reflectances (8, n) of the test color samples of CIE 13.3."""
    colour_science()
    from colour.quality.datasets import SDS_TCS

    # From 0.4.7 on colour-science files its samples by edition; those of CIE 13.3 are of 1995.
    known: Any = SDS_TCS.get("CIE 1995", SDS_TCS)
    samples = [known[name] for name in list(known)[:8]]
    return np.stack([np.interp(LAMP_GRID.wavelengths_nm, sd.wavelengths, sd.values) for sd in samples])


class RenderingReference:
    """Color rendering index Ra of lamps of one color temperature (CIE 13.3-1995), whose reference is computed once."""

    def __init__(self, kelvin: float) -> None:
        self._samples = _test_colors()
        self._colors, self._white = self._uniform_colors(reference_spd(round(kelvin, 1)), None)

    def index(self, spd: Array) -> float:
        """Ra of a lamp (n,) on LAMP_GRID."""
        colors, _ = self._uniform_colors(spd, self._white)
        return float(np.mean(100 - 4.6 * np.linalg.norm(colors - self._colors, axis=1)))

    def _uniform_colors(self, spd: Array, adapt_to: Array | None) -> tuple[Array, Array]:
        """U*V*W* (8, 3) of the test colors and uv (2,) of the white, with the von Kries shift of section 5.7."""
        matrix = xyz_from_spd() * spd
        white = matrix.sum(axis=1)
        xyz = (self._samples @ matrix.T) * (100 / white[1])
        uv, white_uv = uv_from_xyz(xyz), uv_from_xyz(white)
        if adapt_to is not None:
            source, target = _c_d(white_uv), _c_d(adapt_to)
            c, d = _c_d(uv)
            c, d = c * target[0] / source[0], d * target[1] / source[1]
            below = 16.518 + 1.481 * c - d
            uv = np.stack([(10.872 + 0.404 * c - 4 * d) / below, 5.52 / below], axis=-1)
            white_uv = adapt_to
        lightness = 25 * np.cbrt(xyz[:, 1]) - 17
        return np.column_stack([13 * lightness[:, None] * (uv - white_uv), lightness]), white_uv


def color_rendering_index(spd: Array) -> float:
    """General color rendering index Ra of a lamp (n,) on LAMP_GRID."""
    return RenderingReference(cct_and_duv(xyz_from_spd() @ spd)[0]).index(spd)


def _c_d(uv: Array) -> tuple[Array, Array]:
    u, v = uv[..., 0], uv[..., 1]
    return (4 - u - 10 * v) / v, (1.708 * v + 0.404 - 1.481 * u) / v


def luminous_efficacy(spd: Array) -> float:
    """Lumen per watt of radiation of a lamp (n,) on LAMP_GRID."""
    from scipy.integrate import trapezoid

    return float(683 * (xyz_from_spd()[1] @ spd) / trapezoid(spd, LAMP_GRID.wavelengths_nm))

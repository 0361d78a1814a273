# SPDX-License-Identifier: GPL-3.0-or-later
"""The sky and the sun's disk as Blender's Sky Texture describes them, in linear sRGB radiance.

Single scattering: Nishita et al. 1993, "Display of the Earth taking into account atmospheric scattering", at 21
wavelengths. Multiple scattering: ``skies/multiple.py``.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from spectral_core.checks import require_declared
from spectral_core.scene.skies import multiple
from spectral_core.scene.skies.daylight import hosek, interpolated, preetham, sun_disk
from spectral_core.spectra.color import RGB_FROM_XYZ
from spectral_core.spectra.observer import observer

Array = NDArray[np.float64]

ROWS, COLUMNS = 128, 48
"""Numbers of elevations on each side of the horizon (denser toward it; as many as Cycles has) and of azimuths (from the
sun to its opposite, denser toward the sun) of a computed sky.
"""


@dataclass(frozen=True, slots=True)
class Atmosphere:
    """A Sky Texture's settings: angles in radians, altitude in meters, densities relative to Earth's."""

    model: Literal["single", "multiple", "preetham", "hosek"] = "multiple"
    sun_elevation: float = 0.26
    sun_rotation: float = 0.0
    altitude: float = 100.0
    air: float = 1.0
    aerosol: float = 1.0
    ozone: float = 1.0
    turbidity: float = 2.2
    sun_direction: tuple[float, float, float] = (0.0, 0.0, 1.0)
    """Only for Preetham's and Hosek's skies, as the turbidity."""
    ground_albedo: float = 0.3
    """Only for Hosek's sky."""

    def __post_init__(self) -> None:
        require_declared(self)

    @property
    def toward_sun(self) -> Array:
        """Unit vector (3,) to the sun."""
        if self.model in ("preetham", "hosek"):
            vector = np.array(self.sun_direction, dtype=np.float64)
            return vector / max(float(np.linalg.norm(vector)), 1e-12)
        flat, turn = np.cos(self.sun_elevation), np.pi / 2 - self.sun_rotation
        return np.array([flat * np.cos(turn), flat * np.sin(turn), np.sin(self.sun_elevation)])

    @property
    def densities(self) -> Array:
        """Densities (3,) of air, aerosols and ozone."""
        return np.array([self.air, self.aerosol, self.ozone])

    @property
    def horizon(self) -> float:
        """Elevation of the horizon (radian) that hides the sun, below 0 from a height."""
        return max(-float(np.arccos(6371e3 / (6371e3 + max(self.altitude, 0.0)))), -1.0)

    def radiance(self, directions: Array) -> Array:
        """Linear sRGB (..., 3) of the sky without its sun along unit directions (..., 3)."""
        if self.model == "preetham":
            return _clamped(preetham(self.turbidity, self.toward_sun, directions))
        if self.model == "hosek":
            return np.maximum(hosek(self.turbidity, self.ground_albedo, self.toward_sun, directions), 0.0)
        table = _table(self)
        elevation = np.arcsin(np.clip(directions[..., 2], -1, 1))
        sun = self.toward_sun
        turn = np.arctan2(directions[..., 1], directions[..., 0]) - np.arctan2(sun[1], sun[0])
        azimuth = np.abs((turn + np.pi) % (2 * np.pi) - np.pi)
        height = np.sign(elevation) * np.sqrt(np.abs(elevation) / (np.pi / 2))
        fade: Array | float = 1.0
        if self.model == "single":
            # Cycles reads its picture of this sky half a pixel beside the place that it computed
            half = np.pi / (4 * ROWS)
            azimuth = np.minimum(np.maximum(azimuth, half) + half, np.pi)
            height = height - 0.5 / ROWS
            below = np.sin(np.minimum(height, 0.0) ** 2 * np.pi / 2)  # the horizon fades to black below it
            fade = (np.maximum(1 - 2.5 * below, 0.0) ** 3)[..., None]
            row = np.clip(height * ROWS, 0, ROWS - 1)
        else:
            row = np.clip((height + 1) * ROWS - 0.5, 0, 2 * ROWS - 1)
        return _clamped(interpolated(table, row, np.sqrt(azimuth / np.pi) * (COLUMNS - 1))) * fade

    def sun_radiance(self, angle_rad: float) -> Array:
        """Mean linear sRGB (3,) of the sun's disk of full angle ``angle_rad``, its darker limb included."""
        if self.model in ("preetham", "hosek") or (self.model == "single" and self.sun_elevation + angle_rad / 2 <= 0):
            return np.zeros(3)
        visible = np.clip((self.sun_elevation - self.horizon) / angle_rad + 0.5, 0.0, 1.0)
        edges = self._edges(angle_rad)
        darkened = 0.8  # mean over the disk of 1 - 0.6 (1 - cosine)
        return _clamped((edges[0] + edges[1]) / 2) * darkened * visible

    def wide_sun(self, directions: Array, angle_rad: float) -> Array:
        """Linear sRGB (..., 3) of the sun's disk along unit directions (..., 3), 0 beside it."""
        if self.model == "single" and self.sun_elevation + angle_rad / 2 <= 0:
            return np.zeros(directions.shape)
        return _clamped(
            sun_disk(directions, self.sun_elevation, self.toward_sun, angle_rad, self.horizon, self._edges(angle_rad))
        )

    def _edges(self, angle_rad: float) -> list[Array]:
        """XYZ of the sun's disk at its lower and its upper edge, before its limb darkens."""
        solid_angle = 2 * np.pi * (1 - np.cos(angle_rad / 2))
        return [self._sun_at(self.sun_elevation + side * angle_rad / 2) / solid_angle for side in (-1, 1)]

    def _sun_at(self, elevation: float) -> Array:
        if self.model == "single":
            return _sun_single(self, elevation)
        return multiple.sun(elevation, self.altitude, self.densities)


def _clamped(xyz: Array) -> Array:
    return np.asarray(np.maximum(xyz @ RGB_FROM_XYZ.T, 0.0))


@cache
def _table(sky: Atmosphere) -> Array:
    """XYZ (rows, COLUMNS, 3) over elevation, for single scattering only above the horizon, and azimuth from the sun."""
    height = np.arange(ROWS) / ROWS if sky.model == "single" else (np.arange(2 * ROWS) + 0.5) / ROWS - 1
    elevation = (np.sign(height) * height**2 * np.pi / 2)[:, None]
    azimuth = (np.linspace(0, 1, COLUMNS) ** 2 * np.pi)[None, :]
    parts = (np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation) + 0 * azimuth)
    directions = np.stack(parts, axis=-1)
    return (
        _single(sky, directions)
        if sky.model == "single"
        else multiple.radiance(sky.sun_elevation, sky.altitude, sky.densities, directions)
    )


# --- single scattering: lengths in meters ---------------------------------------------------------------------------

_NM = 380.0 + 20.0 * np.arange(21)
_GROUND, _TOP = 6360e3, 6420e3
_STEPS = 32
_RAYLEIGH = 1.13115e6 * _NM**-4.0
"""Scattering of air per meter at sea level, of index 1.0003."""
_MIE = 2e-5
_OZONE = 1e-9 * np.array([3.25, 5.85, 19.8, 73.1, 201, 404, 636, 967, 1548, 2090, 2461, 2736, 2151, 1591, 1124, 735,
                          465, 331, 225, 149, 168])  # fmt: skip
"""Absorption per meter at the height of most ozone."""


def _solar(nm: Array) -> Array:
    """Irradiance of the sun above the air, W / (m² nm): a black body of 5778 K."""
    meters = nm * 1e-9
    planck = 1.191042972e-16 / meters**5 / np.expm1(1.438776877e-2 / (meters * 5778.0))
    return np.asarray(planck * 1e-9 * 6.79e-5)


def _xyz_single(spectrum: Array) -> Array:
    viewer = observer()
    return np.asarray(
        spectrum @ np.stack([np.interp(_NM, viewer.wavelengths_nm, row) for row in viewer.cmfs], 1) * 20.0
    )


def _densities(height: Array) -> Array:
    """Relative densities (..., 3) of air, aerosols and ozone at heights; below the ground those on it."""
    height = np.maximum(height, 0.0)  # the way to a sun that is below the horizon passes the Earth
    ozone = np.where(height < 25e3, height / 15e3 - 2 / 3, 8 / 3 - height / 15e3)
    ozone = np.where((height >= 10e3) & (height < 40e3), ozone, 0.0)
    return np.stack([np.exp(-height / 8e3), np.exp(-height / 1.2e3), ozone], axis=-1)


def _way_out(origin: Array, direction: Array, radius: float) -> Array:
    along = np.sum(origin * direction, axis=-1)
    return np.asarray(-along + np.sqrt(np.maximum(along**2 - np.sum(origin**2, axis=-1) + radius**2, 0.0)))


@cache
def _laguerre() -> tuple[Array, Array]:
    nodes, weights = np.polynomial.laguerre.laggauss(8)
    return nodes / 25, weights * np.exp(nodes) / 25


def _depth_to_sky(origin: Array, direction: Array) -> Array:
    """Optical depth (..., 3) of each constituent from a point to the top of the atmosphere."""
    length = _way_out(origin, direction, _TOP)
    total = np.zeros((*length.shape, 3))
    for node, weight in zip(*_laguerre(), strict=True):
        place = origin + (node * length)[..., None] * direction
        total += weight * _densities(np.linalg.norm(place, axis=-1) - _GROUND)
    return total * length[..., None]


def _single(sky: Atmosphere, directions: Array) -> Array:
    scale = sky.densities
    eye = np.array([0.0, 0.0, _GROUND + np.clip(sky.altitude, 1, 59999)])
    sun = np.array([np.cos(sky.sun_elevation), 0.0, np.sin(sky.sun_elevation)])
    step = _way_out(eye, directions, _TOP) / _STEPS
    cosine = directions @ sun
    both = (1 + cosine**2) / np.pi
    forward = (1 + 0.76**2 - 1.52 * cosine) ** 1.5
    phases = (3 / 16 * both, 3 / 8 * both * (1 - 0.76**2) / ((2 + 0.76**2) * forward))
    extinction = np.stack([_RAYLEIGH, np.full(21, 1.11 * _MIE), _OZONE])
    passed, total = np.zeros((*step.shape, 3)), np.zeros((*step.shape, 21))
    for k in range(_STEPS):
        place = eye + ((k + 0.5) * step)[..., None] * directions
        density = scale * _densities(np.linalg.norm(place, axis=-1) - _GROUND)
        passed += step[..., None] * density
        depth = passed + scale * _depth_to_sky(place, np.broadcast_to(sun, place.shape))
        along = place @ sun
        shaded = (sun[2] < 0) & (along**2 - np.sum(place**2, axis=-1) + _GROUND**2 >= 0)
        scattered = (phases[0] * density[..., 0])[..., None] * _RAYLEIGH + (phases[1] * density[..., 1] * _MIE)[
            ..., None
        ]
        light = np.exp(-depth @ extinction) * scattered * step[..., None]
        total += np.where(shaded[..., None], 0.0, light)
    return _xyz_single(total * _solar(_NM))


def _sun_single(sky: Atmosphere, elevation: float) -> Array:
    elevation = max(elevation, 0.0)
    eye = np.array([0.0, 0.0, _GROUND + np.clip(sky.altitude, 1, 59999)])
    depth = _depth_to_sky(eye, np.array([np.cos(elevation), 0.0, np.sin(elevation)]))
    passed = np.exp(-(_RAYLEIGH * depth[0] * sky.air + 1.11 * _MIE * depth[1] * sky.aerosol))
    return _xyz_single(_solar(_NM) * passed)

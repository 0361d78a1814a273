# SPDX-License-Identifier: GPL-3.0-or-later
"""A sky whose light is scattered more than once, and its sun: lengths in kilometers, at 630, 560, 490 and 430 nm.

Garcia Linan 2024, "Physically based spectral sky" (fgarlin.com), with his fit of light that is scattered often.
``densities`` (3,) are those of air, aerosols and ozone, relative to Earth's; angles in radians, the altitude in meters.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_EARTH, _THICKNESS, _G = 6371.0, 100.0, 0.8
_SUN = np.array([1.679, 1.828, 1.986, 1.307])
_AIR = np.array([6.605e-3, 1.067e-2, 1.842e-2, 3.156e-2])
_OZONE_4 = np.array([3.472e-25, 3.914e-25, 1.349e-25, 11.03e-27]) * 334.5 * 3.78547397e20
_DUST_ABSORBS = np.array([2.8722e-24, 4.6168e-24, 7.9706e-24, 1.3578e-23]) * 1.3681e20
_DUST_SCATTERS = np.array([1.5908e-22, 1.7711e-22, 2.0942e-22, 2.4033e-22]) * 1.3681e20
_XYZ_OF_4 = np.array([[53.3869177, 22.9813375, 0.0], [43.9048445, 71.3477957, 0.1025069],
                      [1.6137278, 18.4229606, 31.7429212], [20.7626687, 2.3614213, 110.4800964]])  # fmt: skip
_EXTINCTION = np.stack([_AIR, _DUST_SCATTERS + _DUST_ABSORBS, _OZONE_4])
"""Per kilometer of each constituent in its relative amount 1."""


def _amounts(height: Array) -> Array:
    """Relative amounts (..., 3) of air, aerosols and ozone at a height, on Earth."""
    height = np.maximum(height, 0.0)
    log = np.log(np.maximum(height, 1e-4))
    air = np.exp(-0.07771971 * height**1.16364243)
    dust = np.exp(-height / 0.73) + 2e6 / 1.3681e20
    return np.stack([air, dust, np.exp(-((log - 3.22261) ** 2) * 5.55555555 - log)], axis=-1)


def _columns(cosine: Array, height: Array) -> Array:
    """Amounts (..., 3) between a height and the sun at ``cosine`` to its zenith, times kilometers."""
    cosine, height = np.broadcast_arrays(np.asarray(cosine, float), np.asarray(height, float))
    radius = _EARTH + height
    length = -radius * cosine + np.sqrt(np.maximum((radius * cosine) ** 2 - radius**2 + (_EARTH + _THICKNESS) ** 2, 0))
    total = np.zeros((*cosine.shape, 3))
    for k in range(64):
        along = length * (k + 0.5) / 64
        here = np.sqrt(radius**2 + along**2 + 2 * radius * along * cosine) - _EARTH
        total += _amounts(here) * (length / 64)[..., None]
    return total


@cache
def _columns_over_heights() -> Array:
    """``_columns`` over 64 heights and 256 cosines, which no setting of a sky changes."""
    return _columns(np.linspace(-1, 1, 256)[None, :], np.linspace(0, _THICKNESS, 64)[:, None])


def _transmittance(columns: Array) -> Array:
    """Transmittance (..., 4) of amounts (..., 3)."""
    return np.asarray(np.exp(-columns @ _EXTINCTION))


def _way_to_space(origin: Array, direction: Array) -> Array:
    along = np.sum(origin * direction, axis=-1)
    outside = np.sum(origin**2, axis=-1) - (_EARTH + _THICKNESS) ** 2
    return np.asarray(-along + np.sqrt(np.maximum(along**2 - outside, 0.0)))


def radiance(sun_elevation: float, altitude: float, densities: Array, directions: Array) -> Array:
    """XYZ (rows, columns, 3) along directions (rows, columns, 3) of one elevation in each row.

    The eye is above the pole, so that heights, and all that depends on nothing else, have one column.
    """
    table = _transmittance(densities * _columns_over_heights())

    def to_sun(cosine: Array, height: Array) -> Array:
        row, column = np.clip(height, 0, _THICKNESS) / _THICKNESS * 63, np.clip(cosine * 0.5 + 0.5, 0, 1) * 255
        low, left = np.minimum(row.astype(int), 62), np.minimum(column.astype(int), 254)
        up, across = (row - low)[..., None], (column - left)[..., None]
        below = table[low, left] * (1 - across) + table[low, left + 1] * across
        return np.asarray(
            below * (1 - up) + (table[low + 1, left] * (1 - across) + table[low + 1, left + 1] * across) * up
        )

    eye = np.array([0.0, 0.0, _EARTH + np.clip(altitude, 1, 99999) / 1000])
    toward_sun = np.array([np.cos(sun_elevation), 0.0, np.sin(sun_elevation)])
    one = directions[:, :1]
    along = one @ eye
    inside = along**2 - eye @ eye + _EARTH**2
    ground = np.where((inside >= 0) & (along < 0), -along - np.sqrt(np.maximum(inside, 0)), -1.0)
    length = np.where(ground > 0, ground, _way_to_space(eye, one))
    cosine = directions @ toward_sun
    air_phase = 3 / (16 * np.pi) * (1 + cosine**2)
    dust_phase = (1 - _G**2) / (4 * np.pi) / (1 + _G**2 - 2 * _G * cosine) ** 1.5
    step = length / 64
    light, clear = np.zeros((*cosine.shape, 4)), np.ones((*step.shape, 4))
    straight_up = to_sun(np.array(1.0), np.array(0.0))
    for k in range(64):
        way = (k + 0.5) * step
        radius = np.linalg.norm(eye + way[..., None] * one, axis=-1)
        height, zenith = np.maximum(radius - _EARTH, 0.0), (eye @ toward_sun + way * cosine) / radius
        amounts = _amounts(height) * densities
        air, dust, extinction = amounts[..., :1] * _AIR, amounts[..., 1:2] * _DUST_SCATTERS, amounts @ _EXTINCTION
        direct = to_sun(zenith, height)
        solid = 2 * np.pi * (1 - np.sqrt(np.maximum(1 - (_EARTH / np.maximum(radius, _EARTH)) ** 2, 0)))
        up = straight_up / to_sun(np.ones_like(height), height)
        ground_light = (solid * zenith)[..., None] * (0.3 / np.pi / (4 * np.pi)) * to_sun(zenith, 0 * height) * up
        often = (
            0.02 * np.array([0.217, 0.347, 0.594, 1.0]) / (1 + 5 * np.exp(-17.92 * zenith))[..., None] + ground_light
        )
        source = _SUN * (
            air * (air_phase[..., None] * direct + often) + dust * (dust_phase[..., None] * direct + often)
        )
        passed = np.exp(-step[..., None] * extinction)
        light += clear * source * (1 - passed) / np.maximum(extinction, 1e-7)
        clear *= passed
    return np.asarray(light @ _XYZ_OF_4)


def sun(elevation: float, altitude: float, densities: Array) -> Array:
    """XYZ (3,) of the sun at an elevation, over its solid angle."""
    height = np.clip(altitude, 1, 99999) / 1000
    passed = _transmittance(densities * _columns(np.sin(elevation), height))
    return np.asarray(_SUN * passed @ _XYZ_OF_4)

# SPDX-License-Identifier: GPL-3.0-or-later
"""Two measured skies at Blender's scale.

Preetham, Shirley and Smits 1999, "A practical analytic model for daylight". Hosek and Wilkie 2012, "An analytic model
for full spectral sky-dome radiance"; its coefficients come with Mitsuba, as sums of 9 numbers for each of three
channels.
"""

from __future__ import annotations

import importlib.util
import struct
from functools import cache
from math import comb
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.errors import InvalidInputError

Array = NDArray[np.float64]

COEFFICIENTS = "data/sunsky/sunsky_datasets.bin"
"""File of Mitsuba's with the coefficients of Hosek and Wilkie."""
FORMS, LEVELS = "sky_params_rgb", "sky_rad_rgb"
"""Names in it of the coefficients (10 turbidities, 2 albedos, 6 elevations, 3 channels, 9) and the radiances."""
MOST_TURBID = 10.0
BLENDER_SCALE = 2 * np.pi / 683
"""Factor on the radiance of Hosek and Wilkie, as in Cycles."""


def preetham(turbidity: float, sun: Array, directions: Array) -> Array:
    """XYZ (..., 3) of the sky along unit directions (..., 3), ``sun`` the one toward the sun."""
    t = turbidity
    theta_sun = float(np.arccos(np.clip(sun[2], -1, 1)))
    rows: dict[str, Any] = {
        "Y": (0.1787 * t - 1.463, -0.3554 * t + 0.4275, -0.0227 * t + 5.3251, 0.1206 * t - 2.5771, -0.067 * t + 0.3703),
        "x": (-0.0193 * t - 0.2592, -0.0665 * t + 0.0008, -0.0004 * t + 0.2125, -0.0641 * t - 0.8989,
              -0.0033 * t + 0.0452),
        "y": (-0.0167 * t - 0.2608, -0.095 * t + 0.0092, -0.0079 * t + 0.2102, -0.0441 * t - 1.6537,
              -0.0109 * t + 0.0529),
    }  # fmt: skip
    chi = (4 / 9 - t / 120) * (np.pi - 2 * theta_sun)
    powers = theta_sun ** np.array([3.0, 2.0, 1.0, 0.0])
    matrices = {"x": [[0.00166, -0.00375, 0.00209, 0], [-0.02903, 0.06377, -0.03202, 0.00394],
                      [0.11693, -0.21196, 0.06052, 0.25886]],
                "y": [[0.00275, -0.0061, 0.00317, 0], [-0.04214, 0.0897, -0.04153, 0.00516],
                      [0.15346, -0.26756, 0.0667, 0.26688]]}  # fmt: skip
    zenith = {name: float(np.array([t * t, t, 1.0]) @ np.array(m) @ powers) for name, m in matrices.items()}
    zenith["Y"] = ((4.0453 * t - 4.971) * np.tan(chi) - 0.2155 * t + 2.4192) * 0.06
    theta = np.minimum(np.arccos(np.clip(directions[..., 2], -1, 1)), np.pi / 2 - 0.001)
    gamma = np.arccos(np.clip(directions @ sun, -1, 1))

    def perez(row: tuple[float, ...], theta: Any, gamma: Any) -> Any:
        a, b, c, d, e = row
        return (1 + a * np.exp(b / np.cos(theta))) * (1 + c * np.exp(d * gamma) + e * np.cos(gamma) ** 2)

    found = {n: zenith[n] * perez(row, theta, gamma) / perez(row, 0.0, theta_sun) for n, row in rows.items()}
    scale = found["Y"] / np.where(found["y"] == 0, 1, found["y"])
    return np.stack([found["x"] * scale, found["Y"], (1 - found["x"] - found["y"]) * scale], axis=-1)


@cache
def _coefficients() -> dict[str, Array] | None:
    """The coefficients of Hosek and Wilkie's sky; None if this Mitsuba lacks them."""
    found = importlib.util.find_spec("mitsuba")
    path = Path(found.origin).parent / COEFFICIENTS if found is not None and found.origin else None
    if path is None or not path.is_file():
        return None
    raw = path.read_bytes()
    try:
        count = struct.unpack_from("<I", raw, 14)[0]  # after the format's name and its version
        at, tables = 18, {}
        for _ in range(count):
            length = struct.unpack_from("<H", raw, at)[0]
            name = raw[at + 2 : at + 2 + length].decode("ascii")
            dimensions, _, start = struct.unpack_from("<HBQ", raw, at + 2 + length)
            shape = struct.unpack_from(f"<{dimensions}Q", raw, at + 13 + length)
            if name in (FORMS, LEVELS):
                tables[name] = np.frombuffer(raw, "<f8", int(np.prod(shape)), start).reshape(shape)
            at += 13 + length + 8 * dimensions
    except (struct.error, ValueError):
        return None
    return tables if set(tables) == {FORMS, LEVELS} else None


def has_hosek() -> bool:
    """True if the coefficients of Hosek and Wilkie's sky are installed."""
    return _coefficients() is not None


def hosek(turbidity: float, albedo: float, sun: Array, directions: Array) -> Array:
    """Linear sRGB (..., 3) of the sky along unit directions (..., 3) over a ground of some albedo.

    A ``sun`` below the horizon counts as one on it, as in Cycles. Raises InvalidInputError where ``has_hosek`` is
    False.
    """
    tables = _coefficients()
    if tables is None:
        raise InvalidInputError("the data of the Hosek-Wilkie sky are missing; install Mitsuba 3.7")
    if sun[2] < 0:
        flat = float(np.hypot(sun[0], sun[1]))
        sun = np.array([sun[0] / flat, sun[1] / flat, 0.0] if flat > 0 else [0.0, 1.0, 0.0])
    height = (float(np.arcsin(np.clip(sun[2], 0, 1))) / (np.pi / 2)) ** (1 / 3)
    shares = np.array([comb(5, k) * height**k * (1 - height) ** (5 - k) for k in range(6)])
    turbid = float(np.clip(turbidity, 1.0, MOST_TURBID))
    low = min(int(turbid), 9)

    def interpolated(table: Array) -> Array:
        low_and_high = np.tensordot(table[low - 1 : low + 1], shares, axes=(2, 0))  # (2, 2, 3) or (2, 2, 3, 9)
        over_ground = low_and_high[:, 0] * (1 - albedo) + low_and_high[:, 1] * albedo
        return np.asarray(over_ground[0] * (low + 1 - turbid) + over_ground[1] * (turbid - low))

    a, b, c, d, e, f, g, zenith, h = interpolated(tables[FORMS]).T
    theta = np.minimum(np.arccos(np.clip(directions[..., 2:], -1, 1)), np.pi / 2 - 0.001)
    cosine = np.clip(directions @ sun, -1, 1)[..., None]
    mie = (1 + cosine**2) / (1 + h * h - 2 * h * cosine) ** 1.5
    around = c + d * np.exp(e * np.arccos(cosine)) + f * cosine**2 + g * mie + zenith * np.sqrt(np.cos(theta))
    above = 1 + a * np.exp(b / (np.cos(theta) + 0.01))
    return np.asarray(BLENDER_SCALE * interpolated(tables[LEVELS]) * above * around)


def sun_disk(
    directions: Array, elevation_rad: float, toward_sun: Array, angle_rad: float, horizon_rad: float, edges: list[Array]
) -> Array:
    """Radiance (..., 3) of a disk along unit directions (..., 3), as in Cycles darker toward its rim, 0 beside it.

    ``edges``: radiance (3,) at its lower and its upper edge, between which it changes with elevation.
    """
    from_center = np.arccos(np.clip(directions @ toward_sun, -1.0, 1.0)) / (angle_rad / 2)
    elevation = np.arcsin(np.clip(directions[..., 2], -1.0, 1.0))
    share = ((elevation - elevation_rad) / angle_rad + 0.5)[..., None]
    darkened = 1 - 0.6 * (1 - np.sqrt(np.maximum(1 - from_center**2, 0.0)))
    inside = (from_center < 1.0) & (elevation > horizon_rad)
    return np.where(inside[..., None], (edges[0] * (1 - share) + edges[1] * share) * darkened[..., None], 0.0)


def interpolated(table: Array, row: Array, column: Array) -> Array:
    """Entries of a table at places between its rows and columns."""
    low, left = (np.floor(part).astype(int) for part in (row, column))
    low, left = np.clip(low, 0, len(table) - 2), np.clip(left, 0, table.shape[1] - 2)
    up, across = (row - low)[..., None], (column - left)[..., None]
    first = table[low, left] * (1 - across) + table[low, left + 1] * across
    second = table[low + 1, left] * (1 - across) + table[low + 1, left + 1] * across
    return np.asarray(first * (1 - up) + second * up)

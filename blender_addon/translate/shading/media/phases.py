# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's phase functions as sums of Draine's, which include Henyey and Greenstein's."""

from __future__ import annotations

import math

import numpy as np
from scipy.optimize import nnls

from ..reader import Reader
from ..tree import Output

Lobes = tuple[tuple[float, float, float], ...]
"""Weight, g and α of each."""


def lobes_of(reader: Reader, source: Output) -> Lobes:
    """Phase function of a volume shader."""
    g = min(max(reader.number(source.input("Anisotropy"), 0.0), -0.99), 0.99)
    kind = getattr(source.node, "phase", "HENYEY_GREENSTEIN")
    if kind == "DRAINE":
        return ((1.0, g, max(reader.number(source.input("Alpha"), 0.5), 0.0)),)
    if kind == "RAYLEIGH":
        return ((1.0, 0.0, 1.0),)
    if kind == "MIE":
        return mie(reader.number(source.input("Diameter"), 20.0))
    if kind == "FOURNIER_FORAND":
        index, back = reader.number(source.input("IOR"), 1.33), reader.number(source.input("Backscatter"), 0.1)
        return fournier_forand(index, back)
    return ((1.0, g, 0.0),)


def mie(diameter: float) -> Lobes:
    """Water droplets of a diameter in micrometers (Jendersie and d'Eon 2023, "An approximate Mie scattering function
    for fog and cloud rendering").
    """
    d = min(max(diameter, 1e-3), 50.0)
    if d >= 5:
        first = math.exp(-0.0990567 / (d - 1.67154))
        second = math.exp(-2.20679 / (d + 3.91029) - 0.428934)
        alpha = math.exp(3.62489 - 8.29288 / (d + 5.52825))
        weight = math.exp(-0.599085 / (d - 0.641583) - 0.665888)
    elif d >= 1.5:
        log = math.log(d)
        first = 0.0604931 * math.log(log) + 0.940256
        second = 0.500411 - 0.081287 / (-2 * log + math.tan(log) + 1.27551)
        alpha = 7.30354 * log + 6.31675
        weight = 0.026914 * (log - math.cos(5.68947 * (math.log(log) - 0.0292149))) + 0.376475
    elif d > 0.1:
        log = math.log(d)
        first = 0.862 - 0.143 * log * log
        turn = math.cos(
            1.19692 * math.cos((log - 0.238604) * (log + 1.00667) / (0.507522 - 0.15677 * log))
            + 1.37932 * log
            + 0.0625835
        )
        second, alpha = 0.379685 * turn + 0.344213, 250.0
        weight = 0.146209 * math.cos(3.38707 * log + 2.11193) + 0.316072 + 0.0778917 * log
    else:
        first, second, alpha = 13.8 * d * d, 1.1456 * d * math.sin(9.29044 * d), 250.0
        weight = 0.252977 - 312.983 * d**4.3
    return (1 - weight, _held(first), 0.0), (weight, _held(second), alpha)


def _held(g: float) -> float:
    return min(max(g, -0.99), 0.99)


CANDIDATES = (-0.7, -0.3, 0.0, 0.3, 0.5, 0.7, 0.8, 0.87, 0.92, 0.95, 0.97, 0.985, 0.99)
"""g of the lobes that are fitted to other phase functions."""
FAINTEST = 1e-4


def fournier_forand(index: float, backscatter: float) -> Lobes:
    """Particles in water (Fournier and Jonasz 1999), as lobes fitted to it: relative least squares over the sphere."""
    n = min(max(index, 1.01), 2.0)
    mu_slope = _slope(n, min(max(backscatter, 1e-4), 0.4999))
    # fine where it is steep
    angle = np.pi * (np.linspace(0.0, 1.0, 400)[1:] ** 2)
    target = _fournier_forand(angle, n, mu_slope)
    cosine = np.cos(angle)
    lobes = [(1 - g * g) / (4 * np.pi * np.maximum(1 + g * g - 2 * g * cosine, 1e-12) ** 1.5) for g in CANDIDATES]
    weights, _ = nnls(np.stack(lobes, axis=1) / target[:, None], np.ones(len(angle)))
    weights[-1] += max(1 - weights.sum(), 0.0)  # forward light in a peak that is too narrow to fit
    weights = weights / weights.sum()
    return tuple((float(w), g, 0.0) for w, g in zip(weights, CANDIDATES, strict=True) if w > FAINTEST)


def _slope(n: float, backscatter: float) -> float:
    """Exponent ν of the particles' sizes for a share of backscattered light."""
    delta = 4 / (3 * (n - 1) ** 2) * 0.5
    # (1 - δ^(ν+1) - (1 - δ^ν) / 2) / ((1 - δ) δ^ν) = 1 - B, solved for δ^ν
    power = 0.5 / (delta - 0.5 - (1 - backscatter) * (delta - 1))
    return float(math.log(power) / math.log(delta)) if power > 0 else -1.0


def _fournier_forand(angle: np.ndarray, n: float, slope: float) -> np.ndarray:
    square = np.sin(angle / 2) ** 2
    delta = 4 / (3 * (n - 1) ** 2) * square
    power = delta**slope
    value = slope * (1 - delta) - (1 - power) + (delta * (1 - power) - slope * (1 - delta)) / square
    value = value / (4 * np.pi * (1 - delta) ** 2 * power)
    last = 4 / (3 * (n - 1) ** 2)
    tail = (1 - last**slope) / (16 * np.pi * (last - 1) * last**slope) * (3 * np.cos(angle) ** 2 - 1)
    return np.maximum(value + tail, 1e-6)

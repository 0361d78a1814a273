# SPDX-License-Identifier: GPL-3.0-or-later
"""Gabor Texture: random waves under Gaussian windows, eight in each cell of a grid.

Sources: Lagae et al. 2009, "Procedural noise using sparse Gabor convolution"; Tavernier et al. 2019, "Making Gabor
noise fast and normalized" (eight kernels per cell, weights of plus and minus one, the sine); Tricard et al. 2019,
"Procedural phasor noise", equations 8 and 9 (intensity and phase). The random numbers are those of Blender.
"""

from __future__ import annotations

from math import pi, sqrt
from typing import Any

from spectral_core.scene.shading.registry import operation
from spectral_core.scene.shading.textures.noise import hashed
from spectral_core.scene.shading.tuples import clip, length, normalized, safe_divide

_PER_CELL = 8
_LEAST_FREQUENCY = 0.001
_SIGMAS = 6.0
"""Standard deviations that Blender maps to 1."""
_DEVIATION = {2: sqrt(_PER_CELL * 0.5 * 0.25), 3: sqrt(_PER_CELL * 0.5 / (4.0 * sqrt(2.0)))}
"""Standard deviation of the noise by its dimensions: equation 9 of Lagae, in the limit of a high frequency."""

_KEY_ORDERS = {2: ((0, 1, 2), (2, 0, 1)), 3: ((0, 1, 2, 3), (2, 0, 3, 1), (3, 2, 1, 0))}
"""Orders of a cell's coordinates and its seed: each gives another random number."""


@operation("3 1 1 1 1 3", 3)
def gabor(
    xp: Any, vector: Any, scale: Any, frequency: Any, anisotropy: Any, angle: Any, direction: Any, dimensions: int
) -> Any:
    """Gabor Texture: value, phase and intensity, each in 0 to 1 but for rare values and intensities beyond."""
    p = tuple(xp.number(x) * scale for x in vector[:dimensions])
    frequency = xp.maximum(frequency + 0.0 * p[0], _LEAST_FREQUENCY)
    isotropy = 1.0 - clip(xp, anisotropy + 0.0 * p[0])
    if dimensions == 2:
        turned = lambda seed: _in_plane(xp, seed, angle, isotropy)  # noqa: E731
    else:
        base = _spherical(xp, normalized(xp, direction))
        turned = lambda seed: _in_space(xp, seed, base, isotropy)  # noqa: E731
    real, imaginary = _phasor(xp, p, frequency, turned)
    most = _SIGMAS * _DEVIATION[dimensions]
    phase = (xp.atan2(imaginary, real) + pi) / (2 * pi)
    return imaginary / most * 0.5 + 0.5, phase, xp.sqrt(real * real + imaginary * imaginary) / most


def _random(xp: Any, seed: tuple[Any, ...], count: int) -> tuple[Any, ...]:
    """``count`` numbers in [0, 1] from a cell's coordinates and a seed."""
    return tuple(hashed(xp, *(seed[k] for k in order)) for order in _KEY_ORDERS[len(seed) - 1][:count])


def _in_plane(xp: Any, seed: tuple[Any, ...], angle: Any, isotropy: Any) -> tuple[Any, ...]:
    (number,) = _random(xp, seed, 1)
    turned = angle + (number - 0.5) * pi * isotropy  # half a turn covers all, because a wave has no sign
    return xp.cos(turned), xp.sin(turned)


def _spherical(xp: Any, direction: Any) -> tuple[Any, Any, Any]:
    """The direction, its inclination and its azimuth."""
    x, y, z = direction
    level = length(xp, (x, y, 0.0 * z))
    azimuth = xp.acos(safe_divide(xp, x, level))
    return direction, xp.acos(z), xp.where(y < 0.0, -azimuth, azimuth)


def _in_space(xp: Any, seed: tuple[Any, ...], base: tuple[Any, Any, Any], isotropy: Any) -> tuple[Any, ...]:
    direction, inclination, azimuth = base
    first, second = _random(xp, seed, 2)
    inclination, azimuth = inclination + first * pi * isotropy, azimuth + second * pi * isotropy
    sine = xp.sin(inclination)
    turned = (sine * xp.cos(azimuth), sine * xp.sin(azimuth), xp.cos(inclination))
    # the angles would lose digits of a direction that is not turned
    return tuple(xp.where(isotropy == 0.0, d, t) for d, t in zip(direction, turned, strict=True))


def _phasor(xp: Any, p: tuple[Any, ...], frequency: Any, turned: Any) -> tuple[Any, Any]:
    """Real and imaginary part of the sum of all kernels within a distance of 1 (Tricard's equation 7)."""
    cell = tuple(xp.floor(x) for x in p)
    within = tuple(x - c for x, c in zip(p, cell, strict=True))
    zero = 0.0 * p[0]

    def body(number: Any, real: Any, imaginary: Any) -> Any:
        rest = xp.floor((number + 0.5) / _PER_CELL)
        kernel = number - rest * _PER_CELL
        offset = []
        for _ in p:
            whole = xp.floor((rest + 0.5) / 3.0)
            offset.append(rest - whole * 3.0 - 1.0)
            rest = whole
        there = tuple(c + o for c, o in zip(cell, offset, strict=True))
        seeds = [(*there, kernel * 3.0 + k) for k in range(3)]
        center = _random(xp, seeds[1], len(p))
        apart = tuple(x - o - q for x, o, q in zip(within, offset, center, strict=True))
        squared = sum(d * d for d in apart)
        (coin,) = _random(xp, seeds[2], 1)
        # a Gaussian, which a Hann window ends smoothly at a distance of 1
        window = xp.exp(-pi * squared) * (0.5 + 0.5 * xp.cos(pi * squared))
        weight = xp.where(squared >= 1.0, 0.0, xp.where(coin < 0.5, -window, window))
        wave = 2 * pi * frequency * sum(d * t for d, t in zip(apart, turned(seeds[0]), strict=True))
        return number + 1.0, real + weight * xp.cos(wave), imaginary + weight * xp.sin(wave)

    kernels = float(3 ** len(p) * _PER_CELL)
    _, real, imaginary = xp.loop((zero, zero, zero), lambda number, *_: number < kernels, body)
    return real, imaginary

# SPDX-License-Identifier: GPL-3.0-or-later
"""Perlin noise, its fractals and White Noise, number for number as Blender's shaders compute them."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, partial
from typing import Any

import numpy as np

from spectral_core.scene.shading.numpy_backend import NumPy
from spectral_core.scene.shading.registry import operation
from spectral_core.scene.shading.tuples import clip, mix, safe_divide

_SEED = 0xDEADBEEF + 13
_LARGEST = 1.0 / 4294967295.0


def _turn(x: Any, k: int) -> Any:
    return (x << k) | (x >> (32 - k))


def jenkins(xp: Any, *keys: Any) -> Any:
    """Bob Jenkins' lookup3 of one to four 32-bit keys (Blender's ``hash_uint`` to ``hash_uint4``)."""
    start = 0 * keys[0] + (_SEED + (len(keys) << 2)) % 2**32
    a, b, c = start + keys[0], start, start
    if len(keys) > 1:
        b = b + keys[1]
    if len(keys) > 2:
        c = c + keys[2]
    if len(keys) > 3:
        for shift in (4, 6, 8, 16, 19, 4):
            a = a - c
            a = a ^ _turn(c, shift)
            c = c + b
            a, b, c = b, c, a  # the six steps of Blender are this one, each with the names rotated
        a = a + keys[3]
    for shift in (14, 11, 25, 16, 4, 14, 24):
        c = c ^ b
        c = c - _turn(b, shift)
        a, b, c = b, c, a
    # seven steps rotate the names by one: Blender's result c is now in b
    return b


def unit(xp: Any, pattern: Any) -> Any:
    """A 32-bit pattern as a number in [0, 1]."""
    return xp.real(pattern) * _LARGEST


def hashed(xp: Any, *values: Any) -> Any:
    """Hash of one to four numbers, in [0, 1] (Blender's ``hash_float…_to_float``)."""
    return unit(xp, jenkins(xp, *(xp.bits(value) for value in values)))


def hashed_vector(xp: Any, *values: Any) -> Any:
    """Hash of one to four numbers to three in [0, 1] (``hash_float…_to_float3``)."""
    if len(values) == 1:
        return hashed(xp, *values), hashed(xp, *values, 1.0 + 0 * values[0]), hashed(xp, *values, 2.0 + 0 * values[0])
    if len(values) == 2 or len(values) == 3:
        extended = [(*values, 1.0 + 0 * values[0]), (*values, 2.0 + 0 * values[0])]
    else:
        x, y, z, w = values
        extended = [(z, x, w, y), (w, z, y, x)]
    return (hashed(xp, *values), *(hashed(xp, *key) for key in extended))


def _negated(xp: Any, value: Any, pattern: Any, bit: int) -> Any:
    return xp.where((pattern & bit) != 0, -value, value)


def _gradient(xp: Any, pattern: Any, p: tuple[Any, ...]) -> Any:
    if len(p) == 1:
        h = pattern & 15
        size = 1.0 + xp.real(h & 7)
        return _negated(xp, size * p[0], h, 8)
    if len(p) == 2:
        h = pattern & 7
        u, v = xp.where(h < 4, p[0], p[1]), 2.0 * xp.where(h < 4, p[1], p[0])
        return _negated(xp, u, h, 1) + _negated(xp, v, h, 2)
    if len(p) == 3:
        h = pattern & 15
        u = xp.where(h < 8, p[0], p[1])
        v = xp.where(h < 4, p[1], xp.where((h == 12) | (h == 14), p[0], p[2]))
        return _negated(xp, u, h, 1) + _negated(xp, v, h, 2)
    h = pattern & 31
    u, v, s = xp.where(h < 24, p[0], p[1]), xp.where(h < 16, p[1], p[2]), xp.where(h < 8, p[2], p[3])
    return _negated(xp, u, h, 1) + _negated(xp, v, h, 2) + _negated(xp, s, h, 4)


_SCALES = {1: 0.25, 2: 0.6616, 3: 0.9820, 4: 0.8344}


def perlin(xp: Any, p: tuple[Any, ...]) -> Any:
    """Signed Perlin noise in one to four dimensions (``snoise``): it repeats after 100,000."""
    p = tuple(xp.number(x) for x in p)
    p = tuple(x - 100000.0 * xp.trunc(x / 100000.0) + xp.where(xp.absolute(x) >= 1e6, 0.5, 0.0) for x in p)
    cell = tuple(xp.floor(x) for x in p)
    place = tuple(x - c for x, c in zip(p, cell, strict=True))
    low = tuple(xp.integer(c) for c in cell)
    fade = [t * t * t * (t * (t * 6.0 - 15.0) + 10.0) for t in place]
    values = []
    for corner in range(1 << len(p)):
        steps = [(corner >> k) & 1 for k in range(len(p))]
        pattern = jenkins(xp, *(c + s for c, s in zip(low, steps, strict=True)))
        values.append(_gradient(xp, pattern, tuple(x - s for x, s in zip(place, steps, strict=True))))
    for factor in fade:
        values = [mix(values[k], values[k + 1], factor) for k in range(0, len(values), 2)]
    return values[0] * _SCALES[len(p)]


def _scaled(p: tuple[Any, ...], factor: Any) -> tuple[Any, ...]:
    return tuple(x * factor for x in p)


def fbm(xp: Any, p: Any, detail: Any, rough: Any, lac: Any, offset: Any, gain: Any, normalizes: bool) -> Any:
    """Fractal Brownian motion with a fraction of the last octave."""
    zero = 0.0 * p[0]
    whole, rest = xp.floor(detail), detail - xp.floor(detail)

    def body(octave: Any, scale: Any, size: Any, largest: Any, total: Any) -> Any:
        # the octave after the last integer one has the weight of the fractional detail
        share = xp.where(octave > whole, rest, 1.0)
        value = total + perlin(xp, _scaled(p, scale)) * size
        most = largest + size
        if normalizes:
            before = 0.5 * safe_divide(xp, total, largest) + 0.5
            after = 0.5 * safe_divide(xp, value, most) + 0.5
            mixed = mix(before, after, share)
            # stored as a sum, so that the loop's last division gives the mix again
            value, most = xp.where(octave > whole, mixed * 2.0 - 1.0, value), xp.where(octave > whole, 1.0, most)
        else:
            value = mix(total, value, share)
        return octave + 1.0, scale * lac, size * rough, most, value

    def goes_on(octave: Any, *_: Any) -> Any:
        return (octave <= whole) | ((octave <= whole + 1.0) & (rest > 0.0))

    start = (zero, zero + 1.0, zero + 1.0, zero, zero)
    _, _, _, largest, total = xp.loop(start, goes_on, body)
    return 0.5 * safe_divide(xp, total, largest) + 0.5 if normalizes else total


def multifractal(xp: Any, p: Any, detail: Any, rough: Any, lac: Any, offset: Any, gain: Any, normalizes: bool) -> Any:
    """Octaves multiplied."""
    zero = 0.0 * p[0]

    def body(octave: Any, scale: Any, power: Any, value: Any) -> Any:
        share = clip(xp, detail - octave + 1.0)
        share = xp.where(octave <= xp.floor(detail), 1.0, share)
        value = value * (share * power * perlin(xp, _scaled(p, scale)) + 1.0)
        return octave + 1.0, scale * lac, power * rough, value

    start = (zero, zero + 1.0, zero + 1.0, zero + 1.0)
    return xp.loop(start, lambda octave, *_: octave < detail + 1.0, body)[3]


def hetero_terrain(xp: Any, p: Any, detail: Any, rough: Any, lac: Any, offset: Any, gain: Any, normalizes: bool) -> Any:
    """Octaves weighted by the height so far."""
    value = offset + perlin(xp, p)

    def body(octave: Any, scale: Any, power: Any, value: Any) -> Any:
        share = xp.where(octave <= xp.floor(detail), 1.0, clip(xp, detail - octave + 1.0))
        grown = (perlin(xp, _scaled(p, scale)) + offset) * power * value
        return octave + 1.0, scale * lac, power * rough, value + share * grown

    zero = 0.0 * p[0]
    start = (zero + 1.0, zero + lac, zero + rough, value)
    return xp.loop(start, lambda octave, *_: octave < detail + 1.0, body)[3]


def hybrid(xp: Any, p: Any, detail: Any, rough: Any, lac: Any, offset: Any, gain: Any, normalizes: bool) -> Any:
    """Octaves weighted by the signal so far."""
    zero = 0.0 * p[0]

    def body(octave: Any, scale: Any, power: Any, value: Any, weight: Any) -> Any:
        held = xp.minimum(weight, 1.0)
        share = xp.where(octave <= xp.floor(detail), 1.0, clip(xp, detail - octave + 1.0))
        signal = (perlin(xp, _scaled(p, scale)) + offset) * power
        return octave + 1.0, scale * lac, power * rough, value + share * held * signal, held * gain * signal

    start = (zero, zero + 1.0, zero + 1.0, zero, zero + 1.0)
    keep = lambda octave, _s, _p, _v, weight: (octave < detail + 1.0) & (weight > 0.001)  # noqa: E731
    return xp.loop(start, keep, body)[3]


def ridged(xp: Any, p: Any, detail: Any, rough: Any, lac: Any, offset: Any, gain: Any, normalizes: bool) -> Any:
    """Octaves of sharp ridges."""
    signal = offset - xp.absolute(perlin(xp, p))
    signal = signal * signal

    def body(octave: Any, scale: Any, power: Any, value: Any, signal: Any) -> Any:
        weight = clip(xp, signal * gain)
        signal = offset - xp.absolute(perlin(xp, _scaled(p, scale)))
        signal = signal * signal * weight
        return octave + 1.0, scale * lac, power * rough, value + signal * power, signal

    zero = 0.0 * p[0]
    start = (zero + 1.0, zero + lac, zero + rough, signal, signal)
    return xp.loop(start, lambda octave, *_: octave <= xp.floor(detail), body)[3]


FRACTALS: dict[str, Callable[..., Any]] = {
    "FBM": fbm, "MULTIFRACTAL": multifractal, "HETERO_TERRAIN": hetero_terrain, "HYBRID_MULTIFRACTAL": hybrid,
    "RIDGED_MULTIFRACTAL": ridged,
}  # fmt: skip


def coordinates(vector: Any, w: Any, dimensions: str) -> tuple[Any, ...]:
    """The coordinates of a texture of the given number of dimensions."""
    return {"1D": (w,), "2D": vector[:2], "3D": tuple(vector), "4D": (*vector, w)}[dimensions]


@cache
def _offset(seed: int, count: int) -> tuple[float, ...]:
    """Offset of the noise number ``seed``, which makes it independent of the others."""
    xp, key = NumPy(np.float32), np.full(1, seed, np.float32)
    keys = [(key,)] if count == 1 else [(key, np.full(1, k, np.float32)) for k in range(count)]
    return tuple(float(100.0 + np.float32(hashed(xp, *each)[0]) * np.float32(100.0)) for each in keys)


def _distorted(xp: Any, p: tuple[Any, ...], distortion: Any) -> tuple[Any, ...]:
    """Coordinates moved by noise; where nothing is distorted, none is computed."""
    count = len(p)

    def body(left: Any, *place: Any) -> tuple[Any, ...]:
        moves = [perlin(xp, tuple(x + o for x, o in zip(p, _offset(k, count), strict=True))) for k in range(count)]
        there = (x + move * distortion for x, move in zip(place, moves, strict=True))
        return (xp.where(left != 0.0, 0.0, left), *there)

    return tuple(xp.loop((distortion + 0.0 * p[0], *p), lambda left, *_: left != 0.0, body)[1:])


def _noise(xp: Any, inputs: tuple[Any, ...], kind: str, normalizes: bool, dimensions: str, outputs: range) -> list[Any]:
    vector, w, scale, detail, rough, lac, offset, gain, distortion = inputs
    p = tuple(x * scale for x in coordinates(vector, w, dimensions))
    count = len(p)
    detail, rough = clip(xp, detail, 0.0, 15.0), xp.maximum(rough, 0.0)
    p = _distorted(xp, p, distortion)
    fractal = partial(FRACTALS[kind], xp)
    found = []
    for output in outputs:
        shift = _offset(count - 1 + output, count)
        place = p if output == 0 else tuple(x + o for x, o in zip(p, shift, strict=True))
        found.append(fractal(place, detail, rough, lac, offset, gain, normalizes))
    return found


@operation("3 1 1 1 1 1 1 1 1", 1)
def noise(xp: Any, *inputs: Any) -> Any:
    """Noise Texture's number: vector, w, scale, detail, roughness, lacunarity, offset, gain, distortion."""
    *values, kind, normalizes, dimensions = inputs
    return _noise(xp, tuple(values), kind, normalizes, dimensions, range(1))[0]


@operation("3 1 1 1 1 1 1 1 1", 3)
def noise_color(xp: Any, *inputs: Any) -> Any:
    """Noise Texture's color."""
    *values, kind, normalizes, dimensions = inputs
    return tuple(_noise(xp, tuple(values), kind, normalizes, dimensions, range(3)))


@operation("3 1", 1)
def white_noise(xp: Any, vector: Any, w: Any, dimensions: str) -> Any:
    """White Noise's number."""
    return hashed(xp, *coordinates(vector, w, dimensions))


@operation("3 1", 3)
def white_noise_color(xp: Any, vector: Any, w: Any, dimensions: str) -> Any:
    """White Noise's color."""
    return hashed_vector(xp, *coordinates(vector, w, dimensions))

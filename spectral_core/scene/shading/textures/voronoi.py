# SPDX-License-Identifier: GPL-3.0-or-later
"""Voronoi texture of Blender 5.0: cells are hashed with PCG, octaves add up.

Source: Jarzynski and Olano 2020, "Hash functions for GPU rendering" (PCG), in Blender's signed form.
"""

from __future__ import annotations

from typing import Any

from spectral_core.scene.shading.registry import operation
from spectral_core.scene.shading.textures.cells import cell_numbers, point_in_cell
from spectral_core.scene.shading.textures.noise import coordinates
from spectral_core.scene.shading.tuples import clip, mix, safe_divide


def _distance(xp: Any, a: tuple[Any, ...], b: tuple[Any, ...], metric: str, exponent: Any) -> Any:
    apart = [xp.absolute(x - y) for x, y in zip(a, b, strict=True)]
    if len(apart) == 1:
        return apart[0]
    if metric == "EUCLIDEAN":
        return xp.sqrt(sum(d * d for d in apart))
    if metric == "MANHATTAN":
        return sum(apart)
    if metric == "CHEBYCHEV":
        largest = apart[0]
        for d in apart[1:]:
            largest = xp.maximum(largest, d)
        return largest
    total = sum(xp.where(d > 0.0, xp.power(xp.maximum(d, 1e-30), exponent), 0.0) for d in apart)
    return xp.where(total > 0.0, xp.power(xp.maximum(total, 1e-30), 1.0 / exponent), 0.0)


def _offset_of(xp: Any, number: Any, count: int, reach: int) -> tuple[Any, ...]:
    """Offset of the ``number``-th neighbor, x fastest."""
    side = 2 * reach + 1
    parts = []
    for _ in range(count):
        whole = xp.floor((number + 0.5) * (1.0 / side))
        parts.append(number - whole * side - float(reach))
        number = whole
    return tuple(parts)


def _nearest(xp: Any, p: tuple[Any, ...], random: Any, metric: str, exponent: Any, second: bool) -> tuple[Any, ...]:
    """Distance, hashed color and position of the nearest point, or of the second nearest."""
    count = len(p)
    cell = tuple(xp.floor(x) for x in p)
    within = tuple(x - c for x, c in zip(p, cell, strict=True))
    zero, far = 0.0 * p[0], 0.0 * p[0] + 8e30
    blank = (zero,) * count

    def first(number: Any, best: Any, *rest: Any) -> Any:
        new = _offset_of(xp, number, count, 1)
        placed = point_in_cell(xp, tuple(c + o for c, o in zip(cell, new, strict=True)))
        candidate = tuple(o + q * random for o, q in zip(new, placed, strict=True))
        distance = _distance(xp, candidate, within, metric, exponent)
        nearer = distance < best
        kept = (xp.where(nearer, a, b) for a, b in zip((*new, *candidate), rest, strict=True))
        return (number + 1.0, xp.where(nearer, distance, best), *kept)

    def both(number: Any, best: Any, next_best: Any, *rest: Any) -> Any:
        offset, point = rest[:count], rest[count : 2 * count]
        next_offset, next_point = rest[2 * count : 3 * count], rest[3 * count :]
        new = _offset_of(xp, number, count, 1)
        placed = point_in_cell(xp, tuple(c + o for c, o in zip(cell, new, strict=True)))
        candidate = tuple(o + q * random for o, q in zip(new, placed, strict=True))
        distance = _distance(xp, candidate, within, metric, exponent)
        nearer = distance < best
        runner = ~nearer & (distance < next_best)
        pick = lambda flag, a, b: tuple(xp.where(flag, x, y) for x, y in zip(a, b, strict=True))  # noqa: E731
        next_offset = pick(nearer, offset, pick(runner, new, next_offset))
        next_point = pick(nearer, point, pick(runner, candidate, next_point))
        next_best = xp.where(nearer, best, xp.where(runner, distance, next_best))
        best = xp.where(nearer, distance, best)
        offset, point = pick(nearer, new, offset), pick(nearer, candidate, point)
        return (number + 1.0, best, next_best, *offset, *point, *next_offset, *next_point)

    goes_on = lambda number, *_: number < float(3**count)  # noqa: E731
    if second:
        found = xp.loop((zero, far, far, *blank, *blank, *blank, *blank), goes_on, both)
        distance, rest = found[2], found[3 + 2 * count :]
    else:
        found = xp.loop((zero, far, *blank, *blank), goes_on, first)
        distance, rest = found[1], found[2:]
    offset, point = rest[:count], rest[count:]
    color = cell_numbers(xp, tuple(c + o for c, o in zip(cell, offset, strict=True)))[:3]
    return (distance, *color, *(c + q for c, q in zip(cell, point, strict=True)))


def _smooth(xp: Any, p: tuple[Any, ...], random: Any, metric: str, exponent: Any, smoothness: Any) -> tuple[Any, ...]:
    """Nearest point with a soft minimum over the neighborhood."""
    count = len(p)
    cell = tuple(xp.floor(x) for x in p)
    within = tuple(x - c for x, c in zip(p, cell, strict=True))
    zero = 0.0 * p[0]
    soft = xp.maximum(clip(xp, smoothness / 2.0, 0.0, 0.5), 1e-6)

    def body(number: Any, smallest: Any, *rest: Any) -> Any:
        color, point = rest[:3], rest[3:]
        new = _offset_of(xp, number, count, 2)
        there = tuple(c + o for c, o in zip(cell, new, strict=True))
        candidate = tuple(o + q * random for o, q in zip(new, point_in_cell(xp, there), strict=True))
        distance = _distance(xp, candidate, within, metric, exponent)
        t = clip(xp, 0.5 + 0.5 * (smallest - distance) / soft)
        h = xp.where(number == 0.0, 1.0, t * t * (3.0 - 2.0 * t))
        correction = soft * h * (1.0 - h)
        smallest = mix(smallest, distance, h) - correction
        correction = correction / (1.0 + 3.0 * soft)
        hashes = cell_numbers(xp, there)[:3]
        color = tuple(mix(a, b, h) - correction for a, b in zip(color, hashes, strict=True))
        point = tuple(mix(a, b, h) - correction for a, b in zip(point, candidate, strict=True))
        return (number + 1.0, smallest, *color, *point)

    start = (zero, zero, zero, zero, zero, *((zero,) * count))
    found = xp.loop(start, lambda number, *_: number < float(5**count), body)
    return (found[1], *found[2:5], *(c + q for c, q in zip(cell, found[5:], strict=True)))


def _edge(xp: Any, p: tuple[Any, ...], random: Any) -> Any:
    """Distance to the border of the cell."""
    count = len(p)
    cell = tuple(xp.floor(x) for x in p)
    within = tuple(x - c for x, c in zip(p, cell, strict=True))
    zero = 0.0 * p[0]

    def toward(number: Any) -> tuple[Any, ...]:
        new = _offset_of(xp, number, count, 1)
        placed = point_in_cell(xp, tuple(c + o for c, o in zip(cell, new, strict=True)))
        return tuple(o + q * random - x for o, q, x in zip(new, placed, within, strict=True))

    def nearest(number: Any, best: Any, *vector: Any) -> Any:
        candidate = toward(number)
        distance = sum(d * d for d in candidate)
        nearer = distance < best
        kept = (xp.where(nearer, a, b) for a, b in zip(candidate, vector, strict=True))
        return (number + 1.0, xp.where(nearer, distance, best), *kept)

    size = float(3**count)
    start = (zero, zero + 8e30, *((zero,) * count))
    closest = xp.loop(start, lambda number, *_: number < size, nearest)[2:]

    def border(number: Any, smallest: Any) -> Any:
        candidate = toward(number)
        apart = tuple(a - b for a, b in zip(candidate, closest, strict=True))
        square = sum(d * d for d in apart)
        size = xp.sqrt(xp.maximum(square, 1e-30))
        middle = sum((a + b) * 0.5 * d / size for a, b, d in zip(candidate, closest, apart, strict=True))
        return number + 1.0, xp.where(square > 0.0001, xp.minimum(smallest, middle), smallest)

    return xp.loop((zero, zero + 8e30), lambda number, _: number < size, border)[1]


def _sphere_radius(xp: Any, p: tuple[Any, ...], random: Any) -> Any:
    """Half the distance from the nearest point to its nearest neighbor."""
    count = len(p)
    cell = tuple(xp.floor(x) for x in p)
    within = tuple(x - c for x, c in zip(p, cell, strict=True))
    zero = 0.0 * p[0]

    def nearest(number: Any, best: Any, *rest: Any) -> Any:
        new = _offset_of(xp, number, count, 1)
        placed = point_in_cell(xp, tuple(c + o for c, o in zip(cell, new, strict=True)))
        candidate = tuple(o + q * random for o, q in zip(new, placed, strict=True))
        distance = _distance(xp, candidate, within, "EUCLIDEAN", 0.5)
        nearer = distance < best
        kept = (xp.where(nearer, a, b) for a, b in zip((*candidate, *new), rest, strict=True))
        return (number + 1.0, xp.where(nearer, distance, best), *kept)

    size = float(3**count)
    start = (zero, zero + 8e30, *((zero,) * (2 * count)))
    rest = xp.loop(start, lambda number, *_: number < size, nearest)[2:]
    point, home = rest[:count], rest[count:]

    def neighbor(number: Any, best: Any) -> Any:
        step = _offset_of(xp, number, count, 1)
        new = tuple(s + h for s, h in zip(step, home, strict=True))
        placed = point_in_cell(xp, tuple(c + o for c, o in zip(cell, new, strict=True)))
        candidate = tuple(o + q * random for o, q in zip(new, placed, strict=True))
        distance = _distance(xp, candidate, point, "EUCLIDEAN", 0.5)
        itself = sum(xp.absolute(s) for s in step) < 0.5
        return number + 1.0, xp.where(itself, best, xp.minimum(best, distance))

    return 0.5 * xp.loop((zero, zero + 8e30), lambda number, _: number < size, neighbor)[1]


def _octave(xp: Any, p: tuple[Any, ...], inputs: tuple[Any, ...], feature: str, metric: str) -> tuple[Any, ...]:
    smoothness, exponent, random = inputs
    if feature == "SMOOTH_F1":
        return _smooth(xp, p, random, metric, exponent, smoothness)
    return _nearest(xp, p, random, metric, exponent, feature == "F2")


def _voronoi(xp: Any, values: tuple[Any, ...], feature: str, metric: str, normalizes: bool, dimensions: str) -> Any:
    """Distance, color (3) and position, of all octaves together."""
    vector, w, scale, detail, rough, lac, smoothness, exponent, random = values
    p = tuple(x * scale for x in coordinates(vector, w, dimensions))
    count = len(p)
    detail, rough, random = clip(xp, detail, 0.0, 15.0), clip(xp, rough), clip(xp, random)
    inputs = (smoothness, exponent, random)
    zero = 0.0 * p[0]
    single = (detail == 0.0) | (rough == 0.0)
    last = xp.where(single, 0.0, xp.ceil(detail))

    def body(octave: Any, size: Any, factor: Any, largest: Any, *total: Any) -> Any:
        found = _octave(xp, tuple(x * factor for x in p), inputs, feature, metric)
        found = (*found[:4], *(q / factor for q in found[4:]))
        share = xp.where(single | (octave <= detail), 1.0, detail - xp.floor(detail))
        amount = xp.where(single, 1.0, size)
        sums = [mix(a, a + b * amount, share) for a, b in zip(total[:4], found[:4], strict=True)]
        places = [mix(a, mix(a, b, amount), share) for a, b in zip(total[4:], found[4:], strict=True)]
        return (octave + 1.0, size * rough, factor * lac, mix(largest, largest + amount, share), *sums, *places)

    start = (zero, zero + 1.0, zero + 1.0, zero, *((zero,) * (4 + count)))
    found = xp.loop(start, lambda octave, *_: octave <= last, body)
    largest, distance, color, place = found[3], found[4], found[5:8], found[8:]
    if normalizes:
        reach = (zero + 0.5 + 0.5 * random,) * count
        most = _distance(xp, (zero,) * count, reach, metric, exponent) * (2.0 if feature == "F2" else 1.0)
        distance = safe_divide(xp, distance, largest * most)
        color = tuple(safe_divide(xp, c, largest) for c in color)
    return distance, color, tuple(safe_divide(xp, q, scale + zero) for q in place)


WIDTHS = "3 1 1 1 1 1 1 1 1"
"""Vector, w, scale, detail, roughness, lacunarity, smoothness, exponent, randomness."""


@operation(WIDTHS, 1)
def voronoi_distance(xp: Any, *inputs: Any) -> Any:
    """Voronoi Texture's Distance of F1, F2 and Smooth F1."""
    return _voronoi(xp, inputs[:9], *inputs[9:])[0]


@operation(WIDTHS, 3)
def voronoi_color(xp: Any, *inputs: Any) -> Any:
    """Voronoi Texture's Color."""
    return _voronoi(xp, inputs[:9], *inputs[9:])[1]


@operation(WIDTHS, 3)
def voronoi_position(xp: Any, *inputs: Any) -> Any:
    """Voronoi Texture's Position; missing dimensions are 0."""
    place = _voronoi(xp, inputs[:9], *inputs[9:])[2]
    zero = 0.0 * place[0]
    return tuple(place[:3]) if len(place) >= 3 else (*place, *((zero,) * (3 - len(place)))) if len(place) == 2 else (
        zero, zero, zero,
    )  # fmt: skip


@operation(WIDTHS, 1)
def voronoi_w(xp: Any, *inputs: Any) -> Any:
    """Voronoi Texture's W in one and four dimensions."""
    place = _voronoi(xp, inputs[:9], *inputs[9:])[2]
    return place[-1] if len(place) in (1, 4) else 0.0 * place[0]


@operation(WIDTHS, 1)
def voronoi_edge(xp: Any, *inputs: Any) -> Any:
    """Voronoi Texture's Distance to Edge: octaves take the smallest."""
    (vector, w, scale, detail, rough, lac, _, _, random), (_, _, normalizes, dimensions) = inputs[:9], inputs[9:]
    p = tuple(x * scale for x in coordinates(vector, w, dimensions))
    detail, rough, random = clip(xp, detail, 0.0, 15.0), clip(xp, rough), clip(xp, random)
    zero = 0.0 * p[0]
    single = (detail == 0.0) | (rough == 0.0)
    reach = 0.5 + 0.5 * random

    def body(octave: Any, size: Any, factor: Any, largest: Any, distance: Any) -> Any:
        found = _edge(xp, tuple(x * factor for x in p), random)
        part = detail - xp.floor(detail)
        whole = octave <= detail
        full = mix(distance, xp.minimum(distance, found / factor), size)
        smaller = mix(distance, full, part)
        distance = xp.where(single, found, xp.where(whole, full, smaller))
        largest_now = mix(largest, reach / factor, size)
        largest = xp.where(single, reach, xp.where(whole, largest_now, mix(largest, largest_now, part)))
        return octave + 1.0, size * rough, factor * lac, largest, distance

    last = xp.where(single, 0.0, xp.ceil(detail))
    start = (zero, zero + 1.0, zero + 1.0, reach + zero, zero + 8.0)
    _, _, _, largest, distance = xp.loop(start, lambda octave, *_: octave <= last, body)
    return distance / largest if normalizes else distance


@operation(WIDTHS, 1)
def voronoi_radius(xp: Any, *inputs: Any) -> Any:
    """Voronoi Texture's N-Sphere Radius."""
    vector, w, scale, _, _, _, _, _, random = inputs[:9]
    p = tuple(x * scale for x in coordinates(vector, w, inputs[12]))
    return _sphere_radius(xp, p, clip(xp, random))

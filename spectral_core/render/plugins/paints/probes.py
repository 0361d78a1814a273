# SPDX-License-Identifier: GPL-3.0-or-later
"""Rays that a shading program sends from the hit itself: Ambient Occlusion and Bevel, as Cycles' nodes take them.

A program runs several times at one hit with equal results, so its random numbers are computed from the position
alone; positions differ from sample to sample, which averages the remaining noise. Bounds of loops are literals:
with opaque numbers made here, within the loop over path vertices, a recorded launch of the viewport did not end.
"""

from __future__ import annotations

from math import pi
from typing import Any

from spectral_core.render.plugins.paints.tables import SceneTables

FIRST, SECOND = 0.7548776662466927, 0.5698402909980532
"""Steps of the two coordinates of an even sequence (Roberts 2018, "R2")."""
MOST_HITS = 8
"""Surfaces of one object that one probe of Bevel meets."""
SHARES = (0.5, 0.25, 0.25)
"""Shares of Bevel's probes along the normal and along the two directions across it."""
MOST_PASSED = 32
"""Other objects that a ray passes which looks for its own object alone."""


class Probes:
    """Rays from one hit into the scene that it is of."""

    def __init__(self, tables: SceneTables, si: Any, active: Any) -> None:
        self.tables, self.mi, self.dr, self.si = tables, tables.mi, tables.dr, si
        self.scene, self.active = tables.scene(), self.mi.Bool(active)

    def _draws(self) -> tuple[Any, Any]:
        """Two numbers in [0, 1) that depend on the position alone."""
        mi, dr, p = self.mi, self.dr, self.si.p
        x, y, z = (dr.reinterpret_array(mi.UInt32, c) for c in (p.x, p.y, p.z))
        first, second = mi.sample_tea_32(x ^ (z * 0x9E3779B1), y + (z >> 7), 5)
        return mi.Float(first >> 8) * (1.0 / (1 << 24)), mi.Float(second >> 8) * (1.0 / (1 << 24))

    def _pair(self, start: tuple[Any, Any], index: Any) -> tuple[Any, Any]:
        """The numbers of one of several rays."""
        first, second = start[0] + self.mi.Float(index) * FIRST, start[1] + self.mi.Float(index) * SECOND
        return first - self.dr.floor(first), second - self.dr.floor(second)

    def _owner(self, si: Any) -> Any:
        """Number of the object of a hit, the same for all its materials."""
        mi, dr = self.mi, self.dr
        placed, own = (dr.reinterpret_array(mi.UInt32, pointer) for pointer in (si.instance, si.shape))
        return self.tables.owner(dr.select(placed != 0, placed, own), self.active)

    def open_share(self, normal: Any, distance: Any, samples: int, *, inside: bool, own: bool) -> Any:
        """Share of rays, by the cosine about ``normal``, that meet nothing (``own``: nothing of the object) nearby."""
        mi, dr = self.mi, self.dr
        axis = mi.Vector3f(*normal) * (-1.0 if inside else 1.0)
        frame, start, count = mi.Frame3f(axis), self._draws(), mi.UInt32(samples)
        distance, mine = mi.Float(distance), self._owner(self.si) if own else None
        active = self.active & (distance > 0.0)

        def body(index: Any, free: Any) -> tuple[Any, Any]:
            direction = frame.to_world(mi.warp.square_to_cosine_hemisphere(mi.Point2f(*self._pair(start, index))))
            ray = self.si.spawn_ray(direction)
            ray.maxt = mi.Float(distance)
            plain = mine is None and not self.tables.has_bodies
            met = self.scene.ray_test(ray, active) if plain else self._meets(ray, mine, active)
            return index + 1, free + dr.select(met, mi.UInt32(0), 1)

        begin = mi.UInt32(0), mi.UInt32(0)
        _, free = dr.while_loop(begin, lambda index, _: active & (index < count), body, label="occlusion")
        return dr.select(active, mi.Float(free) / mi.Float(count), 1.0)

    def _meets(self, ray: Any, mine: Any, active: Any) -> Any:
        """True if a ray hits the object ``mine``, whatever else is before it; None for any object other than bodies of
        lamps.
        """
        mi, dr = self.mi, self.dr

        def body(origin: Any, rest: Any, layers: Any, met: Any, walking: Any) -> tuple[Any, ...]:
            probe = mi.Ray3f(ray)
            probe.o, probe.maxt = origin, rest
            si = self._hit(probe, walking)
            owner = self._owner(si)
            met |= walking & si.is_valid() & (owner != 0.0 if mine is None else owner == mine)
            onward = walking & si.is_valid() & ~met & (layers + 1 < MOST_PASSED)
            after = si.spawn_ray(ray.d).o
            return dr.select(onward, after, origin), dr.select(onward, rest - si.t, rest), layers + 1, met, onward

        begin = mi.Point3f(ray.o), mi.Float(ray.maxt), mi.UInt32(0), mi.Bool(False), mi.Bool(active)
        return dr.while_loop(begin, lambda _o, _r, _l, _m, walking: walking, body, label="own occlusion")[3]

    def _hit(self, ray: Any, active: Any) -> Any:
        return self.tables.meshes.intersect(self.scene, ray, False, active)

    def rounded(self, normal: Any, radius: Any, samples: int, *, wanted: Any) -> Any:
        """Mean normal of the object's surface around the hit, by Cycles' cubic weight, on the side of ``normal``.

        The weight falls from the hit to ``radius`` (King et al. 2013, "BSSRDF importance sampling": probes along three
        axes, weighed against each other).
        """
        mi, dr, si = self.mi, self.dr, self.si
        radius = mi.Float(radius)
        active = self.active & (radius > 0.0) & wanted
        start, count, mine = self._draws(), mi.UInt32(samples), self._owner(si)
        up = mi.Vector3f(si.n)
        across, along = mi.coordinate_system(up)

        def body(index: Any, total: Any) -> tuple[Any, Any]:
            u, v = self._pair(start, index)
            by_normal, by_first = u < 0.5, u < 0.75
            angle = 2 * pi * dr.select(by_normal, 2.0 * u, dr.select(by_first, 4.0 * u - 2.0, 4.0 * u - 3.0))
            axis = dr.select(by_normal, up, dr.select(by_first, across, along))
            side = dr.select(by_normal, across, dr.select(by_first, up, across))
            other = dr.select(by_normal | by_first, along, up)
            far = radius * _cubic_radius(dr, v)
            height = dr.safe_sqrt(radius * radius - far * far)
            offset = (side * dr.cos(angle) + other * dr.sin(angle)) * far
            ray = mi.Ray3f(si.p + axis * height + offset, -axis)
            ray.maxt = 2.0 * height
            drawn = axis, dr.select(by_normal, mi.Float(SHARES[0]), SHARES[1]), far, radius
            return index + 1, total + self._along(ray, mine, drawn, (up, across, along), active & (index < count))

        begin = mi.UInt32(0), mi.Vector3f(0.0)
        _, total = dr.while_loop(begin, lambda index, _: active & (index < count), body, label="bevel")
        size, given = dr.norm(total), mi.Vector3f(*normal)
        mean = total / dr.maximum(size, 1e-20)
        mean = dr.select(dr.dot(si.n, si.to_world(si.wi)) < 0.0, -mean, mean)
        return dr.select(active & (size > 1e-12), mean, given)

    def _along(self, ray: Any, mine: Any, drawn: tuple[Any, ...], axes: tuple[Any, ...], active: Any) -> Any:
        """Weighted normals of the object's surfaces along a probe.

        ``drawn``: its axis, the share of probes along that, its distance from the middle, the radius.
        """
        mi, dr, here = self.mi, self.dr, self.si
        axis, share, far, radius = drawn

        def body(origin: Any, rest: Any, layers: Any, total: Any, walking: Any) -> tuple[Any, ...]:
            probe = mi.Ray3f(ray)
            probe.o, probe.maxt = origin, rest
            si = self._hit(probe, walking)
            met = walking & si.is_valid() & (self._owner(si) == mine)
            squares = mi.Float(1e-12)
            for part, each in zip(SHARES, axes, strict=True):
                squares += dr.square(part * dr.dot(each, si.n))
            weight = share * dr.abs(dr.dot(axis, si.n)) / squares
            weight *= _cubic(dr, dr.norm(si.p - here.p) / radius) / dr.maximum(_cubic(dr, far / radius), 1e-9)
            total = dr.select(met, total + weight * si.sh_frame.n, total)
            onward = walking & si.is_valid() & (layers + 1 < MOST_HITS)
            after = si.spawn_ray(ray.d).o
            left = rest - dr.norm(after - origin)
            return dr.select(onward, after, origin), dr.select(onward, left, rest), layers + 1, total, onward

        begin = mi.Point3f(ray.o), mi.Float(ray.maxt), mi.UInt32(0), mi.Vector3f(0.0), mi.Bool(active)
        return dr.while_loop(begin, lambda _o, _r, _l, _t, walking: walking, body, label="bevel hits")[3]


def _cubic(dr: Any, share: Any) -> Any:
    """The weight at a share of the radius, up to a factor."""
    left = dr.maximum(1.0 - share, 0.0)
    return left * left * left


def _cubic_radius(dr: Any, share: Any) -> Any:
    """Distance over the radius that holds ``share`` of the density, by Newton's method as in Cycles."""
    x = dr.zeros(type(share), dr.width(share)) + 0.2
    for _ in range(8):
        x2 = x * x
        x4, rest = x2 * x2, 1.0 - x
        value = 10.0 * x2 - 20.0 * x2 * x + 15.0 * x4 - 4.0 * x4 * x - share
        slope = 20.0 * (x * rest) * (rest * rest)
        x = dr.clip(x - value / dr.maximum(slope, 1e-6), 0.0, 1.0)
    return x

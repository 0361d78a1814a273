# SPDX-License-Identifier: GPL-3.0-or-later
"""Free flight and transmittance in media that vary: collisions with a bounding extinction, some of which are void.

A collision is drawn with the bound of the block that the ray is in. It scatters, or it is void and the ray goes on;
absorption is a factor. Both are chosen by what they leave of the path's light over all wavelengths, which keeps the
factors bounded (Kutz et al. 2017, "Spectral and decomposition tracking for rendering heterogeneous volumes"). The
transmittance of a shadow ray is the product of the void shares at collisions (Novák et al. 2014, "Residual ratio
tracking for estimating attenuation in participating media").
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from spectral_core.render.plugins.numbers import channel_mean
from spectral_core.render.trace import sobol
from spectral_core.render.trace.media.grids import MediumGrids, Way

EMISSION_POINTS = 16.0
"""Mean number of points at which the emission of media that do not vary is read along a ray."""
DIMMEST, SPARED = 0.05, 0.5
"""Below this transmittance a shadow ray ends with the probability 1 - SPARED at a collision."""


def seed_of(*numbers: Any) -> Any:
    """A seed from the bits of numbers."""
    import drjit as dr
    import mitsuba as mi

    seed = mi.UInt32(0)
    for number in numbers:
        seed = sobol.hashed(seed * 0x9E3779B9 + dr.reinterpret_array(mi.UInt32, mi.Float(number)))
    return seed


def uniform(seed: Any) -> tuple[Any, Any]:
    """A number in [0, 1), and the next seed."""
    import mitsuba as mi

    seed = seed * 747796405 + 2891336453
    return mi.Float(sobol.hashed(seed) >> 8) * 2.0**-24, seed


def _collision(along: Any, step: tuple[Any, Any], seed: Any, active: Any) -> tuple[Any, Any, Any]:
    """Distance to the next collision or to the end of a ``step`` (bound, length), True for a collision, next seed."""
    import drjit as dr

    bound, length = step
    sample, seed = uniform(seed)
    free = dr.select(bound > 0.0, -dr.log(1.0 - sample) / dr.maximum(bound, 1e-30), dr.inf)
    return along + dr.minimum(free, length), active & (free < length), seed


@dataclass(slots=True, eq=False)
class Filled:
    """The media along rays: ``ways`` through grids, with scattering, absorption and emission per unit of length where
    the grid's factors are 1; and ``even``, the sums of these of media that do not vary, None without any.
    """

    grids: MediumGrids
    ways: list[tuple[Way, tuple[Any, Any, Any]]]
    even: tuple[Any, Any, Any] | None = None

    def ends(self, reach: Any) -> tuple[Any, Any]:
        """Distances between which there is a medium, up to ``reach``."""
        import drjit as dr
        import mitsuba as mi

        if self.even is not None:
            return mi.Float(0.0), reach
        ((way, _),) = self.ways
        return way.first, dr.minimum(reach, way.last)

    def step(self, along: Any, reach: Any, active: Any) -> tuple[Any, Any]:
        """Bound of the extinction at a distance, and the length on which it holds."""
        import drjit as dr
        import mitsuba as mi

        if self.even is None:
            return self.grids.block(self.ways[0][0], along, active)
        scattering, absorption, emission = self.even
        bound = mi.Float(dr.max(scattering + absorption))
        # emission is summed at collisions, and a medium that only emits has none of its own
        bound += dr.select(dr.max(emission) > 0.0, EMISSION_POINTS / dr.maximum(reach, 1e-30), 0.0)
        length = mi.Float(dr.inf)
        # Bounds of media that overlap add up, and hold to the nearest end of a block of any of them.
        for way, _ in self.ways:
            inside = active & (along >= way.first) & (along < way.last)
            most, ahead = self.grids.block(way, along, inside)
            bound += dr.select(inside, most, 0.0)
            ahead = dr.select(inside, ahead, dr.select(along < way.first, way.first - along, dr.inf))
            length = dr.minimum(length, ahead)
        return bound, length

    def at(self, along: Any, active: Any) -> list[Any]:
        """Scattering, absorption and emission per unit of length at a distance."""
        import drjit as dr
        import mitsuba as mi

        total = [mi.Spectrum(0.0)] * 3 if self.even is None else [mi.Spectrum(part) for part in self.even]
        for way, light in self.ways:
            # Factors beyond a grid are those of its outermost voxels, so they are left out there.
            by = self.factors(way, along, active)
            inside = active if self.even is None else active & (along >= way.first) & (along <= way.last)
            total = [
                so_far + dr.select(inside, one * factor, 0.0)
                for so_far, one, factor in zip(total, light, by, strict=True)
            ]
        return total

    def factors(self, way: Way, along: Any, active: Any) -> tuple[Any, Any, Any]:
        """Factors of a grid at a distance."""
        return self.grids.factors(way, along, active)


def fly(filled: Filled, reach: Any, carried: Any, seed: Any, active: Any) -> tuple[Any, Any, Any, Any]:
    """True where a path scatters before ``reach``, the distance, the factor on its light, and the emission on the way.

    ``carried``: the path's throughput.
    """
    import drjit as dr
    import mitsuba as mi

    carried = mi.Spectrum(carried)
    begin, end = filled.ends(reach)

    def body(along: Any, weight: Any, emission: Any, scatters: Any, seed: Any, active: Any) -> Any:
        step = filled.step(along, reach, active)
        there, collides, seed = _collision(along, step, seed, active)
        bound = step[0]
        collides &= there < end
        # without a collision the weight stays: the bound is the same for all wavelengths and cancels
        scattered, absorbed, emitted = filled.at(there, collides)
        void = dr.maximum(bound - scattered - absorbed, 0.0)
        rate = dr.rcp(dr.maximum(bound, 1e-30))
        # collisions come at the rate of the bound, so its inverse makes their sum the integral of the emission
        emission = dr.select(collides, emission + weight * emitted * rate, emission)
        of_scatter, of_void = (channel_mean(dr, dr.abs(carried * weight * part)) for part in (scattered, void))
        # where all light is absorbed neither goes on
        total = of_scatter + of_void
        chance = dr.select(total > 0.0, of_scatter / dr.maximum(total, 1e-37), 0.0)
        sample, seed = uniform(seed)
        hits = collides & (sample < chance)
        kept = dr.select(hits, scattered / dr.maximum(chance, 1e-30), void / dr.maximum(1.0 - chance, 1e-30)) * rate
        weight = dr.select(collides, weight * dr.select(total > 0.0, kept, 0.0), weight)
        along = dr.select(active, there, along)
        active &= (there < end) & ~hits & (dr.max(weight) > 0.0)
        return along, weight, emission, scatters | hits, seed, active

    start = (mi.Float(begin), mi.Spectrum(1.0), mi.Spectrum(0.0), mi.Bool(False), seed, active & (begin < end))
    along, weight, emission, scatters, _, _ = dr.while_loop(
        start, lambda _a, _w, _g, _s, _seed, active: active, body,
        labels=("along", "weight", "emission", "scatters", "seed", "active"),
    )  # fmt: skip
    return scatters, dr.select(scatters, along, reach), weight, emission


def transmittance(grids: MediumGrids, way: Way, reach: Any, light: tuple[Any, Any], number: int, active: Any) -> Any:
    """Estimate of the transmittance of a way up to ``reach``; ``light``: scattering and absorption where the factors of
    the grid are 1; ``number``: of the way among several of one ray.
    """
    import drjit as dr
    import mitsuba as mi

    filled = Filled(grids, [(way, (*light, mi.Spectrum(0.0)))])
    begin, end = filled.ends(reach)
    # from the ray's own bits: a shadow ray needs as many numbers as it has collisions, which no sampler can plan for
    seed = seed_of(*way.origin, *way.direction, reach) + number

    def body(along: Any, clear: Any, seed: Any, active: Any) -> Any:
        step = filled.step(along, reach, active)
        there, collides, seed = _collision(along, step, seed, active)
        collides &= there < end
        scattered, absorbed, _ = filled.at(there, collides)
        lost = (scattered + absorbed) * dr.rcp(dr.maximum(step[0], 1e-30))
        clear = dr.select(collides, clear * dr.maximum(1.0 - lost, 0.0), clear)
        sample, seed = uniform(seed)
        gambles = collides & (dr.max(clear) < DIMMEST)
        clear = dr.select(gambles, dr.select(sample < SPARED, clear / SPARED, 0.0), clear)
        along = dr.select(active, there, along)
        return along, clear, seed, active & (there < end) & (dr.max(clear) > 0.0)

    start = (mi.Float(begin), mi.Spectrum(1.0), seed, active & (begin < end))
    _, clear, _, _ = dr.while_loop(
        start, lambda _a, _c, _s, active: active, body, labels=("along", "clear", "seed", "active")
    )
    return clear

# SPDX-License-Identifier: GPL-3.0-or-later
"""Free flight and transmittance in media that vary: collisions with a bounding extinction, some of which are void.

A collision is drawn with the bound of the block that the ray is in. It scatters, or it is void and the ray goes on;
absorption is a factor. Both are chosen by what they leave of the path's light over all wavelengths, which keeps the
factors bounded (Kutz et al. 2017, "Spectral and decomposition tracking for rendering heterogeneous volumes"). The
transmittance of a shadow ray is the product of the void shares at collisions (Novák et al. 2014, "Residual ratio
tracking for estimating attenuation in participating media").
"""

from __future__ import annotations

from typing import Any

from spectral_core.render.trace import sobol
from spectral_core.render.trace.media.grids import MediumGrids, Way

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


def _next(grids: MediumGrids, way: Way, along: Any, seed: Any, active: Any) -> tuple[Any, Any, Any, Any]:
    """Distance to the next collision or to the end of the block, True for a collision, the bound and the next seed."""
    import drjit as dr

    bound, length = grids.block(way, along, active)
    sample, seed = uniform(seed)
    free = dr.select(bound > 0.0, -dr.log(1.0 - sample) / dr.maximum(bound, 1e-30), dr.inf)
    return along + dr.minimum(free, length), active & (free < length), bound, seed


def fly(
    grids: MediumGrids, way: Way, reach: Any, light: tuple[Any, ...], seed: Any, active: Any
) -> tuple[Any, Any, Any, Any]:
    """True where a path scatters before ``reach``, the distance, the factor on its light, and the emission on the way.

    ``light``: the path's throughput, and scattering, absorption and emission per unit of length where the factors of
    the grid are 1.
    """
    import drjit as dr
    import mitsuba as mi

    carried, scattering, absorption, emission = (mi.Spectrum(part) for part in light)
    end = dr.minimum(reach, way.last)

    def body(along: Any, weight: Any, glow: Any, scatters: Any, seed: Any, active: Any) -> Any:
        there, collides, bound, seed = _next(grids, way, along, seed, active)
        collides &= there < end
        # without a collision the weight stays: the bound is the same for all wavelengths and cancels
        by = grids.factors(way, there, collides)
        scattered, absorbed = scattering * by[0], absorption * by[1]
        void = dr.maximum(bound - scattered - absorbed, 0.0)
        rate = dr.rcp(dr.maximum(bound, 1e-30))
        # collisions come at the rate of the bound, so its inverse makes their sum the integral of the emission
        glow = dr.select(collides, glow + weight * emission * by[2] * rate, glow)
        of_scatter, of_void = (dr.mean(dr.abs(carried * weight * part)) for part in (scattered, void))
        # where all light is absorbed neither goes on
        total = of_scatter + of_void
        chance = dr.select(total > 0.0, of_scatter / dr.maximum(total, 1e-37), 0.0)
        sample, seed = uniform(seed)
        hits = collides & (sample < chance)
        kept = dr.select(hits, scattered / dr.maximum(chance, 1e-30), void / dr.maximum(1.0 - chance, 1e-30)) * rate
        weight = dr.select(collides, weight * dr.select(total > 0.0, kept, 0.0), weight)
        along = dr.select(active, there, along)
        active &= (there < end) & ~hits & (dr.max(weight) > 0.0)
        return along, weight, glow, scatters | hits, seed, active

    start = (mi.Float(way.first), mi.Spectrum(1.0), mi.Spectrum(0.0), mi.Bool(False), seed, active & (way.first < end))
    along, weight, glow, scatters, _, _ = dr.while_loop(
        start, lambda _a, _w, _g, _s, _seed, active: active, body,
        labels=("along", "weight", "glow", "scatters", "seed", "active"),
    )  # fmt: skip
    return scatters, dr.select(scatters, along, reach), weight, glow


def transmittance(grids: MediumGrids, way: Way, reach: Any, light: tuple[Any, Any], active: Any) -> Any:
    """Estimate of the transmittance of a way up to ``reach``; ``light``: scattering and absorption as in ``fly``."""
    import drjit as dr
    import mitsuba as mi

    scattering, absorption = (mi.Spectrum(part) for part in light)
    end = dr.minimum(reach, way.last)
    # from the ray's own bits: a shadow ray needs as many numbers as it has collisions, which no sampler can plan for
    seed = seed_of(*way.origin, *way.direction, reach)

    def body(along: Any, clear: Any, seed: Any, active: Any) -> Any:
        there, collides, bound, seed = _next(grids, way, along, seed, active)
        collides &= there < end
        by = grids.factors(way, there, collides)
        lost = (scattering * by[0] + absorption * by[1]) * dr.rcp(dr.maximum(bound, 1e-30))
        clear = dr.select(collides, clear * dr.maximum(1.0 - lost, 0.0), clear)
        sample, seed = uniform(seed)
        gambles = collides & (dr.max(clear) < DIMMEST)
        clear = dr.select(gambles, dr.select(sample < SPARED, clear / SPARED, 0.0), clear)
        along = dr.select(active, there, along)
        return along, clear, seed, active & (there < end) & (dr.max(clear) > 0.0)

    start = (mi.Float(way.first), mi.Spectrum(1.0), seed, active & (way.first < end))
    _, clear, _, _ = dr.while_loop(
        start, lambda _a, _c, _s, active: active, body, labels=("along", "clear", "seed", "active")
    )
    return clear

# SPDX-License-Identifier: GPL-3.0-or-later
"""The random numbers of a path as a Mitsuba sampler: stratified over the samples of a pixel, and stateless.

A number depends on the pixel, the index of the sample and the number of draws before, so passes and tiles need no
persistent random state.
"""

from __future__ import annotations

from functools import cache
from typing import Any

from spectral_core.render.trace import sobol


def hashed_seed(seed: int) -> int:
    """A film's seed as the renderer's 32 bits."""
    return (seed * 2654435761 + 1) & 0xFFFFFFFF


@cache
def path_sampler_class(variant: str) -> Any:
    """The sampler's class under ``variant``, which must be the active one."""
    import mitsuba as mi

    class PathSampler(mi.Sampler):
        """``pixel``: a hash per pixel; ``index``: the sample; ``dimension``: pairs drawn so far in it."""

        def __init__(self, pixel: Any) -> None:
            super().__init__(mi.Properties())
            self.pixel = mi.UInt32(pixel)
            self.index, self.dimension = mi.UInt32(0), mi.UInt32(0)

        def begin(self, index: Any) -> None:
            """Start a sample."""
            self.index, self.dimension = mi.UInt32(index), mi.UInt32(0)

        def next_pair(self) -> tuple[Any, Any]:
            # Multiples of 2^32 over the golden ratio: neighboring dimensions have seeds far apart.
            seed = self.pixel ^ (self.dimension * 0x9E3779B9)
            self.dimension = self.dimension + 1
            return sobol.pair(self.index, sobol.hashed(seed))

        def next_1d(self, active: Any = True) -> Any:
            # 24 bits fill a float32; more would round some numbers up to 1.
            return mi.Float(self.next_pair()[0] >> 8) * 2.0**-24

        def next_2d(self, active: Any = True) -> Any:
            first, second = self.next_pair()
            return mi.Point2f(mi.Float(first >> 8) * 2.0**-24, mi.Float(second >> 8) * 2.0**-24)

        def turn(self, samples: int, period: int) -> Any:
            """A whole number that changes after each ``samples``, whose rest modulo ``period`` takes each value equally
            often. It is random for the pixel.
            """
            block = self.index // samples
            # A period later each rest meets other samples: block // period moves one against the other.
            return sobol.hashed(self.pixel ^ 0x68BC21EB) + block + block // period

        def fork(self) -> Any:
            return PathSampler(self.pixel)

        def clone(self) -> Any:
            copy = PathSampler(self.pixel)
            copy.index, copy.dimension = mi.UInt32(self.index), mi.UInt32(self.dimension)
            return copy

        def to_string(self) -> str:
            return "PathSampler[]"

    return PathSampler

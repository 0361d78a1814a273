# SPDX-License-Identifier: GPL-3.0-or-later
"""Independent random numbers, for decisions so deep in a path that stratified ones would not reduce the noise.

A stratified number takes ten times as many instructions (``trace.sobol``).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from spectral_core.render.trace import sobol

GOLDEN = 0x9E3779B9
"""2^32 over the golden ratio: neighboring numbers have seeds far apart."""


@dataclass
class Numbers:
    """A sequence of numbers in [0, 1), by its ``seed`` (32 bits)."""

    mi: Any
    seed: Any

    @classmethod
    def of(cls, mi: Any, sample: Any) -> Numbers:
        """The sequence that a point in the unit square selects."""
        first, second = (mi.UInt32(part * 2.0**24) for part in (sample.x, sample.y))
        return cls(mi, sobol.hashed(first + sobol.hashed(second)))

    def number(self, place: Any) -> Any:
        """A number of the sequence."""
        return self.mi.Float(sobol.hashed(self.seed + place * GOLDEN) >> 8) * 2.0**-24

# SPDX-License-Identifier: GPL-3.0-or-later
"""How finely a mapped function g(f(x)) must be sampled: the bound of Eq. 4.14 beside the product bound before it."""

from __future__ import annotations

import math
from dataclasses import dataclass

from spectral_core.checks import require_range
from spectral_core.volume.analysis.signal import SampledFunction, essential_bandlimit, steepest_slope


@dataclass(frozen=True)
class CompositeBandlimit:
    """Frequencies that bound g(f(x)), angular: radians per unit of x; ``transfer_bandlimit`` per data value."""

    transfer_bandlimit: float
    """ν_g: essential band limit of g, in radians per unit of the data value."""
    data_bandlimit: float
    """ω_f: essential band limit of f, in radians per unit length."""
    max_slope: float
    """Largest |f'| (gradient magnitude in several variables), in data values per unit length."""
    half_range: float
    """Half of max f − min f."""

    @property
    def frequency(self) -> float:
        """ω_h = ν_g · max|f'| (Eq. 4.14): energy decays exponentially beyond it, with the Airy function."""
        return self.transfer_bandlimit * self.max_slope

    @property
    def product_frequency(self) -> float:
        """The earlier bound ν_g · ω_f · (max f − min f)/2: f taken as one sinusoid of its own band limit and range.

        By Bernstein's inequality a function of band limit ω_f with |f − c| <= A has |f'| <= ω_f · A, with equality
        for the sinusoid; so for a truly band limited f this is never below ``frequency``. In cycles and for
        f in [0, 1] it reads π ν_f ν_g.
        """
        return self.transfer_bandlimit * self.data_bandlimit * self.half_range

    def sample_distance(self, oversampling: float = 2.0) -> float:
        """Distance of samples at ``oversampling`` times the Nyquist rate; infinite where g∘f is constant.

        The thesis advises 2 (four times the limiting frequency), since the limit is tight and essential only.
        """
        require_range("oversampling", oversampling, 1e-6, 1e6)
        return math.inf if self.frequency == 0 else math.pi / (self.frequency * oversampling)


def composite_bandlimit(
    f: SampledFunction, g: SampledFunction, *, energy: float = 0.999, max_slope: float | None = None
) -> CompositeBandlimit:
    """Bound on the frequencies of g(f(x)) from samples of f (one or more variables) and of g (one variable).

    ``energy`` is the fraction of their energy that the band limits of f and g keep; ``max_slope`` replaces the largest
    slope of f's linear interpolant where the derivative is known better. Source: thesis Eq. 4.14 and section 4.1.5.
    """
    g.require_one_variable()
    slope = steepest_slope(f) if max_slope is None else require_range("max_slope", max_slope, 0.0, math.inf)
    return CompositeBandlimit(essential_bandlimit(g, energy), essential_bandlimit(f, energy), slope, f.half_range)

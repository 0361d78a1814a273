# SPDX-License-Identifier: GPL-3.0-or-later
"""Sampling rate of a mapped function g(f(x)): the bound of Eq. 4.14 and the earlier product bound."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spectral_core.checks import real_numbers, require_range
from spectral_core.errors import InvalidInputError
from spectral_core.volume.analysis.signal import SampledFunction, essential_bandlimit, steepest_slope
from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.transfer import TransferFunction

_TRANSFER_SAMPLES = 2049


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
        """The earlier bound ν_g · ω_f · (max f − min f)/2: f is treated as one sinusoid at its band limit and range.

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
    f: SampledFunction | ScalarVolume | ArrayLike,
    g: SampledFunction | TransferFunction | Callable[[NDArray], ArrayLike] | ArrayLike,
    *,
    energy: float = 0.999,
    max_slope: float | None = None,
) -> CompositeBandlimit:
    """Bound on the frequencies of g(f(x)) from samples of f (one or more variables) and of g (one variable).

    An array for f has unit spacing; an array or a function for g represents the range of f's values; of a transfer
    function, the material curve with the largest bandwidth counts. ``energy`` is the fraction of their energy that the
    band limits of f and g keep; ``max_slope`` replaces the largest slope of f's linear interpolant if the derivative is
    known better. Source: thesis Eq. 4.14 and section 4.1.5.
    """
    data = _data(f)
    signals = _transfer(g, float(data.values.min()), float(data.values.max()))
    slope = steepest_slope(data) if max_slope is None else require_range("max_slope", max_slope, 0.0, math.inf)
    transfer_bandlimit = max(essential_bandlimit(signal, energy) for signal in signals)
    return CompositeBandlimit(transfer_bandlimit, essential_bandlimit(data, energy), slope, data.half_range)


def _data(f: SampledFunction | ScalarVolume | ArrayLike) -> SampledFunction:
    if isinstance(f, SampledFunction):
        return f
    if not isinstance(f, ScalarVolume):
        return SampledFunction.regular(f)
    axes = f.world_from_index[:3, :3] / f.voxel_size
    if not np.allclose(axes.T @ axes, np.eye(3), atol=1e-6):
        raise InvalidInputError(f"volume {f.name!r} has sheared voxels; give its samples as a SampledFunction instead")
    return SampledFunction.regular(f.data, f.voxel_size.tolist())


def _transfer(
    g: SampledFunction | TransferFunction | Callable[[NDArray], ArrayLike] | ArrayLike, low: float, high: float
) -> list[SampledFunction]:
    """g as functions of one variable over the data's range; all material curves of a transfer function."""
    if isinstance(g, SampledFunction):
        g.require_one_variable()
        return [g]
    if not low < high:  # constant data: only one value of g is used
        return [SampledFunction.regular(np.zeros(3))]
    values = np.linspace(low, high, _TRANSFER_SAMPLES)
    if isinstance(g, TransferFunction):
        extinction, source = g.curves(values, np.zeros_like(values) if g.uses_gradient else None)
        curves = np.concatenate([extinction, source], axis=-1).T
        return [SampledFunction.regular(curve, values[1] - low, origin=low) for curve in curves]
    if callable(g):
        return [SampledFunction.regular(np.asarray(g(values)), values[1] - low, origin=low)]
    samples = real_numbers("samples of g", g)
    if samples.ndim != 1 or samples.size < 3:
        raise InvalidInputError(f"samples of g have shape {samples.shape}; expected 3 or more along one axis")
    return [SampledFunction.regular(samples, (high - low) / (samples.size - 1), origin=low)]

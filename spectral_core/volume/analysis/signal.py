# SPDX-License-Identifier: GPL-3.0-or-later
"""A regularly sampled function of one or more variables, its essential band limit and its steepest slope.

All frequencies of ``spectral_core.volume.analysis`` are angular: radians per unit of the variable. A function that
holds nothing above ``omega`` is sampled at the Nyquist rate by a sample every ``pi / omega``.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spectral_core.checks import (
    frozen_array,
    read_only_when_copied,
    real_numbers,
    require_kind,
    require_range,
    require_whole,
)
from spectral_core.errors import InvalidInputError, counted

MOST_SAMPLES = 1 << 30
"""More do not fit into memory."""


@read_only_when_copied
@dataclass(frozen=True)
class SampledFunction:
    """Samples of a real function on a regular grid: ``values[i]`` is its value at ``origin + i * spacing``.

    ``periodic``: True if sample ``n`` of an axis would repeat sample 0; otherwise the function is continued by
    mirroring at its first and last sample, which adds no jump. Raises InvalidInputError for fewer than three samples
    along an axis, for values that are not finite, and for spacings that are not positive.
    """

    values: NDArray[np.float64]
    spacing: tuple[float, ...]
    origin: tuple[float, ...]
    periodic: bool = False

    def __post_init__(self) -> None:
        values = frozen_array("sampled function", self.values)
        if values.ndim == 0 or min(values.shape) < 3:
            raise InvalidInputError(
                f"a sampled function has shape {values.shape}; expected 3 or more samples along each axis"
            )
        for name, given in (("spacing", self.spacing), ("origin", self.origin)):
            frozen_array(f"sampled function {name}", given, [values.ndim])
        if min(self.spacing) <= 0:
            raise InvalidInputError(f"sample spacing is {self.spacing}; expected positive distances")
        object.__setattr__(self, "values", values)

    @classmethod
    def regular(
        cls,
        values: ArrayLike,
        spacing: float | Sequence[float] = 1.0,
        *,
        origin: float | Sequence[float] = 0.0,
        periodic: bool = False,
    ) -> SampledFunction:
        """Samples at ``origin + i * spacing``; a single number applies to every axis. Raises InvalidInputError."""
        array = real_numbers("sampled function", values)
        per_axis = []
        for name, given in (("spacing", spacing), ("origin", origin)):
            numbers = real_numbers(name, given)
            if numbers.ndim and numbers.shape != (array.ndim,):
                raise InvalidInputError(
                    f"{name} has shape {numbers.shape} for values of shape {array.shape}; expected a number, or "
                    f"one per axis ({array.ndim})"
                )
            per_axis.append(tuple(np.broadcast_to(numbers, (array.ndim,)).tolist()))
        return cls(array, per_axis[0], per_axis[1], periodic)

    @classmethod
    def of(
        cls, function: Callable[[NDArray], ArrayLike], low: float, high: float, count: int, *, periodic: bool = False
    ) -> SampledFunction:
        """``count`` samples of ``function`` over [low, high]; a periodic one leaves out ``high``."""
        require_function(function)
        require_interval(low, high)
        if require_whole("count", count, -1 << 31, MOST_SAMPLES) < 3:
            raise InvalidInputError(f"{counted(count, 'sample was', 'samples were')} requested; expected 3 or more")
        positions = np.linspace(low, high, count, endpoint=not periodic)
        return cls.regular(np.asarray(function(positions)), positions[1] - positions[0], origin=low, periodic=periodic)

    @property
    def positions(self) -> NDArray[np.float64]:
        """(n,) positions of the samples of a function of one variable."""
        self.require_one_variable()
        return self.origin[0] + self.spacing[0] * np.arange(self.values.size)

    @property
    def half_range(self) -> float:
        """Half the distance from the smallest to the largest value: the amplitude of a sinusoid that spans both."""
        return float(np.ptp(self.values)) / 2

    def require_one_variable(self) -> None:
        """Raise InvalidInputError unless this is a function of one variable."""
        if self.values.ndim != 1:
            raise InvalidInputError(
                f"a function of {self.values.ndim} variables was given; expected one, sampled along a ray"
            )


def require_function(function: object) -> None:
    """Raise InvalidInputError for values in place of a function."""
    if not callable(function):
        raise InvalidInputError(f"the function is {str(function)[:40]!r}; expected one that takes an array")


def require_interval(low: float, high: float) -> None:
    """Raise InvalidInputError unless these are the finite ends of an interval, the lower one first."""
    for name, end in (("low", low), ("high", high)):
        require_range(f"the end {name!r} of the interval", end, -1e300, 1e300)
    if not low < high:
        raise InvalidInputError(f"the interval is {low} to {high}; expected low < high")


def require_sampled(signal: SampledFunction) -> None:
    """Raise InvalidInputError for an array or a function in place of a sampled function."""
    require_kind("the function", signal, SampledFunction, "SampledFunction.regular(array) or SampledFunction.of")


def spectrum_energy(signal: SampledFunction) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Angular frequency (norm over the axes) and energy of each spectral component, without the mean; both are flat.

    Fourier series for periodic signals, cosine series (type I, mirrored at the outer samples) for others.
    """
    from scipy import fft

    require_sampled(signal)
    shape = signal.values.shape
    if signal.periodic:
        energy = np.abs(fft.fftn(signal.values)) ** 2
        axes = [2 * np.pi * np.abs(fft.fftfreq(n, d)) for n, d in zip(shape, signal.spacing, strict=True)]
    else:
        energy = fft.dctn(signal.values, type=1) ** 2
        # Each inner cosine represents a pair of exponentials of the mirrored signal.
        for axis, count in enumerate(shape):
            pairs = np.full(count, 2.0)
            pairs[[0, -1]] = 1.0
            energy *= pairs.reshape([-1 if i == axis else 1 for i in range(len(shape))])
        axes = [np.pi * np.arange(n) / ((n - 1) * d) for n, d in zip(shape, signal.spacing, strict=True)]
    squared = sum(
        np.square(axis).reshape([-1 if i == j else 1 for j in range(len(shape))]) for i, axis in enumerate(axes)
    )
    energy[(0,) * len(shape)] = 0.0
    return np.sqrt(squared).ravel(), energy.ravel()


def energy_beyond(signal: SampledFunction, angular_frequency: float) -> float:
    """Fraction of the energy about the mean that lies above ``angular_frequency``; 0 for a constant."""
    require_range("angular frequency", angular_frequency, 0.0, np.inf)
    frequency, energy = spectrum_energy(signal)
    total = float(energy.sum())
    return float(energy[frequency > angular_frequency].sum()) / total if total > _negligible(signal) else 0.0


def essential_bandlimit(signal: SampledFunction, energy: float = 0.999) -> float:
    """Smallest angular frequency that keeps the fraction ``energy`` of the energy about the mean; 0 for a constant.

    Functions with kinks have no band limit; this replaces ν_g of Eq. 4.14 for them. The answer is one of the signal's
    spectral frequencies, so a longer or finer grid resolves it better.
    """
    require_range("energy fraction", energy, 0.0, 1.0)
    frequency, contained = spectrum_energy(signal)
    if contained.sum() <= _negligible(signal):
        return 0.0
    order = np.argsort(frequency, kind="stable")
    cumulative = np.cumsum(contained[order])
    reached = np.searchsorted(cumulative, energy * cumulative[-1] * (1 - 1e-13))
    return float(frequency[order][min(int(reached), order.size - 1)])


def steepest_slope(signal: SampledFunction) -> float:
    """Largest gradient magnitude that the (multi)linear interpolant of the samples can have, per unit length.

    In each cell a partial derivative is a mean of that cell's parallel edges, hence at most the largest of their
    differences; the norm of these per-axis bounds is exact in one variable and slightly too large in more.
    """
    require_sampled(signal)
    values = signal.values
    if signal.periodic:
        values = np.pad(values, [(0, 1)] * values.ndim, mode="wrap")
    squared: NDArray | float = 0.0
    for axis, distance in enumerate(signal.spacing):
        slope = np.abs(np.diff(values, axis=axis)) / distance
        for other in range(values.ndim):
            if other != axis:
                slope = np.maximum(
                    np.take(slope, range(slope.shape[other] - 1), other),
                    np.take(slope, range(1, slope.shape[other]), other),
                )
        squared = squared + slope**2
    return float(np.sqrt(np.max(squared)))


def _negligible(signal: SampledFunction) -> float:
    """Spectral energy of rounding: a constant's transform is not exactly zero."""
    return signal.values.size * signal.values.size * float(np.max(np.abs(signal.values))) ** 2 * 1e-29

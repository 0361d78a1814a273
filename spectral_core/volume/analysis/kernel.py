# SPDX-License-Identifier: GPL-3.0-or-later
"""The frequency transfer kernel K(ω, ν): the response at frequency ω of g(f(x)) to frequency ν of g.

K depends on f alone (Eq. 4.6). It is small inside a cone about the ω axis whose edges are the extreme slopes of f (Eq.
4.11), and beyond an edge it decays like the Airy function (Eq. 4.18). That edge is the stated band limit.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spectral_core.checks import frozen_array, read_only_when_copied, real_numbers, require_range
from spectral_core.errors import InvalidInputError, counted
from spectral_core.volume.analysis.signal import SampledFunction, require_sampled


@read_only_when_copied
@dataclass(frozen=True)
class TransferKernel:
    """K on a grid of frequencies, from the samples of f over one interval or period."""

    omega: NDArray[np.float64]
    """(n,) angular frequencies of h, ascending, symmetric about 0, radians per unit length."""
    nu: NDArray[np.float64]
    """(m,) angular frequencies of g, radians per unit of the data value."""
    values: NDArray[np.complex128]
    """(m, n) K(ω, ν), scaled as in Eq. 4.6 with r = 1 and one dimension of space: (1/2π) ∫ exp(i(ν f(x) − ω x)) dx."""

    def compose(self, transfer_spectrum: ArrayLike) -> NDArray[np.complex128]:
        """(n,) spectrum of g(f(x)) from the spectrum (m,) of g at evenly spaced ``nu``: Eq. 4.7 as a sum.

        Both spectra are unitary: ĝ(ν) = (2π)^(-1/2) ∫ g(y) exp(−iνy) dy.
        """
        spectrum = frozen_array(
            "spectrum of the transfer function", transfer_spectrum, self.nu.shape, dtype=np.complex128
        )
        steps = np.diff(self.nu)
        if self.nu.size < 2 or not np.allclose(steps, steps[0], rtol=1e-9, atol=0):
            raise InvalidInputError("compose sums over ν; expected a kernel on two or more evenly spaced ν")
        return (spectrum @ self.values) * steps[0]


def frequency_transfer_kernel(f: SampledFunction, nu: ArrayLike) -> TransferKernel:
    """K(ω, ν) for f of one variable and the given ν (m,), by one FFT of exp(iν f(x)) per ν (Eq. 4.6).

    ω runs over the n frequencies of the n samples, so K is continued periodically in ω: sample f finely enough that
    max|ν| · max|f'| stays below π / spacing, or what lies beyond is folded back (the bright corners of Fig. 4.2d).
    A function that is not periodic is taken over its interval only.
    """
    from scipy import fft

    require_sampled(f)
    f.require_one_variable()
    frequencies = frozen_array("nu", nu, [None])
    spacing, count = f.spacing[0], f.values.size
    omega = fft.fftshift(2 * np.pi * fft.fftfreq(count, spacing))
    spectra = fft.fftshift(fft.fft(np.exp(1j * frequencies[:, None] * f.values), axis=1), axes=1)
    # The FFT counts x from the first sample; the phase moves its origin to where x = 0 is.
    values = spectra * np.exp(-1j * omega * f.origin[0]) * (spacing / (2 * np.pi))
    return TransferKernel(omega, frequencies, values)


@dataclass(frozen=True)
class ConeEdge:
    """One edge of the cone: the line ω = slope · ν of the points where f' is extreme."""

    slope: float
    """Extreme f', data values per unit length."""
    positions: NDArray[np.float64]
    """(p,) points x_e with that value of f'."""
    data_values: NDArray[np.float64]
    """(p,) f(x_e)."""
    third_derivatives: NDArray[np.float64]
    """(p,) f'''(x_e): negative where f' is largest, positive where it is smallest."""

    def airy_kernel(self, omega: ArrayLike, nu: ArrayLike) -> NDArray[np.complex128]:
        """K near this edge by third-order stationary phase: Eq. 4.18 in Cartesian frequencies; ω, ν broadcast, ν ≠ 0.

        Each x_e adds |α| Ai(α (ν f'(x_e) − ω)) exp(i(ν f(x_e) − ω x_e)) with α = (2 / (ν f'''(x_e)))^(1/3).
        """
        from scipy.special import airy

        frequency, transfer = np.broadcast_arrays(real_numbers("omega", omega), real_numbers("nu", nu))
        if np.any(transfer == 0):
            raise InvalidInputError("the Airy edge is an approximation for large |ν|; ν = 0 was given")
        total = np.zeros(frequency.shape, dtype=np.complex128)
        for position, value, third in zip(self.positions, self.data_values, self.third_derivatives, strict=True):
            alpha = np.cbrt(2 / (transfer * third))
            phase = np.exp(1j * (transfer * value - frequency * position))
            total += np.abs(alpha) * airy(alpha * (transfer * self.slope - frequency))[0] * phase
        return total

    def decay_length(self, nu: float) -> float:
        """Distance in ω over which the Airy argument grows by one, for transfer frequency ``nu``: ∝ |ν|^(1/3)."""
        nu = require_range("nu", nu, -np.inf, np.inf)
        return float(np.max(np.abs(nu * self.third_derivatives / 2) ** (1 / 3)))


def cone_edges(f: SampledFunction) -> tuple[ConeEdge, ConeEdge]:
    """The lower and upper edge of the cone of f (one variable): its extreme slopes, from a quintic spline.

    An extreme at an end of the interval has no turning point and hence no Airy edge: this raises InvalidInputError.
    """
    from scipy.interpolate import PPoly, make_interp_spline

    require_sampled(f)
    f.require_one_variable()
    if f.values.size < 8:
        raise InvalidInputError(
            f"{counted(f.values.size, 'sample was', 'samples were')} given; the edges of the cone need 8 or more"
        )
    positions, values = f.positions, f.values
    if f.periodic:  # two periods of margin stabilize the spline; roots are taken from the middle period
        length = positions.size * f.spacing[0]
        positions = np.concatenate([positions - length, positions, positions + length])
        values = np.tile(values, 3)
    spline = make_interp_spline(positions, values, k=5)
    first, second, third = (spline.derivative(order) for order in (1, 2, 3))
    turning = PPoly.from_spline(second).roots(extrapolate=False)
    turning = turning[np.isfinite(turning)]  # a constant second derivative of zero gives NaN roots
    inside = (turning >= f.positions[0]) & (turning < f.positions[0] + f.values.size * f.spacing[0])
    turning = np.unique(np.round(turning[inside], 12))
    slopes, thirds = first(turning), third(turning)
    # A quintic's noise has roots where f is flat; the slope has no curvature there, so they are no edge.
    real = np.abs(thirds) * f.spacing[0] ** 3 > 1e-13 * max(f.half_range, 1e-300)
    edges = []
    for extreme, sign, ends in ((np.min, 1.0, np.min(first(positions))), (np.max, -1.0, np.max(first(positions)))):
        candidates = real & (thirds * sign > 0)
        slope = float(extreme(slopes[candidates])) if candidates.any() else np.nan
        scale = np.ptp(first(positions))
        if not candidates.any() or abs(slope - ends) > 1e-3 * scale + 1e-12:
            raise InvalidInputError(
                "the extreme slope of f lies at an end of its interval, not at a turning point of f'; "
                "give f over a longer interval"
            )
        chosen = candidates & (np.abs(slopes - slope) <= 1e-6 * scale)
        edges.append(ConeEdge(slope, turning[chosen], spline(turning[chosen]), thirds[chosen]))
    return edges[0], edges[1]

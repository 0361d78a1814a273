# SPDX-License-Identifier: GPL-3.0-or-later
"""The sampling theory of mapped functions g(f(x)): chapter 4 of the thesis, usable for any f and g.

>>> import numpy as np
>>> from spectral_core.volume.analysis import SampledFunction, composite_bandlimit
>>> data = lambda x: 0.5 + 0.45 * np.sin(np.pi * x / 2) + 0.05 * np.sin(4 * np.pi * x)
>>> f = SampledFunction.of(data, 0, 4, 4096, periodic=True)
>>> g = SampledFunction.of(lambda y: (1 - np.cos(2 * np.pi * y)) / 2, 0, 1, 1024, periodic=True)
>>> limit = composite_bandlimit(f, g)
>>> round(limit.frequency, 2), round(limit.product_frequency / limit.frequency, 1)
(8.39, 4.6)
"""

from spectral_core.volume.analysis.bandlimit import CompositeBandlimit, composite_bandlimit
from spectral_core.volume.analysis.kernel import ConeEdge, TransferKernel, cone_edges, frequency_transfer_kernel
from spectral_core.volume.analysis.sampling import RegularSamples, reconstruction_snr, sample_composition
from spectral_core.volume.analysis.signal import (
    SampledFunction,
    energy_beyond,
    essential_bandlimit,
    spectrum_energy,
    steepest_slope,
)

__all__ = [
    "CompositeBandlimit",
    "ConeEdge",
    "RegularSamples",
    "SampledFunction",
    "TransferKernel",
    "composite_bandlimit",
    "cone_edges",
    "energy_beyond",
    "essential_bandlimit",
    "frequency_transfer_kernel",
    "reconstruction_snr",
    "sample_composition",
    "spectrum_energy",
    "steepest_slope",
]

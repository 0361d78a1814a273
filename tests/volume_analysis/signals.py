# SPDX-License-Identifier: GPL-3.0-or-later
"""The thesis' example of Fig. 4.1, and random band-limited functions."""

from __future__ import annotations

import numpy as np
from hypothesis import strategies as st

from spectral_core.volume.analysis import SampledFunction


def thesis_f(x):
    return 0.5 + 9 / 20 * np.sin(2 * np.pi / 4 * x) + 1 / 20 * np.sin(4 * np.pi * x)


def thesis_g(y):
    return 0.5 * (1 - np.cos(2 * np.pi * y))


THESIS_F = SampledFunction.of(thesis_f, 0, 4, 4096, periodic=True)
THESIS_G = SampledFunction.of(thesis_g, 0, 1, 1024, periodic=True)

trigonometric = st.lists(st.tuples(st.floats(-1, 1), st.floats(0, 6.2)), min_size=1, max_size=6).filter(
    lambda terms: sum(abs(a) for a, _ in terms) > 0.1 and abs(terms[-1][0]) > 0.05
)


def trigonometric_polynomial(terms):
    """f, f' and f''' of sum a_k sin(k x + phase_k) over one period of 2π."""

    def derivative(order):
        return lambda x: sum(a * k**order * np.sin(k * x + p + order * np.pi / 2) for k, (a, p) in enumerate(terms, 1))

    return derivative(0), derivative(1), derivative(3)

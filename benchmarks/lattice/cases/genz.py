# SPDX-License-Identifier: GPL-3.0-or-later
"""The six families of test integrands of Genz 1984, "Testing multidimensional integration routines", exactly."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import erf

Array = NDArray[np.float64]

DIFFICULTY = {
    "oscillatory": 9.0, "product peak": 7.25, "corner peak": 1.85, "gaussian": 7.03, "continuous": 2.04,
    "discontinuous": 4.3,
}  # fmt: skip
"""Sum of the coefficients a, as in Genz's own tests."""


@dataclass(frozen=True)
class Integrand:
    """A function on the unit cube, (N, n) to (N,), and its integral."""

    evaluate: Callable[[Array], Array]
    integral: float


def integrand(family: str, n: int, rng: np.random.Generator) -> Integrand:
    """Draw one integrand of a family in n dimensions."""
    a = rng.random(n)
    a *= DIFFICULTY[family] / a.sum()
    return _FAMILIES[family](a, rng.random(n))


def _oscillatory(a: Array, u: Array) -> Integrand:
    exact = np.exp(2j * np.pi * u[0]) * np.prod((np.exp(1j * a) - 1) / (1j * a))
    return Integrand(lambda x: np.cos(2 * np.pi * u[0] + x @ a), float(exact.real))


def _product_peak(a: Array, u: Array) -> Integrand:
    exact = np.prod(a * (np.arctan(a * (1 - u)) + np.arctan(a * u)))
    return Integrand(lambda x: 1 / np.prod(a**-2.0 + (x - u) ** 2, axis=1), float(exact))


def _corner_peak(a: Array, _u: Array) -> Integrand:
    n = len(a)
    corners = (np.arange(2**n)[:, None] >> np.arange(n)) & 1
    terms = (-1.0) ** corners.sum(axis=1) / (1 + corners @ a)
    exact = terms.sum() / (np.prod(np.arange(1.0, n + 1)) * np.prod(a))
    return Integrand(lambda x: (1 + x @ a) ** -(n + 1.0), float(exact))


def _gaussian(a: Array, u: Array) -> Integrand:
    exact = np.prod(np.sqrt(np.pi) / (2 * a) * (erf(a * (1 - u)) + erf(a * u)))
    return Integrand(lambda x: np.exp(-((a * (x - u)) ** 2).sum(axis=1)), float(exact))


def _continuous(a: Array, u: Array) -> Integrand:
    exact = np.prod((2 - np.exp(-a * u) - np.exp(-a * (1 - u))) / a)
    return Integrand(lambda x: np.exp(-np.abs(x - u) @ a), float(exact))


def _discontinuous(a: Array, u: Array) -> Integrand:
    ends = np.where(np.arange(len(a)) < 2, u, 1.0)
    exact = np.prod((np.exp(a * ends) - 1) / a)
    return Integrand(lambda x: np.where((x <= ends).all(axis=1), np.exp(x @ a), 0.0), float(exact))


_FAMILIES: dict[str, Callable[[Array, Array], Integrand]] = {
    "oscillatory": _oscillatory, "product peak": _product_peak, "corner peak": _corner_peak, "gaussian": _gaussian,
    "continuous": _continuous, "discontinuous": _discontinuous,
}  # fmt: skip

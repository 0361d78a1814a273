# SPDX-License-Identifier: GPL-3.0-or-later
"""The searches over scales: exact vertices, the gradient, the known optima, and their errors."""

from __future__ import annotations

import numpy as np
import pytest

from spectral_core.errors import InvalidInputError
from spectral_core.lattice import (
    class_of,
    figures_of_merit,
    lattice_classes,
    optimize_covering,
    optimize_packing,
    optimize_second_moment,
    packing,
    whiteness,
)
from spectral_core.lattice.optimization import _Weights, cell_samples, moment_and_gradient


@pytest.mark.parametrize(
    ("dimensions", "rate", "middle", "radius"),
    [
        (2, 3, 3, 0.5372850),
        (3, 2, None, 0.4825346),
        (4, 3, 3, 0.5473863),
        (5, 2, None, 0.5255899),
        (6, 2, 2, 0.5624635),
    ],
)
def test_packing_search_ends_at_exact_vertices(dimensions: int, rate: int, middle: int | None, radius: float) -> None:
    found = optimize_packing(class_of(dimensions, rate, middle), starts=20, seed=1)
    assert found.value == pytest.approx(radius, abs=1e-7)
    measured, kissing = packing(found.lattice.generator)
    assert measured == pytest.approx(found.value, rel=1e-9)
    assert kissing >= 2 * len(found.lattice.polynomial.block_sizes)
    assert found.hits >= 1


def test_an_ideal_class_that_is_not_the_companion_is_the_hexagonal_lattice() -> None:
    extra = [one for one in lattice_classes(2, 3).classes if one.index == 1]
    assert len(extra) == 1
    assert optimize_packing(extra[0], starts=1).value == pytest.approx(0.5372850, abs=1e-7)


def test_gradient_of_the_second_moment_equals_differences() -> None:
    problem = _Weights(class_of(5, 2))
    points = cell_samples(5, 1024, 0)
    logs = np.array([0.4, -0.3, 0.1])
    _, gradient = moment_and_gradient(problem, logs, points)
    assert problem.sizes @ np.ones(3) == 5
    for axis in range(3):
        step = np.eye(3)[axis] * 1e-5
        change = (
            moment_and_gradient(problem, logs + step, points)[0] - moment_and_gradient(problem, logs - step, points)[0]
        )
        assert change / 2e-5 == pytest.approx(gradient[axis], abs=1e-6)


def test_second_moment_search_finds_the_lattice_of_the_thesis() -> None:
    found = optimize_second_moment(class_of(3, 2), starts=8, samples=8192)
    merit = figures_of_merit(found.lattice.generator)
    assert merit.second_moment.value == pytest.approx(0.0819044, abs=3e-6)
    assert (merit.face_counts, merit.kissing_number) == ((24, 36, 14), 2)
    assert whiteness(found.lattice, samples=16384) < 0.02


def test_covering_search_to_three_dimensions() -> None:
    found = optimize_covering(class_of(3, 2), starts=6, seed=0)
    assert found.value == pytest.approx(0.7626264, abs=1e-5)
    improper = optimize_covering(class_of(2, 2, improper=True), starts=3)
    assert improper.value == pytest.approx(0.6545973, abs=1e-5)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: optimize_packing(class_of(3, 2), starts=0), "starts is 0"),
        (lambda: optimize_second_moment(class_of(3, 2), samples=1000), "power of two"),
        (lambda: optimize_covering(class_of(3, 2), starts=0), "starts is 0"),
    ],
)
def test_an_error_names_wrong_input(call: object, message: str) -> None:
    with pytest.raises(InvalidInputError, match=message):
        call()  # type: ignore[operator]

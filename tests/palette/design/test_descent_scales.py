# SPDX-License-Identifier: GPL-3.0-or-later
"""What the descents hand to LAPACK and to L-BFGS-B: ridges of singular matrices, objectives with their own slopes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import scipy.optimize

from benchmarks.palette.palette_joint import generated_palette
from spectral_core.palette.assemble.requests import compiled_requests
from spectral_core.palette.assemble.side import Assembler
from spectral_core.palette.assemble.state import initial_state
from spectral_core.palette.design.lights import LightDescent, outer_side
from spectral_core.palette.design.rounds import Budget, Rounds, SolveTrace
from spectral_core.palette.qp.arrow import regular_factor
from spectral_core.palette.qp.squares import RIDGE


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_a_singular_matrix_is_factored_under_a_small_ridge(scale: float) -> None:
    matrix = scale * np.ones((4, 4))
    factor = regular_factor(matrix)
    np.testing.assert_allclose(factor @ factor.T, matrix + RIDGE * scale * np.eye(4), rtol=1e-14)
    # Without curvature the ridge is absolute.
    assert 0.0 < np.diagonal(regular_factor(np.zeros((3, 3)))).max() < 1e-9


def test_the_objective_of_a_descent_has_the_slope_that_it_states(monkeypatch: Any, rng: Any) -> None:
    problem = generated_palette(4)
    requests = compiled_requests(problem)
    assembler = Assembler(problem, requests)
    state = Rounds(assembler, SolveTrace()).round(initial_state(problem))
    outer = outer_side(problem, requests)
    assert outer is not None
    asked: list[Any] = []
    monkeypatch.setattr(scipy.optimize, "minimize", lambda *given, **options: asked.append((*given, options)))
    descent = LightDescent(assembler, state, outer)
    descent.down(state, Budget(60.0), np.inf)
    ((phi, begin, options),) = asked
    assert options["jac"] is True
    bounds = problem.light_bounds if outer == "lights" else problem.reflectance_bounds
    assert [tuple(np.multiply(ends, descent._unit)) for ends in set(options["bounds"])] == [bounds]
    begin = begin + 0.02
    step = 1e-5 * rng.normal(size=begin.size)
    _, gradient = phi(begin)
    high, low = (phi(begin + sign * step)[0] for sign in (1, -1))
    assert gradient @ step == pytest.approx((high - low) / 2, rel=2e-3)
    assert 1e-6 < phi(begin)[0] < 1e6  # near 1 at the start, whatever the unit of lights

# SPDX-License-Identifier: GPL-3.0-or-later
"""A step of the search for distinct colors: both engines find the analytic optimum, at either limit of a row."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import sparse

from spectral_core.palette.distinct.step import ENGINES, Step, solve_step


@pytest.mark.parametrize("engine", sorted(ENGINES))
@pytest.mark.parametrize(("low", "high", "expected"), [(1.0, 9.0, 1.0), (-9.0, -2.0, -2.0), (-9.0, 9.0, 0.25)])
def test_a_row_at_either_limit_has_a_multiplier_that_passes_the_check(engine, low, high, expected) -> None:
    # ½·|x|² with x₀ + x₁ = 0.5 and low ≤ x₀ - 3·x₂ ≤ high; x₀ = x₁ = ¼ is freely optimal but for the last row.
    step = Step(
        hessian=sparse.identity(3, format="csc"),
        linear=np.zeros(3),
        equality=sparse.csc_matrix([[1.0, 1.0, 0.0]]),
        equality_target=np.array([0.5]),
        rows=sparse.csc_matrix([[1.0, 0.0, -3.0]]),
        rows_lower=np.array([low]),
        rows_upper=np.array([high]),
        lower=np.full(3, -10.0),
        upper=np.full(3, 10.0),
    )
    answer = solve_step(step, engine)
    assert answer.x[0] - 3 * answer.x[2] == pytest.approx(expected, abs=1e-6)
    # x₀ = ¼ + m/2 and x₂ = -3·m for the multiplier m of the last row: m = (expected - ¼) / 9.5.
    pull = (expected - 0.25) / 9.5
    np.testing.assert_allclose(answer.x, [0.25 + pull / 2, 0.25 - pull / 2, -3 * pull], atol=1e-6)
    assert answer.check.kkt < 1e-6
    assert answer.feasible

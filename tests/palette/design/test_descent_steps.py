# SPDX-License-Identifier: GPL-3.0-or-later
"""One Newton step of the joint descent against the equations of the barrier method, and its number of steps."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.palette.palette_joint import generated_palette
from spectral_core.palette.design import interior
from spectral_core.palette.design.interior import _Descent, _reach, joint_descent
from spectral_core.palette.design.joint import Joint
from tests.palette.design.test_joint import _joint

SEEDS = [3, 14, 22]


def begun(seed: int) -> tuple[Joint, _Descent]:
    joint, _ = _joint(generated_palette(seed))
    return joint, _Descent(joint)


def test_the_largest_multiple_of_a_step_ends_at_the_first_bound() -> None:
    assert _reach(np.array([1.0, 2.0, 3.0]), np.array([-4.0, -2.0, 5.0])) == 0.25
    assert _reach(np.array([1.0]), np.array([0.0])) == np.inf


@pytest.mark.parametrize("seed", SEEDS)
def test_unknowns_begin_inside_their_bounds(seed: int) -> None:
    """At least a thousandth of their size away, or two fifths of the width between two bounds."""
    joint, descent = begun(seed)
    middle = joint.colors + joint.grid_size * len(joint.surfaces)
    unit = np.ones(joint.start.size)
    unit[middle:] = np.abs(joint.start[middle:]).mean()
    scaled, low, high = joint.start / unit, joint.lower / unit, joint.upper / unit
    expected = []
    for value, lower, upper in zip(scaled, low, high, strict=True):
        if lower >= upper:
            expected.append(lower)
            continue
        room = min(1e-3 * max(1.0, abs(value)), 0.4 * (upper - lower))
        value = max(value, lower + room) if np.isfinite(lower) else value
        expected.append(min(value, upper - room) if np.isfinite(upper) else value)
    np.testing.assert_allclose(descent._x, expected, rtol=1e-12)
    np.testing.assert_allclose(descent._size, unit, rtol=1e-12)
    # all barriers together are a tenth of the objective, and multipliers are those of the central path
    first = 0.1 * joint.objective(joint.start, 10.0) / joint.start.size
    assert descent._barrier == descent._first == pytest.approx(max(first, 1e-16))
    free = (low < high) & np.isfinite(low)
    np.testing.assert_allclose(descent._lower[free] * (descent._x - low)[free], descent._barrier, rtol=1e-9)
    assert not descent._lower[~free].any()


@pytest.mark.parametrize("seed", SEEDS)
def test_a_step_solves_the_equations_of_the_barrier(seed: int) -> None:
    """Newton's equations for gradient = multipliers, and multiplier × distance = barrier, at each bound."""
    joint, descent = begun(seed)
    x = descent._x * descent._size
    _, gradient, hessian, _ = joint.derivatives(x, joint.slopes(x), 10.0)
    gradient, scaled = gradient * descent._size, hessian * np.outer(descent._size, descent._size)
    step = descent._step(gradient.copy(), scaled.copy())
    low, high = joint.lower / descent._size, joint.upper / descent._size
    moving = low < high
    below, above = (descent._x - low), (high - descent._x)
    has_low, has_high = np.isfinite(low) & moving, np.isfinite(high) & moving
    lower, upper, barrier = descent._lower, descent._upper, descent._barrier
    for has, distance, multiplier, by, sign in (
        (has_low, below, lower, step.by_lower, 1), (has_high, above, upper, step.by_upper, -1),
    ):  # fmt: skip
        product = multiplier[has] * distance[has]
        change = by[has] * distance[has] + sign * multiplier[has] * step.by_x[has]
        np.testing.assert_allclose(product + change, barrier, rtol=1e-9)
        assert not by[~has].any()
    force = np.where(has_low, lower + step.by_lower, 0) - np.where(has_high, upper + step.by_upper, 0)
    diagonal = np.diagonal(scaled) + lower / np.where(has_low, below, 1.0) + upper / np.where(has_high, above, 1.0)
    damping = descent._damping * (descent._stiffness + 1e-12 * diagonal[moving].mean())
    left = scaled @ step.by_x + gradient - force + damping * step.by_x
    size = np.abs(scaled) @ np.abs(step.by_x) + np.abs(gradient)
    assert np.abs(left / size)[moving].max() < 1e-3
    assert not step.by_x[~moving].any()
    # the barrier function falls at that rate, and the step stays inside by a two-hundredth of the distance
    h = 1e-7
    ahead, behind = (descent._value(descent._x + s * h * step.by_x, 10.0) for s in (1, -1))
    assert (behind - ahead) / (2 * h) == pytest.approx(step.fall, rel=1e-3)
    shares = np.concatenate([-step.by_x[has_low] / below[has_low], step.by_x[has_high] / above[has_high]])
    assert step.reach == pytest.approx(min(1.0, 0.995 / max(shares.max(), 1e-300)))


def test_the_barrier_function_is_the_objective_minus_logarithms() -> None:
    joint, descent = begun(3)
    x = descent._x
    low, high = joint.lower / descent._size, joint.upper / descent._size
    logs = sum(np.log(v - a) for v, a, b in zip(x, low, high, strict=True) if a < b and np.isfinite(a))
    logs += sum(np.log(b - v) for v, a, b in zip(x, low, high, strict=True) if a < b and np.isfinite(b))
    expected = joint.objective(x * descent._size, 50.0) - descent._barrier * logs
    assert descent._value(x, 50.0) == pytest.approx(expected, rel=1e-12)


def test_multipliers_stay_near_those_of_the_central_path() -> None:
    joint, descent = begun(3)
    count = joint.start.size
    central = descent._barrier / descent._distances(descent._x)[0]
    step = interior._Step(np.zeros(count), -descent._lower * 0.5, descent._upper * 2.0, 0.0, 1.0)
    lower, upper = descent._lower.copy(), descent._upper.copy()
    descent._move_multipliers(step)
    np.testing.assert_allclose(descent._lower, 0.5 * lower)
    np.testing.assert_allclose(descent._upper, 3.0 * upper)
    # a multiplier that would vanish keeps a two-hundredth
    descent._move_multipliers(interior._Step(np.zeros(count), -2 * descent._lower, np.zeros(count), 0.0, 1.0))
    np.testing.assert_allclose(descent._lower, 0.5 * lower * (1 - 0.995))
    descent._lower = descent._lower * 1e-15
    descent._move_multipliers(interior._Step(np.zeros(count), np.zeros(count), np.zeros(count), 0.0, 1.0))
    has = descent._has_low
    np.testing.assert_allclose(descent._lower[has], 1e-10 * central[has], rtol=1e-9)
    descent._lower = descent._lower * 1e25
    descent._move_multipliers(interior._Step(np.zeros(count), np.zeros(count), np.zeros(count), 0.0, 1.0))
    np.testing.assert_allclose(descent._lower[has], 1e10 * central[has], rtol=1e-9)


def test_points_move_away_from_bounds_that_are_nearer_than_multipliers_say() -> None:
    _, descent = begun(14)
    has = descent._has_low
    x = descent._x.copy()
    x[has] = descent._low[has] + 1e-12
    descent._lower = np.where(has, 4.0 * descent._barrier, 0.0)
    moved = descent._away(x)
    ceiling = np.where(
        descent._has_high,
        descent._high - np.minimum(1e-3 * descent._barrier / np.maximum(descent._upper, 1e-300), 1e-3),
        np.inf,
    )
    np.testing.assert_allclose(moved[has], np.minimum(descent._low[has] + 2.5e-4, ceiling[has]), rtol=1e-6, atol=1e-12)
    descent._lower = np.where(has, 1e-6 * descent._barrier, 0.0)  # a small multiplier: a thousandth of the unit
    np.testing.assert_allclose(
        descent._away(x)[has], np.minimum(descent._low[has] + 1e-3, ceiling[has]), rtol=1e-6, atol=1e-12
    )


@pytest.mark.parametrize("seed", SEEDS)
def test_a_descent_ends_by_itself_in_a_usual_number_of_steps(seed: int) -> None:
    """Fifty to two hundred are usual; barriers, corrections and damping that work badly take several times as many."""
    joint, _ = _joint(generated_palette(seed))
    steps = []
    x = joint_descent(joint, lambda: bool(steps.append(None)))
    assert 10 < len(steps) < 220
    assert np.all((x >= joint.lower - 1e-12) & (x <= joint.upper + 1e-12))
    # all barriers together ended at a billionth of the objective: a longer descent gains no more than that
    again = _joint_at(joint, x)
    assert joint.objective(x, 1e5) - joint.objective(again, 1e5) < 1e-6 * joint.objective(x, 1e5)


def _joint_at(joint: Joint, x: np.ndarray) -> np.ndarray:
    from dataclasses import replace

    return joint_descent(replace(joint, start=x), lambda: False)

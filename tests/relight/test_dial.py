# SPDX-License-Identifier: GPL-3.0-or-later
"""The light dial's weights: they sum to 1, and are 1 at each bulb, for any positions of bulbs and selector."""

from __future__ import annotations

import numpy as np
import pytest

from spectral_core.errors import InvalidInputError
from spectral_core.render.relight.dial import bulbs_on_polygon, dial_weights


def as_printed(selector: np.ndarray, bulbs: np.ndarray) -> np.ndarray:
    """Eq. 6.1 of the thesis, normalized: the oracle for separate bulbs."""
    weights = np.ones(len(bulbs))
    for i in range(len(bulbs)):
        for k in range(len(bulbs)):
            if k != i:
                weights[i] *= np.linalg.norm(selector - bulbs[k]) / np.linalg.norm(bulbs[i] - bulbs[k])
    return weights / weights.sum()


def test_weights_equal_the_printed_equation(rng: np.random.Generator) -> None:
    for count in (2, 3, 5, 8, 16):
        for _ in range(50):
            bulbs, selector = rng.normal(size=(count, 2)), rng.normal(size=2) * 3
            np.testing.assert_allclose(
                dial_weights(selector, bulbs), as_printed(selector, bulbs), rtol=1e-10, atol=1e-14
            )


def test_partition_of_unity_over_a_million_configurations(rng: np.random.Generator) -> None:
    """Random and difficult dials: clusters, coincident bulbs, lines, huge and tiny scales, far selectors, switches."""
    total = 0
    for count, batch in ((2, 28_000), (3, 28_000), (4, 28_000), (7, 10_000), (12, 4_000), (64, 200)):
        for kind in range(12):
            bulbs, selectors = rng.normal(size=(batch, count, 2)), rng.normal(size=(batch, 2))
            on = np.ones((batch, count), bool)
            if kind == 1:
                bulbs[:, 1:] = bulbs[:, :1] + 10.0 ** rng.uniform(-16, 0, (batch, count - 1, 1)) * bulbs[:, 1:]
            elif kind == 2:
                bulbs[:, ::2] = bulbs[:, :1]
            elif kind == 3:
                bulbs[..., 1] = 0
            elif kind == 4:
                bulbs, selectors = bulbs * 1e300, selectors * 1e300
            elif kind == 5:
                bulbs, selectors = bulbs * 1e-300, selectors * 1e-300
            elif kind == 6:
                selectors = selectors * 10.0 ** rng.uniform(0, 300, (batch, 1))
            elif kind == 7:
                selectors = bulbs[:, 0] * (1 + 1e-16)
            elif kind == 8:
                selectors = bulbs[np.arange(batch), rng.integers(count, size=batch)]
            elif kind == 9:
                on = rng.random((batch, count)) < 0.5
                on[:, 0] = True
            elif kind == 10:
                bulbs = bulbs + 1e9
                selectors = selectors + 1e9
            elif kind == 11:
                bulbs[:] = bulbs[:, :1]
            weights = dial_weights(selectors, bulbs, on)
            total += batch

            assert np.isfinite(weights).all()
            assert weights.min() >= 0
            np.testing.assert_allclose(weights.sum(axis=-1), 1, atol=1e-12)
            assert not weights[~on].any()
    assert total >= 1_000_000


@pytest.mark.parametrize(("count", "dials"), [(2, 200), (3, 200), (9, 200), (64, 20)])
def test_weight_is_one_at_each_bulb(count: int, dials: int, rng: np.random.Generator) -> None:
    bulbs = rng.normal(size=(dials, count, 2))
    for i in range(count):
        weights = dial_weights(bulbs[:, i], bulbs)
        np.testing.assert_array_equal(weights, np.broadcast_to(np.eye(count)[i], weights.shape))


def test_bulbs_at_one_position_share_its_weight(rng: np.random.Generator) -> None:
    """Three bulbs, two of them at one position, count as two bulbs, one of which is shared by two lights."""
    spots = np.array([[0.0, 0.0], [1.0, 0.5]])
    bulbs = np.array([[0.0, 0.0], [0.0, 0.0], [1.0, 0.5]])
    for selector in rng.normal(size=(100, 2)):
        two, three = dial_weights(selector, spots), dial_weights(selector, bulbs)
        np.testing.assert_allclose(three, [two[0] / 2, two[0] / 2, two[1]], rtol=1e-12)


def test_a_bulb_that_is_off_changes_no_other_weight(rng: np.random.Generator) -> None:
    bulbs, selector = rng.normal(size=(4, 2)), rng.normal(size=2)

    off = dial_weights(selector, bulbs, [True, False, True, True])
    np.testing.assert_allclose(off[[0, 2, 3]], dial_weights(selector, bulbs[[0, 2, 3]]), rtol=1e-12)
    np.testing.assert_array_equal(dial_weights(selector, bulbs, [False] * 4), np.zeros(4))


def test_bulbs_start_on_a_polygon_whose_center_has_equal_weights() -> None:
    for count in (2, 3, 6, 64):
        np.testing.assert_allclose(dial_weights([0, 0], bulbs_on_polygon(count)), 1 / count, rtol=1e-9)
    np.testing.assert_allclose(bulbs_on_polygon(4), [[0, 1], [1, 0], [0, -1], [-1, 0]], atol=1e-15)


def test_bad_dials_are_refused() -> None:
    with pytest.raises(InvalidInputError, match="2 to 64 lights; got 1"):
        bulbs_on_polygon(1)
    with pytest.raises(InvalidInputError, match="1 to 64 bulbs; got 65"):
        dial_weights([0, 0], np.zeros((65, 2)))
    with pytest.raises(InvalidInputError, match=r"the bulbs holds 1 value\(s\) that are not finite"):
        dial_weights([0, 0], [[0, 0], [np.nan, 1]])
    with pytest.raises(InvalidInputError, match=r"expected \(..., 2\) and \(..., n, 2\)"):
        dial_weights([0, 0, 0], [[0, 0], [1, 1]])
    with pytest.raises(InvalidInputError, match="give one switch per bulb"):
        dial_weights([0, 0], [[0, 0], [1, 1]], [True])


def test_a_bulb_that_is_off_has_no_share_of_its_position() -> None:
    """Of two bulbs at one position, one of them off, the other has the whole weight."""
    bulbs = [[0.0, 1.0], [0.0, 1.0], [1.0, -1.0], [-1.0, -1.0]]
    alone = dial_weights([0.1, 0.2], [bulbs[0], bulbs[2], bulbs[3]])
    for off in (0, 1):
        switches = [k != off for k in range(4)]
        weights = dial_weights([0.1, 0.2], bulbs, switches)
        assert weights[off] == 0.0
        np.testing.assert_allclose(weights[1 - off], alone[0], rtol=1e-12)
        np.testing.assert_allclose(weights[2:], alone[1:], rtol=1e-12)
    both = dial_weights([0.1, 0.2], bulbs)
    np.testing.assert_allclose(both[:2], alone[0] / 2, rtol=1e-12)

# SPDX-License-Identifier: GPL-3.0-or-later
"""Whole numbers at the border of a region have the same share of points as those within it."""

from __future__ import annotations

from collections import Counter
from itertools import product

import pytest

from spectral_core.errors import InvalidInputError
from spectral_core.explore.sweep.designs import Design, DesignKind, design_points
from spectral_core.explore.sweep.parameters import Parameter, Space
from spectral_core.explore.sweep.region import NormBall, RegionOfInterest

KINDS: tuple[DesignKind, ...] = ("lattice", "sobol", "latin_hypercube")
SPACE = Space((Parameter("n", 1, 6, kind="integer"), Parameter("a", 0, 1)))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    ("region", "expected"),
    [
        (RegionOfInterest(constraints=("n <= 3",)), [1, 2, 3]),
        (RegionOfInterest(constraints=("n < 4",)), [1, 2, 3]),
        (RegionOfInterest(constraints=("0.1 * n <= 0.3",)), [1, 2, 3]),
        (RegionOfInterest(constraints=("3 <= n", "-n > -6.5")), [3, 4, 5, 6]),
        (RegionOfInterest(constraints=("3.2 < n < 5",)), [4]),
        (RegionOfInterest(ball=NormBall({"n": 4}, {"n": 2})), [2, 3, 4, 5, 6]),
        (RegionOfInterest(ball=NormBall({"n": 2.5, "a": 0.5}, {"n": 0.6, "a": 0.9}, p=float("inf"))), [2, 3]),
    ],
)
def test_each_whole_number_of_a_region_has_the_same_share(
    kind: DesignKind, region: RegionOfInterest, expected: list[int]
) -> None:
    """Of points with ``n <= 3`` the number 3 had half as many as 1 and 2, as those on the border of a ball."""
    points, _ = design_points(SPACE, region, Design(kind, 120))
    found = Counter(point["n"] for point in points)
    assert sorted(found) == expected and sum(found.values()) == 120
    assert all(abs(count - 120 / len(expected)) <= 3 for count in found.values()), found


@pytest.mark.parametrize("kind", KINDS)
def test_pairs_of_whole_numbers_on_a_slanted_border_have_the_same_share(kind: DesignKind) -> None:
    space = Space((*SPACE.parameters, Parameter("m", 1, 6, kind="integer")))
    points, _ = design_points(space, RegionOfInterest(constraints=("n + m <= 7",)), Design(kind, 1050))
    found = Counter((point["n"], point["m"]) for point in points)
    allowed = [(n, m) for n, m in product(range(1, 7), repeat=2) if n + m <= 7]
    assert sorted(found) == allowed
    on_border = sum(count for (n, m), count in found.items() if n + m == 7)
    assert abs(on_border - 1050 * 6 / 21) < 25


@pytest.mark.parametrize("kind", KINDS)
def test_whole_numbers_on_a_log_scale_have_their_interval(kind: DesignKind) -> None:
    space = Space((Parameter("n", 1, 100, scale="log", kind="integer"), Parameter("a", 0, 1)))
    points, _ = design_points(space, RegionOfInterest(constraints=("log10(n) <= 1",)), Design(kind, 400))
    found = Counter(point["n"] for point in points)
    assert sorted(found) == list(range(1, 11))
    assert 11 <= found[10] <= 15  # log10(10.5 / 9.5) of log10(10.5 / 0.5): 13.1


def test_equal_whole_numbers_are_a_region_and_a_ball_between_two_of_them_is_none() -> None:
    """``n == m`` by two constraints was too thin for a lattice, and no point of a Sobol sequence was in it."""
    space = Space((*SPACE.parameters, Parameter("m", 1, 6, kind="integer")))
    for kind in KINDS:
        points, _ = design_points(space, RegionOfInterest(constraints=("n - m <= 0", "m - n <= 0")), Design(kind, 60))
        assert len(points) == 60 and all(point["n"] == point["m"] for point in points)
    with pytest.raises(InvalidInputError, match="no whole number of n"):
        design_points(SPACE, RegionOfInterest(ball=NormBall({"n": 2.5}, {"n": 0.3})), Design("sobol", 4))

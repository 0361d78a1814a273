# SPDX-License-Identifier: GPL-3.0-or-later
"""Regions, enumeration, exact counts, progressive order: counts, membership, bits and bounds."""

from __future__ import annotations

import itertools
import json
import pickle
import tracemalloc

import numpy as np
import pytest

from benchmarks.lattice.cases.polytopes import KINDS, random_polytope
from spectral_core.errors import InvalidInputError, SolveError, SpectralError
from spectral_core.lattice import (
    Frame,
    Region,
    ball,
    box,
    corner_simplex,
    fill_exactly,
    halfspaces,
    level_for,
    make_lattice,
    prefix_separations,
    progressive_fill,
    progressive_points,
    unit_cube,
)
from spectral_core.lattice.fill.anchoring import anchor
from spectral_core.lattice.fill.enumeration import Window
from spectral_core.lattice.fill.frame import CosetDigits, random_rotation
from spectral_core.lattice.fill.progressive import progressive_order


def _of_up_to_seven_dimensions(index: int) -> bool:
    return index // len(KINDS) % 9 < 6


@pytest.mark.parametrize(
    "index", [*range(9 * len(KINDS)), *filter(_of_up_to_seven_dimensions, range(9 * len(KINDS), 18 * len(KINDS)))]
)
def test_exactly_m_points_inside_any_polytope(index: int) -> None:
    kind, region = random_polytope(index)
    count = (0, 1, 2, 37, 150, 400)[index % 6]
    lattice = make_lattice(region.dimensions, 2 + index % 2, criterion="packing")
    frame, coefficients = fill_exactly(lattice, region, count, seed=index)
    points = frame.positions(coefficients)
    assert points.shape == (count, region.dimensions), kind
    assert region.contains(points).all(), kind
    assert len(np.unique(coefficients, axis=0)) == count
    again, _ = frame.points_in(region)
    assert len(again) == count  # all lattice points in the region, not a subset


@pytest.mark.parametrize("dimensions", [1, 2, 3, 4])
def test_enumeration_equals_brute_force(dimensions: int) -> None:
    rng = np.random.default_rng(dimensions)
    lattice = make_lattice(dimensions, 2)
    regions = [ball(np.zeros(dimensions), 2.0, p=p) for p in (1.0, 1.5, 2.0, 3.0)]
    regions += [box(-rng.uniform(0.5, 3, dimensions), rng.uniform(0.5, 3, dimensions)), corner_simplex(dimensions, 6.0)]
    k = np.array(list(itertools.product(range(-9, 10), repeat=dimensions)))
    for region in regions:
        anchored = anchor(region)
        basis = random_rotation(dimensions, rng) @ lattice.reduced
        offset = basis @ rng.random(dimensions)
        found = Window(anchored, basis, offset).points(1.0, 100.0)
        inside = region.contains(anchored.center + offset + found @ basis.T)
        brute = region.contains(anchored.center + offset + k @ basis.T)
        assert {tuple(row) for row in found[inside]} == {tuple(row) for row in k[brute]}


def test_pruning_by_linear_programs_loses_no_point() -> None:
    """The corner simplex in 8 dimensions needs linear programs; a search without them finds the same points."""
    lattice = make_lattice(8, 2, criterion="packing")
    anchored = anchor(corner_simplex(8))
    basis = random_rotation(8, np.random.default_rng(0)) @ lattice.reduced
    with_cuts = Window(anchored, 0.105 * basis, np.full(8, 0.01))
    without = Window(anchored, 0.105 * basis, np.full(8, 0.01))
    found, every = with_cuts.points(1.0, -3700.0), without.points(1.0, 1e9)  # the threshold is 30000 + 8 expected
    assert with_cuts.programs > 0 == without.programs
    assert with_cuts.nodes < without.nodes
    assert {tuple(row) for row in found} == {tuple(row) for row in every}
    assert len(found) > 500


@pytest.mark.parametrize("seed", [0, 1])
def test_every_prefix_keeps_its_separation(seed: int) -> None:
    points = progressive_fill(unit_cube(6), 4096, seed=seed)
    assert len(points) == 4096
    assert prefix_separations(points.points).min() > 0.5


@pytest.mark.parametrize(("dimensions", "rate", "index"), [(3, 2, 0), (4, 3, 0), (5, 3, 0), (8, 3, 1)])
def test_prefixes_reach_the_stated_bound(dimensions: int, rate: int, index: int) -> None:
    lattice = make_lattice(dimensions, rate, criterion="packing")
    points = progressive_fill(unit_cube(dimensions), 700, rate=rate, seed=index)
    bound = lattice.dilation_factor**-1 * 0.5 * np.linalg.norm(lattice.reduced, axis=0).min()
    assert prefix_separations(points.points).min() > 0.97 * bound  # 3 % tolerance: m = 700 is rounded to a scale


@pytest.mark.parametrize("rate", [2, 3])
def test_refinement_moves_no_point(rate: int) -> None:
    coarse = progressive_fill(unit_cube(4), 200, rate=rate, seed=7)
    fine = coarse.refine().refine()
    assert fine.points[:200].tobytes() == coarse.points.tobytes()
    assert abs(len(fine) / (200 * rate**2) - 1) < 0.2
    assert len(np.unique(fine.points, axis=0)) == len(fine)
    positions, _ = fine.frame.points_in(unit_cube(4), 2)
    assert {row.tobytes() for row in positions} == {row.tobytes() for row in fine.points}
    order = progressive_order(fine.frame.lattice, fine.coefficients, 2, fine.shifts)
    assert (order == np.arange(len(fine))).all()  # the levels one after another give the order of all points


def test_other_regions_reuse_points_bit_for_bit() -> None:
    points = progressive_fill(unit_cube(3), 300, seed=1).refine()
    smaller = points.within(box([0.2, 0.3, 0.1], [0.9, 0.8, 0.6]))
    larger = points.within(halfspaces(np.r_[np.eye(3), -np.eye(3), [[1, 1, 1]]], [1.3] * 3 + [0.4] * 3 + [2.5]))
    here, there = points.shared(smaller)
    assert len(here) == len(smaller) == smaller.region.contains(points.points).sum()
    assert points.points[here].tobytes() == smaller.points[there].tobytes()
    here, there = points.shared(larger)
    assert len(here) == larger.region.contains(points.points).sum()
    assert points.points[here].tobytes() == larger.points[there].tobytes()
    assert len(larger) > len(points)


def test_a_stored_sweep_is_continued() -> None:
    points = progressive_fill(ball(np.zeros(3), 2.0), 200, rate=3, seed=2)
    stored = json.dumps({"frame": points.frame.to_dict(), "shifts": points.shifts})
    read = json.loads(stored)
    again = progressive_points(Frame.from_dict(read["frame"]), points.region, shifts=tuple(read["shifts"]))
    assert again.points.tobytes() == points.points.tobytes()
    assert pickle.loads(pickle.dumps(points)).refine().points.tobytes() == again.refine().points.tobytes()
    assert len(again.shared(points)[0]) == 200
    with pytest.raises(InvalidInputError, match="different frames"):
        points.shared(progressive_fill(ball(np.zeros(3), 2.0), 200, rate=3, seed=3))
    with pytest.raises(InvalidInputError, match="not a description"):
        Frame.from_dict({"rate": 2})


def test_digits_count_cosets_exactly() -> None:
    k = np.array(list(itertools.product(range(-2, 4), repeat=4)))
    for rate in (2, 3):
        lattice = make_lattice(4, rate)
        digits = CosetDigits.of(lattice)
        found = digits.digits(k)
        assert np.bincount(found).tolist() == [len(k) // rate] * rate
        quotient = digits.divide(k, found)
        assert (quotient @ lattice.dilation.T + found[:, None] * digits.step == k).all()


def test_filling_a_region_far_from_the_origin() -> None:
    for count in (0, 1, 2, 500):
        points = progressive_fill(box(np.full(5, 1e9), np.full(5, 1e9 + 1.0)), count, seed=3)
        assert len(points) == count
        assert points.region.contains(points.points).all()
    near = progressive_fill(unit_cube(5), 500, seed=3).points
    assert np.abs(points.points - 1e9 - near).max() < 5e-7


def test_memory_is_proportional_to_the_points() -> None:
    sizes = {}
    for count in (2000, 16000):
        tracemalloc.start()
        progressive_fill(unit_cube(6), count)
        sizes[count] = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
    assert sizes[16000] < 9.0 * sizes[2000]
    assert sizes[16000] < 16000 * 6 * 8 * 60  # 60 times the bytes of the coordinates


def test_the_number_of_points_is_near_m_and_has_levels() -> None:
    frame = fill_exactly(make_lattice(3, 2), unit_cube(3), 1000)[0]
    assert len(frame.points_in(unit_cube(3))[0]) == 1000
    level = level_for(frame, unit_cube(3), 8000)
    assert level == 3
    assert abs(len(frame.points_in(unit_cube(3), level)[0]) - 8000) < 300


@pytest.mark.parametrize(("n", "limit"), [(2, 0.4), (3, 1.2), (6, 2.5), (9, 4.0)])
@pytest.mark.parametrize("count", [60, 700, 4000])
def test_the_number_of_points_is_near_m_in_a_region_without_a_formula(n: int, limit: float, count: int) -> None:
    """Its volume was taken for a tenth of its ellipsoid's: four times as many points, or a refusal."""
    region = unit_cube(n) & halfspaces([[1.0] * n], [limit])
    frame = fill_exactly(make_lattice(n, 2), region, 40, seed=3)[0]
    found = len(frame.points_in(region, level_for(frame, region, count))[0])
    assert count / 1.6 < found < count * 1.6


def test_equal_seeds_give_equal_points_and_other_seeds_do_not() -> None:
    first, same, other = (progressive_fill(unit_cube(3), 50, seed=s).points for s in (5, 5, 6))
    np.testing.assert_allclose(first, same, rtol=0, atol=1e-12)  # last digits depend on products of matrices
    assert np.abs(first - other).max() > 1e-3


def test_a_rotation_that_aligns_the_lattice_is_refused_with_a_reason() -> None:
    lattice = make_lattice(
        2, 2, criterion="packing"
    )  # an axis-aligned square lattice: a small change of scale adds a whole row
    with pytest.raises(SolveError, match="lines the lattice up"):
        fill_exactly(lattice, unit_cube(2), 50, rotation=np.eye(2))


def _tilted_flat() -> Region:
    turn = random_rotation(3, np.random.default_rng(0))
    return halfspaces(np.r_[turn, -turn], [1, 1, 1e-9, 1, 1, 1e-9])


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: progressive_fill(unit_cube(3), 10**12), "from 0 to 10000000"),
        (lambda: progressive_fill(unit_cube(3), -1), "from 0 to 10000000"),
        (lambda: progressive_fill(unit_cube(3), 2.5), "whole number"),
        (lambda: progressive_fill(unit_cube(3), 10, seed=-1), "seed is -1"),
        (lambda: progressive_fill(halfspaces(np.eye(3), np.ones(3)), 10), "unbounded"),
        (
            lambda: progressive_fill(halfspaces(np.r_[np.eye(2), -np.eye(2)], [1, 1, -1, -1]), 10),
            "empty, flat or too thin",
        ),
        (lambda: progressive_fill(halfspaces(np.r_[np.eye(2), -np.eye(2)], [1, 1, -2, -2]), 10), "too thin|no point"),
        (lambda: progressive_fill(_tilted_flat(), 10), "too thin"),
        (lambda: progressive_fill(ball([0, 0], 1) & halfspaces([[1, 0]], [-1.5]), 5), "overlap is empty|too thin"),
        (lambda: box([0, 1], [1, 1]), "on axis 1"),
        (lambda: box([0, 0], [1, np.inf]), "not finite"),
        (lambda: box([-1e308, 0], [1e308, 1]), "wider than the largest double number"),
        (lambda: progressive_fill(unit_cube(2), True), "expected a whole number"),
        (lambda: progressive_fill(unit_cube(2), 3, seed=True), "expected a whole number"),
        (lambda: ball([0, 0], 1, p=0.5), "p is 0.5"),
        (lambda: ball([0, 0], -1), "positive"),
        (lambda: halfspaces([[0.0, 0.0]], [-1.0]), "no point fits"),
        (lambda: unit_cube(65), "1 to 64"),
        (lambda: progressive_fill(unit_cube(17), 9), "1 to 16"),
        (lambda: progressive_fill(box([1e9, 1e9], [1e9 + 1e-5] * 2), 9), "subtract an offset"),
        (lambda: unit_cube(2) & unit_cube(3), "cannot be intersected"),
        (lambda: fill_exactly(make_lattice(2, 2), unit_cube(3), 9), "3 dimensions, the lattice 2"),
        (lambda: fill_exactly(make_lattice(2, 2), unit_cube(2), 100)[0].points_in(unit_cube(2), 40), "the limit is"),
        (lambda: fill_exactly(make_lattice(2, 2), unit_cube(2), 9, rotation=2 * np.eye(2)), "off orthonormal"),
    ],
)
def test_impossible_cases_give_clear_errors(call: object, message: str) -> None:
    with pytest.raises(SpectralError, match=message):
        call()  # type: ignore[operator]


def test_tiny_regions_and_high_dimensions_are_filled() -> None:
    tiny = box(np.zeros(6), np.full(6, 1e-200))
    assert tiny.contains(progressive_fill(tiny, 100).points).all()
    flat = box(np.zeros(4), [1.0, 1.0, 1.0, 1e-4])
    assert len(progressive_fill(flat, 300)) == 300
    lattice = make_lattice(16, 2, criterion="unit")
    assert len(progressive_fill(ball(np.zeros(16), 1.0), 100, lattice=lattice)) == 100


def test_wrong_box_is_an_invalid_input() -> None:
    with pytest.raises(InvalidInputError, match="low"):
        box([0.0], [0.0])

# SPDX-License-Identifier: GPL-3.0-or-later
"""Caps of balls are searched in their own metric, Voronoi cells satisfy Euler's formula, engines of any lattice."""

from __future__ import annotations

import numpy as np
import pytest

from spectral_core.errors import InvalidInputError
from spectral_core.lattice import (
    ball,
    box,
    corner_simplex,
    frozen_scales,
    halfspaces,
    make_lattice,
    packing,
    progressive_fill,
    separation,
    unit_cube,
    voronoi_cell,
)
from spectral_core.lattice.catalogue import CRITERIA
from spectral_core.lattice.construction import build_lattice
from spectral_core.lattice.engine import LatticeEngine
from spectral_core.lattice.fill import enumeration
from spectral_core.lattice.fill.anchoring import anchor
from tests.lattice.polish import polished_scales

CAPS = [(2, 0.999), (3, 0.9999), (4, 0.999), (4, 0.5), (4, -0.5), (6, 0.99), (8, 0.9)]


def cap(n: int, height: float, tilt: int | None = None) -> tuple:
    """A ball and a half-space with its normal along the first axis or in a random direction."""
    normal = np.eye(n)[0] if tilt is None else np.random.default_rng(tilt).normal(size=n)
    normal = normal / np.linalg.norm(normal)
    sphere = ball(np.zeros(n), 1.0)
    return sphere, sphere & halfspaces([-normal], [-height])


@pytest.mark.parametrize(("n", "height"), CAPS)
@pytest.mark.parametrize("tilt", [None, 3])
def test_a_cap_of_a_ball_is_searched_in_its_own_metric(n, height, tilt, monkeypatch) -> None:
    """The search finds exactly the points, with work proportional to their number."""
    monkeypatch.setattr(enumeration, "MAX_NODES", 200_000)
    _, region = cap(n, height, tilt)
    points = progressive_fill(region, 50, seed=1)
    assert len(points) == 50 and region.contains(points.points).all()


def test_every_point_of_a_cap_is_found() -> None:
    """Compared with all points of the same lattice in a box around the cap."""
    for tilt in (None, 1, 2):
        _, region = cap(3, 0.9, tilt)
        points = progressive_fill(region, 60, seed=2)
        around = points.within(box(np.full(3, -1.0), np.full(3, 1.0)))
        assert int(region.contains(around.points).sum()) == 60


def test_the_ellipsoid_of_a_cap_contains_it_and_is_small() -> None:
    """The smallest ellipsoid around a cap is known (Grötschel, Lovász and Schrijver 1988)."""
    for n, height in ((3, 0.9), (5, 0.99), (4, 0.2)):
        sphere, region = cap(n, height)
        found = anchor(region)
        rng = np.random.default_rng(0)
        inside = rng.normal(size=(20_000, n))
        inside *= (rng.random(20_000) ** (1 / n) / np.linalg.norm(inside, axis=1))[:, None]
        top = np.sqrt(1 - height**2)
        rim = rng.normal(size=(2000, n - 1))
        rim = np.column_stack([np.full(2000, height), top * rim / np.linalg.norm(rim, axis=1)[:, None]])
        members = np.concatenate([inside[inside[:, 0] >= height], rim, np.eye(n)[:1]]) - found.center
        assert np.linalg.norm((members - found.ellipsoid_center) @ found.metric.T, axis=1).max() <= 1 + 1e-9
        log_volume = -np.linalg.slogdet(found.metric)[1]
        along, across = n * (1 - height) / (n + 1), n * top / np.sqrt(n * n - 1)
        assert log_volume <= np.log(along) + (n - 1) * np.log(across) + 0.2
        assert sphere.norm_ball is not None


def test_the_intersection_of_boxes_is_a_box() -> None:
    both = box([0, 0], [2, 3]) & box([1, -1], [4, 2])
    assert both.box_limits is not None and both.box_limits[0].tolist() == [1, 0]
    with pytest.raises(InvalidInputError, match="empty"):
        progressive_fill(box([0, 0], [1, 1]) & box([2, 2], [3, 3]), 5)


@pytest.mark.parametrize("rate", [2, 3])
@pytest.mark.parametrize("n", [2, 3, 4])
def test_cells_of_shipped_lattices_satisfy_eulers_formula(n: int, rate: int) -> None:
    for criterion in CRITERIA:
        cell = voronoi_cell(make_lattice(n, rate, criterion=criterion).generator)
        counts = cell.face_counts
        assert sum((-1) ** k * count for k, count in enumerate(counts)) == 1 - (-1) ** n
        assert counts[0] == len(cell.vertices) and counts[-1] == len(cell.relevant)


def test_shipped_scales_are_refined_and_optimal() -> None:
    """The (4, 2) second-moment lattice has kissing number 8, not 4, and its second moment is a minimum to rounding."""
    frozen = frozen_scales(4, 2, "second_moment")
    lattice = make_lattice(4, 2)
    assert packing(lattice.generator)[1] == 8
    shifted = frozen.log_scales + 3e-8 * np.array([1.0, -1.0])
    np.testing.assert_allclose(polished_scales(frozen.lattice_class, shifted), frozen.log_scales, atol=1e-13)
    at = [
        voronoi_cell(build_lattice(frozen.lattice_class, frozen.log_scales + step * np.array([1.0, -1.0])).generator)
        for step in (-1e-5, 0.0, 1e-5)
    ]
    assert at[1].second_moment < min(at[0].second_moment, at[2].second_moment)
    assert at[1].second_moment == pytest.approx(frozen.value, abs=1e-14)


def test_two_near_corners_stay_separate() -> None:
    """The cell of a square lattice sheared by 1e-5 is a hexagon with two edges of that length."""
    cell = voronoi_cell([[1.0, 1e-5], [0.0, 1.0]])
    assert cell.face_counts == (6, 6)
    assert voronoi_cell(np.eye(2)).face_counts == (4, 4)


def test_the_engine_accepts_a_lattice_more_dimensions_and_no_scramble() -> None:
    covering = make_lattice(4, 3, criterion="covering")
    points = LatticeEngine(4, lattice=covering, points=64, scramble=False).random(64)
    filled = progressive_fill(unit_cube(4), 64, lattice=covering, seed=0).points
    np.testing.assert_allclose(points, filled, rtol=0, atol=1e-12)  # two fills may differ in last digits
    first, second = (LatticeEngine(3, scramble=False, rng=seed, points=32).random(32) for seed in (1, 2))
    np.testing.assert_allclose(first, second, rtol=0, atol=1e-12)
    wide = LatticeEngine(13, points=64, rng=1).random(64)
    assert wide.shape == (64, 13) and separation(wide) > 0.3
    with pytest.raises(InvalidInputError, match="the lattice has 4 dimensions, the engine 3"):
        LatticeEngine(3, lattice=covering)
    with pytest.raises(InvalidInputError, match="dimensions is 17"):
        LatticeEngine(17)


@pytest.mark.parametrize("seed", range(3))
def test_prefixes_keep_their_separation_relative_to_the_spacing_of_the_lattice(seed: int) -> None:
    """Relative to the spacing, at least packing radius / rate^(1/n); m = 600 is rounded at every level."""
    from scipy.spatial.distance import pdist, squareform

    points = progressive_fill(unit_cube(6), 600, seed=seed)
    bound = packing(points.frame.lattice.generator)[0] / 2 ** (1 / 6)
    distances = squareform(pdist(points.points)) / points.frame.spacing
    np.fill_diagonal(distances, np.inf)
    nearest = np.array([distances[k, :k].min() if k else np.inf for k in range(600)])
    least = np.minimum.accumulate(nearest)[1:] / 2
    counts = np.arange(2, 601)
    assert (least * (counts / 600) ** (1 / 6)).min() >= bound * (1 - 1e-9)


@pytest.mark.parametrize("n", [2, 3, 5])
@pytest.mark.parametrize("p", [1.0, 2.0, np.inf])
@pytest.mark.parametrize("low", [-1.0, -1.5, -0.9])
def test_a_ball_whose_box_touches_it_is_filled(n: int, p: float, low: float) -> None:
    """A face that only touches the ball was divided by 0."""
    region = ball([0.0] * n, [1.0] * n, p=p) & box([low] * n, [1.25] * n)
    points = progressive_fill(region, 60, seed=n).points
    assert len(points) == 60
    assert region.contains(points).all()


def test_a_ball_in_unit_coordinates_that_touches_its_range_is_filled() -> None:
    """Center 30 and radius 20 in the range 10 to 60 of a parameter from 1 to 100, as a sweep states it."""
    low, high = (10 - 1) / 99, (60 - 1) / 99
    region = ball([(30 - 1) / 99, 0.5], [20 / 99, 0.3]) & box([low, 0], [high, 1])
    assert region.contains(progressive_fill(region, 20).points).all()


@pytest.mark.parametrize(("n", "size"), [(3, 1e-3), (6, 1e-2), (8, 0.1)])
def test_a_small_simplex_in_a_cube_is_searched_as_a_simplex_alone(n: int, size: float) -> None:
    """The far faces of the cube, which it does not meet, made its ellipsoid 1e13 times as large."""
    alone = corner_simplex(n, size)
    around = [np.linalg.slogdet(anchor(region).metric)[1] for region in (alone, alone & unit_cube(n))]
    # of the centers of both, one lies nearer to the corner, and the ellipsoid around it is somewhat larger
    assert around[0] - around[1] < np.log(20.0) * n / 6


def test_a_slab_keeps_the_distance_of_its_parallel_faces() -> None:
    slab = halfspaces([[1, -1, 0], [-1, 1, 0]], [1e-3, 1e-3]) & unit_cube(3)
    region = anchor(slab)
    corners = np.array([[0, 1e-3, 0], [1, 1 - 1e-3, 1], [0, 0, 1], [1, 1, 0]])
    reached = (corners - region.center - region.ellipsoid_center) @ region.metric.T
    assert (np.linalg.norm(reached, axis=1) <= 1.0 + 1e-9).all()

# SPDX-License-Identifier: GPL-3.0-or-later
"""Figures do not depend on the unit of a basis, and regions not on that of a parameter."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from spectral_core import lattice
from spectral_core.cli import main
from spectral_core.errors import InvalidInputError

# Conway and Sloane, Sphere Packings, Lattices and Groups, tables 1.2 and 2.3: E7 in the scale of its roots.
E7_DIAGRAM = [(0, 1), (1, 2), (2, 3), (3, 4), (4, 5), (6, 2)]
E7_KISSING, E7_PACKING, E7_COVERING, E7_MOMENT = 126, math.sqrt(2) / 2, math.sqrt(3 / 2), 0.0732307


def _root_lattice(n: int, edges: list[tuple[int, int]]) -> np.ndarray:
    cartan = 2.0 * np.eye(n)
    for i, j in edges:
        cartan[i, j] = cartan[j, i] = -1.0
    return np.linalg.cholesky(cartan).T


@pytest.mark.parametrize("unit", [1e-200, 1e-100, 1e-5, 1e5, 1e100, 1e200])
def test_figures_in_any_unit(unit: float) -> None:
    merit = lattice.figures_of_merit(unit * _root_lattice(7, E7_DIAGRAM), samples=8192)
    assert merit.kissing_number == E7_KISSING
    assert merit.packing_radius / unit == pytest.approx(E7_PACKING, rel=1e-12)
    assert merit.covering_radius.lower / unit == pytest.approx(E7_COVERING, rel=1e-9)
    moment = merit.second_moment
    assert moment.value == pytest.approx(E7_MOMENT, abs=4 * moment.standard_error)


@pytest.mark.parametrize("unit", [1e-200, 1e-100, 1e100, 1e200])
def test_the_cell_of_cubes_in_any_unit(unit: float) -> None:
    cubes = unit * np.eye(3)
    cell = lattice.voronoi_cell(cubes)
    assert cell.face_counts == (8, 12, 6)
    assert cell.covering_radius / unit == pytest.approx(math.sqrt(3) / 2)
    assert cell.second_moment == pytest.approx(1 / 12)
    assert lattice.are_congruent(cubes, cubes[:, ::-1])
    assert not lattice.are_congruent(cubes, 1.01 * cubes)
    assert lattice.are_similar(cubes, np.eye(3))
    assert np.allclose(np.abs(lattice.shortest_vectors(cubes)[1]).max(axis=1) / unit, 1.0)


def test_nearest_vectors_of_far_targets() -> None:
    rng = np.random.default_rng(3)
    basis = rng.normal(size=(4, 4)) @ lattice.lll(np.eye(4))
    basis = basis @ lattice.lll(basis)
    wanted = rng.integers(-(10**9), 10**9, (50, 4))
    coefficients, squared = lattice.closest_vectors(basis, wanted @ basis.T)
    assert (coefficients == wanted).all()
    assert squared.max() < 1e-10
    assert lattice.closest_vectors(basis, np.zeros((0, 4)))[0].shape == (0, 4)


@pytest.mark.parametrize("call", [lambda x: lattice.closest_vectors(np.eye(2), [[x, 1.0]])])
@pytest.mark.parametrize("distance", [1e20, 1e300])
def test_a_target_beyond_double_precision_is_refused(call, distance: float) -> None:
    with pytest.raises(InvalidInputError, match="does not tell lattice vectors apart"):
        call(distance)


def test_wrong_values_are_refused() -> None:
    cubes = np.eye(5)
    for call, message in [
        (lambda: lattice.second_moment(cubes, samples="many"), "samples"),
        (lambda: lattice.second_moment(cubes, seed=-1), "seed"),
        (lambda: lattice.covering_radius(np.eye(7), starts=-1), "starts"),
        (lambda: lattice.shortest_vectors(np.ones((2, 2))), "condition number"),
        (lambda: lattice.separation(np.zeros((5, 0))), "dimension"),
        (lambda: lattice.prefix_separations(np.zeros((5, 0))), "dimension"),
        (lambda: lattice.box([0, 1e308], [1, -1e308]), "low < high"),
    ]:
        with pytest.raises(InvalidInputError, match=message):
            call()


@pytest.mark.parametrize("p", [500.0, 1e6, 1e300])
def test_a_ball_of_a_large_p_is_nearly_its_box(p: float) -> None:
    points = lattice.progressive_fill(lattice.ball([0, 0, 0], 2.0, p=p), 200, seed=1).points
    assert len(points) == 200
    assert np.abs(points).max() <= 2.0
    assert lattice.separation(points, volume=64.0) > 0.45  # 0.4825 without borders
    assert (np.abs(points).max(axis=0) > 1.6).all()


@pytest.mark.parametrize("options", [[], ["--ball", "2"], ["--latin"]])
def test_the_command_counts_distances_in_shares_of_the_ranges(options: list[str], tmp_path: Path, capsys) -> None:
    points, reports = [], []
    for low, high in (("0", "0", "0"), ("1", "1", "1")), (("0", "-1", "5"), ("360", "1e-9", "5.001")):
        out = tmp_path / "points.csv"
        given = ["lattice", "--dims", "3", "--points", "150", "--low", *low, "--high", *high, "--out", str(out)]
        assert main([*given, *options, "--json"]) == 0
        start, end = np.array(low, float), np.array(high, float)
        read = np.loadtxt(out, delimiter=",", skiprows=1)
        assert (read >= start).all()
        assert (read <= end).all()
        points.append((read - start) / (end - start))
        reports.append(json.loads(capsys.readouterr().out.splitlines()[-1])["packing_radius"])
    assert np.allclose(points[0], points[1], atol=1e-9)
    if not options:
        assert lattice.separation(points[1]) > 0.46


def test_ranges_with_few_numbers_are_refused_and_narrow_ones_printed_with_their_digits(tmp_path: Path, capsys) -> None:
    """Sixty-four points fell on 56 different ones, and the printed points of a narrow range were alike."""
    given, out = ["lattice", "--dims", "2", "--points", "64"], tmp_path / "points.csv"
    assert main([*given, "--low", "0", "1e12", "--high", "1e-323", "1000000000000.001", "--out", str(out)]) == 1
    said = capsys.readouterr().err
    assert "of 64 points differ" in said and "parameter 1" in said and not out.exists()
    assert main([*given, "--low", "0", "1e12", "--high", "1", "1000000000010"]) == 0
    printed = [line.split(",") for line in capsys.readouterr().out.splitlines() if line.count(",") == 1][-20:]
    assert len({line[1] for line in printed}) == 20 and all(1e12 <= float(line[1]) <= 1e12 + 10 for line in printed)


def test_a_damaged_description_of_a_sweep_is_refused() -> None:
    """Shifts of another lattice, and NaN, changed the order of the points without a word."""
    points = lattice.progressive_fill(lattice.unit_cube(2), 20)
    for shifts in [(9,), (-1,), (0.5,), (math.nan,), ("a",), 5, None]:
        with pytest.raises(InvalidInputError, match="shifts"):
            lattice.progressive_points(points.frame, points.region, shifts=shifts)
    plain = points.frame.to_dict()
    for name, value in [("middle", math.nan), ("spacing", "wide"), ("log_scales", None)]:
        with pytest.raises(InvalidInputError):
            lattice.Frame.from_dict({**plain, name: value})
    again = lattice.progressive_points(lattice.Frame.from_dict(plain), points.region, shifts=list(points.shifts))
    assert (again.points == points.points).all()


@pytest.mark.parametrize(
    "call",
    [
        lambda engine: engine(2, points=2.5),
        lambda engine: engine(2, points="many"),
        lambda engine: engine(2, lattice="hexagonal"),
        lambda engine: engine(True),
        lambda engine: engine(2).random(2.5),
        lambda engine: engine(2).fast_forward(2.5),
    ],
)
def test_the_engine_refuses_what_is_no_whole_number(call) -> None:
    from spectral_core.lattice.engine import LatticeEngine

    with pytest.raises(InvalidInputError, match="expected"):
        call(LatticeEngine)


@pytest.mark.parametrize("size", [1e-12, 1e-9, 1e-7, 1e-3, 1e9, 1e12])
@pytest.mark.parametrize("p", [1.0, 2.0, math.inf])
def test_a_cut_ball_of_any_size_is_filled(size: float, p: float) -> None:
    """A cut ball smaller than 1e-7 was called too thin, and one larger than 1e8 unbounded."""
    radii = size * np.array([1.0, 0.3, 0.5])
    regions = (
        lattice.ball(0.2 * radii, radii, p=p) & lattice.halfspaces([1.0 / radii], [0.4]),
        lattice.ball(0.0 * radii, radii, p=p) & lattice.box(-0.5 * radii, 0.9 * radii),
    )
    for region in regions:
        points = lattice.progressive_fill(region, 70, seed=2).points
        assert points.shape == (70, 3)
        assert region.contains(points).all()
        extents = np.ptp(points, axis=0) / radii
        assert extents.min() > 0.5 and extents.max() <= 2.0


@pytest.mark.parametrize("far", [1e3, 1e6, 1e9, 1e12])
def test_limits_far_away_make_no_region_too_thin(far: float) -> None:
    """A ball that does not limit an axis has a radius of 1e6 there; a box beside it was called too thin."""
    unit = lattice.box(np.zeros(2), np.ones(2))
    small = lattice.ball(np.array([0.3, 0.5]), np.array([0.02, 0.05]) / far)
    regions = [(unit & lattice.ball(np.array([0.3, 0.5]), np.array([0.1, far])), (0.2, 1.0))]
    if far <= 1e9:  # beyond, doubles near the ball are too far apart
        regions.append((unit & small, (0.04 / far, 0.1 / far)))
    strip = lattice.halfspaces([[0.0, 1.0], [0.0, -1.0]], [1.0, 0.0])
    if far <= 1e6:  # beyond, linear programs have no digits left
        regions.append((strip & lattice.ball(np.array([0.3, 0.5]), np.array([0.02, far])), (0.04, 1.0)))
        regions.append((unit & lattice.halfspaces([[1.0, 0.3], [-2.0, 1.0]], [far, 3.0 * far]), (1.0, 1.0)))
    for region, widths in regions:
        points = lattice.progressive_fill(region, 80, seed=1).points
        assert region.contains(points).all()
        assert np.all(np.ptp(points, axis=0) > 0.8 * np.array(widths))

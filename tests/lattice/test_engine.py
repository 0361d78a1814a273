# SPDX-License-Identifier: GPL-3.0-or-later
"""The SciPy engine, measures of evenness, Latin projections, the command and the pictures."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import qmc

from blender_addon.commands import main
from spectral_core.errors import InvalidInputError, UnknownNameError
from spectral_core.lattice import evenness, latinized, progressive_fill, separation, unit_cube
from spectral_core.lattice.engine import LatticeEngine


def test_the_engine_has_the_interface_of_scipys_engines() -> None:
    engine = LatticeEngine(4, points=256, rng=3)
    first, second = engine.random(100), engine.random(300)
    assert engine.num_generated == 400
    engine.reset()
    together = engine.random(400)
    anew = LatticeEngine(4, points=256, seed=3).random(400)
    for same in (np.concatenate([first, second]), anew):  # two fills may differ in last digits
        np.testing.assert_allclose(same, together, rtol=0, atol=1e-12)
    later = engine.reset().fast_forward(150).random(5)
    np.testing.assert_allclose(later, together[150:155], rtol=0, atol=1e-12)
    assert (together >= 0).all()
    assert (together < 1).all()
    assert qmc.scale(together, [0] * 4, [2] * 4).max() > 1.5
    assert LatticeEngine(3, rng=np.random.default_rng(1)).random(8).shape == (8, 3)
    assert LatticeEngine(3, rng=np.random.RandomState(1)).random(0).shape == (0, 3)
    assert not np.allclose(LatticeEngine(3).random(8), LatticeEngine(3).random(8))
    assert set(LatticeEngine(2, rng=1).integers(4, n=64).ravel().tolist()) == {0, 1, 2, 3}


def test_the_engine_is_more_separated_and_less_uniform_than_sobol() -> None:
    ours = evenness(LatticeEngine(4, points=512, rng=0).random(512), samples=4096)
    sobol = evenness(qmc.Sobol(4, seed=np.random.default_rng(0)).random(512), samples=4096)
    assert ours.separation > 2 * sobol.separation
    assert ours.mean_square < sobol.mean_square
    assert ours.discrepancy > sobol.discrepancy


def test_latinized_points_have_perfect_projections() -> None:
    points = progressive_fill(unit_cube(5), 300).points
    moved = latinized(points)
    for axis in range(5):
        assert np.allclose(np.sort(moved[:, axis]), (np.arange(300) + 0.5) / 300)
    assert evenness(moved, samples=1024).gap_1d == pytest.approx(1.0)
    assert separation(moved) > 0.8 * separation(points)
    assert np.sqrt(qmc.discrepancy(moved)) < 0.8 * np.sqrt(qmc.discrepancy(points))


@pytest.mark.parametrize("seed", range(4))
def test_rotations_in_few_dimensions_leave_no_large_gap_on_an_axis(seed: int) -> None:
    for dimensions in (2, 3):
        points = progressive_fill(unit_cube(dimensions), 256, seed=seed).points
        assert evenness(points, samples=1024).gap_1d < 5.0


def test_measures_of_a_grid_have_their_known_values() -> None:
    middles = (np.arange(8) + 0.5) / 8
    grid = np.stack(np.meshgrid(middles, middles), axis=-1).reshape(-1, 2)
    measured = evenness(grid, samples=65536)
    assert measured.separation == pytest.approx(0.5)
    assert measured.fill_distance == pytest.approx(np.sqrt(0.5))
    assert measured.mean_square == pytest.approx(1 / 12, rel=1e-3)
    assert measured.gap_1d == pytest.approx(8.0)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: LatticeEngine(3, points=0), "points is 0"),
        (lambda: LatticeEngine(0), "0 dimensions"),
        (lambda: LatticeEngine(2).random(-1), "n is -1"),
        (lambda: LatticeEngine(2).fast_forward(-1), "n is -1"),
        (lambda: LatticeEngine(2, rng=1, seed=1), "give one"),
        (lambda: evenness([[0.5, 1.5], [0.0, 0.0]]), "unit cube"),
        (lambda: latinized([[0.5, 1.5]]), "outside the box"),
        (lambda: separation([[0.5, 0.5]]), "at least 2"),
    ],
)
def test_an_error_names_wrong_input(call: object, message: str) -> None:
    with pytest.raises(InvalidInputError, match=message):
        call()  # type: ignore[operator]


def test_command_writes_the_points(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "points.csv"
    options = ["--dims", "3", "--points", "30", "--low", "-1", "--high", "1", "2", "3", "--refine", "1"]
    assert main(["lattice", *options, "--out", str(out), "--json"]) == 0
    report = json.loads(capsys.readouterr().out.splitlines()[-1])
    table = np.loadtxt(out, delimiter=",", skiprows=1)
    assert out.read_text().startswith("x1,x2,x3\n")
    assert len(table) == report["points"] > 45
    assert (table >= -1).all()
    assert (table <= [1, 2, 3]).all()
    again = progressive_fill(unit_cube(3), 30)
    assert report["packing_radius"] == pytest.approx(0.482535, abs=1e-6)
    assert len(again) == 30


@pytest.mark.parametrize(
    "options",
    [["--dims", "4", "--ball", "1.5"], ["--dims", "3", "--simplex"], ["--dims", "2", "--latin"], ["--points", "1"]],
)
def test_command_accepts_every_region(options: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["lattice", *([] if "--points" in options else ["--points", "20"]), *options]) == 0
    assert "packing radius" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--dims", "3", "--low", "0", "1"], "expected 1 or one per parameter"),
        (["--points", "-4"], "--points is -4"),
        (["--dims", "0"], "dimensions"),
        (["--dims", "2", "--ball", "2", "--latin"], "only a box keeps"),
        (["--criterion", "best"], "no lattice criterion"),
    ],
)
def test_command_reports_wrong_input(options: list[str], message: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["lattice", *options, "--json"]) == 1
    captured = capsys.readouterr()
    assert message in captured.err
    assert message in json.loads(captured.out.splitlines()[-1])["error"]


def test_pictures_are_drawn(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    from spectral_core.lattice.measure.plotting import PICTURES, draw, draw_all

    files = draw_all(tmp_path, 3)
    assert set(files) == set(PICTURES)
    assert all(path.read_bytes().startswith(b"\x89PNG") for path in files.values())
    with pytest.raises(UnknownNameError, match="nested"):
        draw("nest", tmp_path / "x.png")


def test_the_command_states_what_would_take_hours(capsys: pytest.CaptureFixture[str]) -> None:
    """``--refine 30`` ran for minutes before an error, and a hundred thousand points took minutes for one figure."""
    assert main(["lattice", "--refine", "30"]) == 1
    error = capsys.readouterr().err
    assert "--points 64 with --refine 30 makes about 6.87e+10 points; expected at most 10,000,000" in error
    assert main(["lattice", "--points", "10000001"]) == 1
    assert "--points is 10000001; expected 0 to 10,000,000" in capsys.readouterr().err
    assert main(["lattice", "--points", "21000", "--dims", "3", "--json"]) == 0
    printed = capsys.readouterr().out
    assert "discrepancy    not computed: more than 20,000 points" in printed
    assert json.loads(printed.splitlines()[-1])["evenness"]["discrepancy"] is None
    assert np.isfinite(evenness(np.random.default_rng(1).random((300, 2))).discrepancy)


@pytest.mark.parametrize("dimensions", [11, 13, 16])
def test_points_of_many_dimensions_are_farther_apart_than_sobol_points(dimensions: int) -> None:
    """With unit scales they were nearer to each other than random points."""
    from scipy.spatial.distance import pdist

    ours = pdist(LatticeEngine(dimensions, points=64, rng=1).random(64)).min()
    sobol = pdist(qmc.Sobol(dimensions, rng=np.random.default_rng(1)).random(64)).min()
    assert ours > 1.05 * sobol

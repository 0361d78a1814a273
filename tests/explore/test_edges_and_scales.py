# SPDX-License-Identifier: GPL-3.0-or-later
"""Regions at their borders and in small units, and measures of pictures that a display cannot show."""

from __future__ import annotations

from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.stats import qmc

from spectral_core.errors import InvalidInputError
from spectral_core.explore.analysis.embedding import spectral_embedding
from spectral_core.explore.features.expression import evaluate
from spectral_core.explore.features.images import difference_features, image_features
from spectral_core.explore.features.picture_files import read_display, read_linear
from spectral_core.explore.sweep.batches.latin import latin_batches
from spectral_core.explore.sweep.designs import Design, design_points
from spectral_core.explore.sweep.document import sweep_of
from spectral_core.explore.sweep.parameters import Parameter, Space
from spectral_core.explore.sweep.region import RegionOfInterest, bounding_region
from spectral_core.lattice import corner_simplex, progressive_points, unit_cube

FUNCTION = {"kind": "function", "function": "none.py:f"}


def points_of(parameters: list[dict[str, Any]], **tables: Any) -> list[dict[str, Any]]:
    sweep = sweep_of({"compute": FUNCTION, "parameters": parameters, **tables}, Path())
    return design_points(sweep.space, sweep.region, sweep.design.placed(sweep.space))[0]


@pytest.mark.parametrize("unit", [1e-13, 1e-7, 1.0, 1e9])
@pytest.mark.parametrize(("sign", "kept"), [("<=", [1, 4, 5]), ("<", [1, 4])])
def test_constraints_hold_in_any_unit(unit: float, sign: str, kept: list[int]) -> None:
    """Sums were compared to a millionth of a millionth, whatever the size of the values: small ones all passed."""
    listed = [{"a": number * unit} for number in (1, 4, 5, 6, 9)]
    found = points_of(
        [{"name": "a", "low": 0, "high": 10 * unit}],
        region={"constraints": [f"a {sign} {5 * unit!r}"]},
        design={"points": listed},
    )
    assert [round(point["a"] / unit) for point in found] == kept


@pytest.mark.parametrize(("p", "name"), [(1, 1), (2, 2), (float("inf"), "inf")])
def test_a_ball_has_its_border_whatever_other_parameters_are(p: float, name: Any) -> None:
    """Points on the border were left out if a parameter without a radius was not in the middle of its range."""
    axes = [{"name": axis, "low": 0, "high": 10, "kind": "integer"} for axis in "nmk"]
    ball = {"center": {"n": 5, "m": 4}, "radii": {"n": 2, "m": 3}, "p": name}
    found = points_of(axes, region={"ball": ball}, design={"budget": 2000})
    shares = [(abs(n - 5) / 2, abs(m - 4) / 3) for n, m, _ in product(range(11), repeat=3)]
    inside = [max(each) if p == float("inf") else sum(x**p for x in each) ** (1 / p) for each in shares]
    assert len(found) == sum(each <= 1 + 1e-12 for each in inside)


def test_the_region_of_a_single_row_stays_in_the_range_of_the_sweep() -> None:
    """A roughness of 0 gave a region from -0.005, half of whose points could not be rendered."""
    space = Space((Parameter("rough"), Parameter("power", 1.0, 100.0, scale="log")))
    low = bounding_region(space, [{"rough": 0.0, "power": 1.0}]).ranges
    high = bounding_region(space, [{"rough": 1.0, "power": 100.0}]).ranges
    assert low["rough"] == (0.0, pytest.approx(0.005)) and high["rough"] == (pytest.approx(0.995), 1.0)
    assert low["power"][0] == pytest.approx(1.0) and high["power"][1] == pytest.approx(100.0)
    beyond = bounding_region(space, [{"rough": 1.5, "power": 10.0}]).ranges  # a region beyond the range was asked for
    assert beyond["rough"] == pytest.approx((1.495, 1.505))


def test_many_rows_around_their_mean_are_embedded() -> None:
    """ARPACK refused to begin with the vector of ones, whose eigenvalue is 0 here."""
    corners = np.concatenate([np.eye(4), -np.eye(4)] * 200)
    where = spectral_embedding(corners, "centered")
    assert where.shape == (1600, 2) and np.isfinite(where).all() and np.abs(where).max() > 1


def test_a_black_reference_has_the_worst_ratio() -> None:
    """It had the best one, infinity, as equal pictures have."""
    black, gray = np.zeros((4, 4, 3)), np.full((4, 4, 3), 0.5)
    assert difference_features(gray, black)["snr_db"] == -np.inf
    assert difference_features(black, black)["snr_db"] == np.inf


def test_the_color_of_a_picture_under_sodium_light_is_its_own() -> None:
    """The mean was clipped to a display's colors first: b* of sodium yellow was 91 instead of 177."""
    xyz = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
    mean = np.array([1.6, 0.55, -0.12])
    x, y, z = xyz @ mean / (xyz @ np.ones(3))

    def f(ratio: float) -> float:
        return float(np.cbrt(ratio)) if ratio > 216 / 24389 else (24389 / 27 * ratio + 16) / 116

    expected = 116 * f(y) - 16, 500 * (f(x) - f(y)), 200 * (f(y) - f(z))
    found = image_features(np.broadcast_to(mean, (4, 4, 3)))
    assert [found[name] for name in ("lab_lightness", "lab_a", "lab_b")] == pytest.approx(expected, abs=0.3)


def test_gray_pictures_of_16_bits_keep_their_levels(tmp_path: Path) -> None:
    """All levels above 255 of 65,535 were white."""
    image = pytest.importorskip("PIL.Image")
    levels = np.array([[0, 255, 257, 12850, 32896, 65535]], np.uint16)
    image.fromarray(np.repeat(levels, 3, axis=0)).save(tmp_path / "gray.png")
    assert read_display(tmp_path / "gray.png")[1].tolist() == [[level] * 3 for level in (0, 1, 1, 50, 128, 255)]
    assert read_linear(tmp_path / "gray.png")[0, 4, 1] == pytest.approx(((128 / 255 + 0.055) / 1.055) ** 2.4, abs=1e-6)


@pytest.mark.parametrize("kind", ["lattice", "sobol", "latin_hypercube"])
def test_a_budget_above_the_number_of_combinations_takes_all_of_them(kind: str) -> None:
    """From 4097 combinations on, a minute passed before a message about constraints that there were not."""
    whole = [{"name": name, "low": 0, "high": 79, "kind": "integer"} for name in "ab"]
    found = points_of(whole, design={"kind": kind, "budget": 20_000})
    assert {(point["a"], point["b"]) for point in found} == set(product(range(80), repeat=2)) and len(found) == 6400


def test_all_combinations_come_in_the_order_of_the_design() -> None:
    """They came sorted, so that a run that ended early had the first choices alone."""
    parameters = [{"name": "lamp", "choices": list("abcdef")}, {"name": "k", "low": 1, "high": 10, "kind": "integer"}]
    found = points_of(parameters, design={"budget": 100})
    assert len({(point["lamp"], point["k"]) for point in found}) == len(found) == 60
    first = found[:20]
    assert {point["lamp"] for point in first} == set("abcdef")
    assert max(sum(point["k"] == k for point in first) for k in range(1, 11)) <= 4


def test_whole_numbers_in_a_flat_region_are_all_taken() -> None:
    whole = [{"name": name, "low": 0, "high": 20, "kind": "integer"} for name in "ab"]
    found = points_of(whole, region={"constraints": ["a <= b", "b <= a"]}, design={"budget": 21})
    assert sorted((point["a"], point["b"]) for point in found) == [(k, k) for k in range(21)]


@pytest.mark.parametrize("chosen", [["b"], ["f", "a"], list("abcdef")])
def test_a_latin_hypercube_is_even_on_every_axis_when_few_values_are_chosen(chosen: list[str]) -> None:
    """It was made of the parts of several hypercubes: a third of the strata had no point."""
    parameters = [{"name": name, "low": 0.0, "high": 1.0} for name in "xy"] + [{"name": "m", "choices": list("abcdef")}]
    found = points_of(
        parameters, region={"choices": {"m": chosen}}, design={"kind": "latin_hypercube", "budget": 60, "seed": 4}
    )
    for name in "xy":
        assert sorted(int(point[name] * 60) for point in found) == list(range(60))
    counts = [sum(point["m"] == value for point in found) for value in chosen]
    assert counts == [60 // len(chosen)] * len(chosen)


@pytest.mark.parametrize("chosen", [["b"], ["f", "a"], ["a", "c", "d", "f"]])
def test_sobol_points_are_even_when_few_values_are_chosen(chosen: list[str]) -> None:
    """Points with other values were left out: a third of the strata of every axis had no point."""
    parameters = [{"name": name, "low": 0.0, "high": 1.0} for name in "xy"] + [{"name": "m", "choices": list("abcdef")}]
    found = points_of(parameters, region={"choices": {"m": chosen}}, design={"kind": "sobol", "budget": 64, "seed": 4})
    for name in "xy":
        assert sorted(int(point[name] * 64) for point in found) == list(range(64))
    assert [sum(point["m"] == value for point in found) for value in chosen] == [64 // len(chosen)] * len(chosen)


@pytest.mark.parametrize(
    "region",
    [
        {"constraints": ["a + b + c <= 1.5"]},
        {"constraints": ["a >= b"], "ranges": {"c": [0.2, 3.0]}},
        {"ball": {"center": dict.fromkeys("abc", 0.5), "radii": dict.fromkeys("abc", 0.5)}},
    ],
)
def test_a_latin_hypercube_is_even_on_every_axis_of_a_region_that_is_no_box(region: dict[str, Any]) -> None:
    """Each axis has one point between neighboring quantiles of the region; it had none between a quarter of them."""
    parameters = [{"name": name, "low": 0.0, "high": 1.0} for name in "abc"]
    count = 50
    found = points_of(parameters, region=region, design={"kind": "latin_hypercube", "budget": count, "seed": 2})
    points = np.array([[point[name] for name in "abc"] for point in found])
    drawn = np.random.default_rng(5).random((200_000, 3))
    if "ball" in region:
        drawn = drawn[((drawn - 0.5) ** 2).sum(axis=1) <= 0.25]
    elif "ranges" in region:
        drawn = drawn * [1, 1, 2.8] + [0, 0, 0.2]
        drawn = drawn[drawn[:, 0] >= drawn[:, 1]]
    else:
        drawn = drawn[drawn.sum(axis=1) <= 1.5]
    for axis in range(3):
        shares = np.searchsorted(np.sort(drawn[:, axis]), points[:, axis]) / len(drawn)
        # the quantiles of the design are those of a sample, so points near them may be on either side
        assert len(set((shares * count).astype(int))) >= 0.8 * count
        assert np.abs(np.sort(shares) - (np.arange(count) + 0.5) / count).max() < 1.2 / count + 0.02
    assert np.abs(points.mean(axis=0) - drawn.mean(axis=0)).max() < 0.01


@pytest.mark.parametrize("kind", ["sobol", "latin_hypercube"])
@pytest.mark.parametrize(
    "region",
    [
        {"constraints": ["a + b <= 0.5", "a + b >= 0.6"]},
        {"constraints": ["a <= -1"]},
        {"constraints": ["a + b >= 1.9"], "ball": {"center": {"a": 0.5, "b": 0.5}, "radii": {"a": 0.2, "b": 0.2}}},
    ],
)
def test_constraints_that_exclude_each_other_are_said_to(kind: str, region: dict[str, Any]) -> None:
    """A million points were drawn first, which took up to minutes."""
    parameters = [{"name": name, "low": 0.0, "high": 1.0} for name in "ab"]
    with pytest.raises(InvalidInputError, match="the region is empty: its ranges, constraints and ball exclude"):
        points_of(parameters, region=region, design={"kind": kind, "budget": 1000})


def test_a_small_region_has_the_points_of_all_levels_in_their_order() -> None:
    """Its first point is many levels below that of the ranges; level by level they took 9 s in 6 dimensions."""
    names = "abcdef"
    space = Space(tuple(Parameter(name) for name in names))
    region = RegionOfInterest(constraints=(" + ".join(names) + " <= 1e-2",))
    design = Design(budget=40).placed(space)
    found = np.array([space.coordinates(point) for point in design_points(space, region, design)[0]])
    points = progressive_points(design.frame, region.in_unit_cube(space), shifts=design.shifts)
    while len(points) < 40:
        points = points.refine()
    np.testing.assert_array_equal(found, points.points[:40])


def test_a_region_below_the_finest_level_says_what_to_do() -> None:
    """The advice was to take a smaller region."""
    names = "abcdef"
    with pytest.raises(InvalidInputError, match="Widen the region, or choose the design Sobol"):
        points_of(
            [{"name": name} | {"low": 0, "high": 1} for name in names],
            region={"constraints": [" + ".join(names) + " <= 1e-3"]},
        )


def test_large_hypercubes_are_not_exchanged_point_by_point(monkeypatch: pytest.MonkeyPatch) -> None:
    """A hypercube of 100,000 points took minutes."""
    asked: list[Any] = []

    class Recorded(qmc.LatinHypercube):
        def __init__(self, d: int, *, optimization: Any = None, rng: Any = None) -> None:
            asked.append(optimization)
            super().__init__(d, rng=rng)

    monkeypatch.setattr(qmc, "LatinHypercube", Recorded)
    for budget in (20, 100_000):
        points = next(latin_batches(unit_cube(2), budget, 0))
        assert np.array_equal(np.sort((points * budget).astype(int), axis=0), np.arange(budget)[:, None] + [[0, 0]])
    assert asked == ["random-cd", None]


@pytest.mark.parametrize("name", ["\u00b5_s", "\u2126", "\ufb01eld"])  # micro sign, ohm sign, a ligature
def test_names_are_found_as_they_were_typed(name: str) -> None:
    """Python's parser reads the micro sign as a Greek letter, so that no column of this name was found."""
    assert evaluate(f"2 * {name}", {name: [1.0, 2.0]}) == [2.0, 4.0]
    found = points_of([{"name": name, "low": 0, "high": 1}], region={"constraints": [f"{name} <= 0.25"]})
    assert len(found) == 64 and max(point[name] for point in found) <= 0.25


@pytest.mark.parametrize("name", ["lambda", "True", "x\u00b2"])
def test_names_that_mean_something_else_are_named(name: str) -> None:
    """`2 * True` was 2 in every row, and `2 * lambda` was no valid syntax."""
    with pytest.raises(InvalidInputError, match=f"{name}.*give the column another name"):
        evaluate(f"2 * {name}", {name: [1.0, 3.0]})
    with pytest.raises(InvalidInputError, match="give the column another name"):
        points_of([{"name": name, "low": 0, "high": 1}], region={"constraints": [f"{name} <= 0.25"]})


def test_a_latin_hypercube_in_a_simplex_is_even_on_each_axis() -> None:
    """A coordinate of a simplex has the beta distribution; 10 % of the parts between its quantiles had no point."""
    share = [1.0 - (1.0 - next(latin_batches(corner_simplex(3), 100, seed))) ** 3 for seed in range(3)]
    filled = [len(np.unique((100 * axis).astype(int))) for each in share for axis in each.T]
    assert np.mean(filled) > 96

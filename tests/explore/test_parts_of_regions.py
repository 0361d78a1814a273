# SPDX-License-Identifier: GPL-3.0-or-later
"""What is added to, proposed in and measured over a sweep's region stays in it: constraints, ranges, chosen values."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import qmc

from benchmarks.explore.checks.browser import Browser, find_browser
from spectral_core.errors import InvalidInputError
from spectral_core.explore.analysis.sensitivity import sobol_indices
from spectral_core.explore.analysis.steps import (
    add_clusters,
    add_distance,
    print_sensitivity,
    proposed_point,
    region_of_label,
)
from spectral_core.explore.page.build import PageTable, table_of_store, write_page
from spectral_core.explore.page.live import LiveSweep
from spectral_core.explore.sweep.document import sweep_of
from spectral_core.explore.sweep.parameters import Parameter, Space
from spectral_core.explore.sweep.region import RegionOfInterest
from spectral_core.explore.sweep.sweep import Sweep

STATUS = "document.getElementById('status').textContent"
FUNCTION = (
    "def far(a, b, **others):\n    return {'y': (a - 1) ** 2 + (b - 1) ** 2 + sum(map(float, others.values()))}\n"
)


def _finished(tmp_path: Path, region: dict, budget: int = 24, parameters: list | None = None) -> Sweep:
    """A sweep whose points have the outcome of FUNCTION, without workers."""
    (tmp_path / "far.py").write_text(FUNCTION)
    axes = [{"name": name, "low": 0.0, "high": 1.0} for name in "ab"] + (parameters or [])
    plain = {"compute": {"kind": "function", "function": "far.py:far"}, "parameters": axes, "region": region,
             "design": {"budget": budget}}  # fmt: skip
    sweep = Sweep(sweep_of(plain, tmp_path), tmp_path / "far")
    sweep.plan()
    names: dict[str, object] = {}
    exec(FUNCTION, names)
    for row in sweep.store.ledger.rows():
        sweep.store.ledger.commit(row.key, names["far"](**row.parameters), {}, 0.1)  # type: ignore[operator]
    return sweep


@pytest.mark.parametrize("rows", [6, 20])
def test_intervals_of_few_rows_hold_the_true_indices(rows: int) -> None:
    """The rest was not counted below 32 rows: of 64 first indices of such a sum, 12 were in their 95 % interval."""
    names = [str(k) for k in range(16)]
    shares = np.arange(1.0, 17.0) ** 2 / 1496
    points = qmc.LatinHypercube(16, rng=0).random(rows)
    found = sobol_indices(points, points @ np.arange(1.0, 17.0), names, base=256)
    held = [one.first_interval[0] <= shares[int(one.name)] <= one.first_interval[1] for one in found]
    assert sum(held) >= 15 and (rows > 6 or np.isnan(found[0].explained))


def test_a_proposal_lies_in_the_region_and_is_new(tmp_path: Path) -> None:
    """It was a point of the whole cube, also where a constraint excludes it, and could be one that was computed."""
    (tmp_path / "slanted").mkdir()
    sweep = _finished(tmp_path / "slanted", {"constraints": ["a + b <= 1"]})
    found = proposed_point(sweep.store, "y")
    assert 0.95 < found["a"] + found["b"] <= 1 + 1e-9
    (tmp_path / "beyond").mkdir()
    sweep = _finished(tmp_path / "beyond", {"ranges": {"a": [0.0, 3.0], "b": [0.0, 0.5]}})
    found = proposed_point(sweep.store, "y")
    assert 0.5 < found["a"] < 1.5 and 0.4 < found["b"] <= 0.5
    (tmp_path / "counted").mkdir()
    steps = [{"name": "n", "low": 0, "high": 3, "kind": "integer"}]
    sweep = _finished(tmp_path / "counted", {"ranges": {"n": [1, 3]}}, parameters=steps)
    found = proposed_point(sweep.store, "y")
    assert found["n"] in (1, 2, 3) and found not in [row.parameters for row in sweep.store.ledger.rows()]


def test_sensitivities_are_over_the_ranges_and_values_of_the_region(tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    space = Space((Parameter("a"), Parameter("b"), Parameter("kind", kind="choice", choices=(1, 2, 3, 4))))
    points = rng.random((150, 3))
    points[:, 2] = (np.floor(4 * points[:, 2]) + 0.5) / 4
    values = points[:, 0] + points[:, 1] + 2.0 * points[:, 2]
    region = RegionOfInterest({"a": (0.4, 0.6)}, {"kind": (1, 4)})
    found = {
        one.name: one.first
        for one in sobol_indices(points, values, space.names, spread=lambda drawn: region.spread(space, drawn))
    }
    # variances by hand: of a range w it is w²/12, of two equally likely values that are d apart d²/4
    shares = np.array([0.2**2 / 12, 1 / 12, (2 * 0.75) ** 2 / 4])
    assert [found[name] for name in space.names] == pytest.approx(shares / shares.sum(), abs=0.01)


def test_indices_of_a_constrained_region_say_what_they_are_over(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    print_sensitivity(_finished(tmp_path, {"constraints": ["a + b <= 1"]}).store, "y")
    assert "also where its constraints and its ball exclude settings" in capsys.readouterr().out


def test_points_around_a_selection_meet_the_constraints_of_the_sweep(tmp_path: Path) -> None:
    """More than half of them did not, and points of a label's region neither."""
    sweep = _finished(tmp_path, {"constraints": ["a + b <= 1"]})
    store = sweep.store
    live = LiveSweep(store)
    assert live.sample({"region": {"ranges": {"a": [0.2, 0.9], "b": [0.1, 0.8]}}, "budget": 40})["new"] == 40
    points = [row.parameters for row in store.ledger.rows("pending")]
    assert len(points) == 40 and all(one["a"] + one["b"] <= 1 + 1e-9 for one in points)
    assert all(0.2 <= one["a"] <= 0.9 and 0.1 <= one["b"] <= 0.8 for one in points)
    assert live.refine({})["new"] == 64  # twice as many as the 24 of the design and these 40
    live.close()
    store.label("kind", {row.key: "good" for row in store.ledger.rows("done")})
    assert region_of_label(store, "kind", "good")["constraints"] == ["a + b <= 1"]


def test_a_row_without_a_value_has_no_distance(tmp_path: Path) -> None:
    """It had the distance of a row with the mean."""
    store = _finished(tmp_path, {}, budget=6).store
    keys = [row.key for row in store.ledger.rows()]
    store.label("grade", {key: float(number) for number, key in enumerate(keys[:4])})
    assert add_distance(store, keys[0], {"grade": 1.0, "y": 0.0}) == 4
    found = store.columns()["distance"]
    assert found[:4] == pytest.approx([0, 1 / 3, 2 / 3, 1]) and found[4:] == [None, None]
    with pytest.raises(InvalidInputError, match="has no value of 'grade'"):
        add_distance(store, keys[5], {"grade": 1.0})


def test_clusters_say_where_a_mean_was_taken(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    store = _finished(tmp_path, {}, budget=6).store
    keys = [row.key for row in store.ledger.rows()]
    store.label("grade", {key: float(number) for number, key in enumerate(keys[:4])})
    add_clusters(store, 2, ["y", "grade"])
    assert "note: values are missing of grade at 2 of 6 points" in capsys.readouterr().out
    add_clusters(store, 2, ["y"])
    assert "note" not in capsys.readouterr().out


@pytest.mark.skipif(find_browser() is None, reason="no Chromium")
def test_a_page_saves_the_region_with_its_limits_and_refuses_an_empty_selection(tmp_path: Path) -> None:
    ball = {"center": {"a": 0.2, "b": 0.2}, "radii": {"a": 0.9, "b": 0.9}, "p": 2.0}
    sweep = _finished(tmp_path, {"constraints": ["a + b <= 1"], "ball": ball})
    path = write_page(tmp_path / "page.html", table_of_store(sweep.store), thumbnails=False)
    with Browser(900, 700) as page:
        page.open(path.resolve().as_uri())
        page.run("globalThis.saved = []; URL.createObjectURL = (blob) => { saved.push(blob); return 'blob:x'; }; 0")
        page.run("HTMLAnchorElement.prototype.click = () => {}; 0")
        page.run("document.getElementById('export-region').click(); 0")
        assert page.run("saved.length") == 0 and "Select points" in page.run(STATUS)
        page.run("explorer.select(new Uint8Array(explorer.table.count).fill(1))")
        page.run("document.getElementById('export-region').click(); 0")
        region = tomllib.loads(page.run("saved[0].text()"))["region"]
    read = RegionOfInterest.from_dict(region).checked(sweep.document.space)
    assert read.constraints == ("a + b <= 1",) and read.ball == sweep.document.region.ball


@pytest.mark.skipif(find_browser() is None, reason="no Chromium")
def test_a_page_writes_numbers_as_they_were(tmp_path: Path) -> None:
    """0.1 was 0.10000000149011612 in the page's CSV, as it keeps outcomes with 32 bits."""
    values = [0.1, -2.5e-7, 3.0, 123.456, None]
    path = write_page(tmp_path / "page.html", PageTable("one", "one", {"v": values}, list("abcde")))
    with Browser(900, 700) as page:
        page.open(path.resolve().as_uri())
        cells = [line.split(",")[1] for line in page.run("explorer.csv()").splitlines()[1:]]
    assert cells[-1] == "NaN" and list(map(float, cells[:-1])) == values[:-1]


@pytest.mark.skipif(find_browser() is None, reason="no Chromium")
def test_no_point_is_applied_before_one_is_picked(tmp_path: Path) -> None:
    """The first row was applied to the scene, without a word."""
    path = tmp_path / "page.html"
    from spectral_core.explore.page.build import page_html

    path.write_text(page_html(PageTable("one", "one", {"v": [1.0, 2.0]}, ["k", "l"]), live=True))
    with Browser(900, 700) as page:
        page.open(path.resolve().as_uri())
        page.run(
            "globalThis.asked = []; globalThis.fetch = async (to) => { asked.push(to); throw Error('no server'); }; 0"
        )
        page.run("document.getElementById('live-apply').click(); 0")
        assert "Click a point first" in page.run(STATUS)
        page.run("explorer.pick(1); document.getElementById('live-apply').click(); 0")
        assert page.run("asked") == ["api/apply"]

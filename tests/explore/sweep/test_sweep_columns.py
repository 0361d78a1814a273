# SPDX-License-Identifier: GPL-3.0-or-later
"""Columns of a table that come late, that are gone, or that have a name which the outcome has, too."""

from __future__ import annotations

import json
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from spectral_core.cli import main
from spectral_core.errors import InvalidInputError
from spectral_core.explore.analysis.steps import add_clusters, add_distance, add_embedding
from spectral_core.explore.sweep.cinema import read_csv
from spectral_core.explore.sweep.document import read_sweep
from spectral_core.explore.sweep.runner import SweepReport
from spectral_core.explore.sweep.store import Store
from spectral_core.explore.sweep.sweep import Sweep
from tests.explore.sweep.test_sweep import opened, sweep_file

REFERENCE = "reference = {a = 0.5, b = 0.25}\n"


def ran(folder: Path, text: str) -> tuple[Sweep, SweepReport]:
    """A sweep of a document, after a run."""
    (folder / "sweep.toml").write_text(text)
    sweep = Sweep(read_sweep(folder / "sweep.toml"), folder / "out")
    with ThreadPoolExecutor(1) as pool:
        return sweep, sweep.run(sweep.plan(), executor=pool)


def text_of_sweep(folder: Path, **options: Any) -> str:
    return sweep_file(folder, **options).read_text()


def test_a_column_is_computed_from_those_of_the_comparison_with_the_reference(tmp_path: Path) -> None:
    """The table before the comparison ended the run: there was no column of that name yet."""
    text = REFERENCE + text_of_sweep(tmp_path, function="picture", budget=5)
    sweep, report = ran(tmp_path, text + '[columns]\nerror_db = "20 * log10(rmse)"\n')
    assert (report.computed, report.not_compared, report.not_computed) == (5, "", {})
    columns = sweep.store.columns()
    assert columns["error_db"] == pytest.approx(20 * np.log10(np.array(columns["rmse"], float)))
    assert [row["error_db"] for row in read_csv(tmp_path / "out.cdb" / "data.csv")[1]] == columns["error_db"]


def test_a_stopped_sweep_with_such_a_column_can_be_explored_and_continued(tmp_path: Path) -> None:
    text = REFERENCE + text_of_sweep(tmp_path, function="picture", budget=5)
    (tmp_path / "sweep.toml").write_text(text + '[columns]\nerror_db = "20 * log10(rmse)"\n')
    first = Sweep(read_sweep(tmp_path / "sweep.toml"), tmp_path / "out")
    done: list[int] = []
    watch: dict[str, Any] = {"on_progress": lambda _: done.append(1), "should_stop": lambda: bool(done)}
    with ThreadPoolExecutor(1) as pool:
        report = first.run(first.plan(), executor=pool, in_flight=1, **watch)
    assert report.cancelled and first.store.columns()["error_db"] == [None]
    first.store.close()
    assert main(["explore", str(tmp_path / "out"), "--no-thumbnails"]) == 0
    assert main(["sweep", str(tmp_path / "sweep.toml"), "--out", str(tmp_path / "out")]) == 0
    with Store.open(tmp_path / "out") as store:
        assert None not in store.columns()["error_db"] and len(store.columns()["error_db"]) == 5


def test_a_column_with_a_typing_error_is_empty_and_named_until_it_is_right(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """No command could read the folder any more, even after the column was removed from the file."""
    text = text_of_sweep(tmp_path, budget=4)
    folder = str(tmp_path / "out")
    for column, status in (('double = "2 * som"', 1), ("", 0), ('double = "2 * sum"', 0)):
        (tmp_path / "sweep.toml").write_text(f"{text}[columns]\n{column}\n")
        assert main(["sweep", str(tmp_path / "sweep.toml"), "--out", folder, "--json"]) == status
        said = capsys.readouterr()
        reasons = json.loads(said.out.splitlines()[-1])["not_computed"]
        assert ("'som'" in reasons.get("double", "")) == bool(status) == ("'double' is not computed" in said.err)
        assert main(["explore", folder, "--no-thumbnails"]) == 0
        assert ("'double' is not computed" in capsys.readouterr().err) == (column != 'double = "2 * sum"')
    with Store.open(tmp_path / "out") as store:
        assert store.columns()["double"] == [2 * each for each in store.columns()["sum"]]


def test_labels_that_an_expression_reads_may_be_erased(tmp_path: Path) -> None:
    """The folder could not be read afterward."""
    sweep = opened(tmp_path, budget=4)
    with ThreadPoolExecutor(1) as pool:
        sweep.run(sweep.plan(), executor=pool)
    store, keys = sweep.store, sweep.store.columns()["key"]
    store.label("mark", {keys[1]: "good"})
    store.derive("good", 'where(mark == "good", 1, 0)')
    assert store.columns()["good"] == [None, 1.0, None, None]  # a point without a label
    store.label("mark", {keys[1]: None})
    assert store.columns()["good"] == [None] * 4 and "'mark'" in store.not_computed["good"]
    store.derive("twice", "2 * sum")  # what it reads is there
    with pytest.raises(InvalidInputError, match="'twice'"):
        store.derive("twice", "2 * twice")
    store.derive("four", "2 * twice")
    with pytest.raises(InvalidInputError, match="'four', which reads 'twice'"):
        store.derive("twice", '"text"')
    assert store.columns()["four"] == [4 * each for each in store.columns()["sum"]]


def test_no_analysis_replaces_a_value_of_the_outcome(tmp_path: Path) -> None:
    """Each of them wrote its numbers over those that the swept function had returned."""
    text = REFERENCE + text_of_sweep(tmp_path, function="named_like_columns", budget=6)
    sweep, report = ran(tmp_path, text)
    assert "'rmse' is not a manual column" in report.not_compared
    store = sweep.store
    for add in (lambda: add_embedding(store, "cosine", ["a", "b"]), lambda: add_clusters(store, 2, ["a", "b"]),
                lambda: add_distance(store, store.columns()["key"][0], {"a": 1.0})):  # fmt: skip
        with pytest.raises(InvalidInputError, match="is not a manual column"):
            add()
    columns = store.columns()
    for name, value in (("rmse", 7.0), ("embed_1", 5.0), ("cluster", 3.0), ("distance", 2.0)):
        assert columns[name] == [value + a for a in columns["a"]]


def test_an_analysis_does_not_take_the_name_of_a_computed_column(tmp_path: Path) -> None:
    """The folder could not be read afterward: the expression found its name taken."""
    sweep = opened(tmp_path, budget=4)
    with ThreadPoolExecutor(1) as pool:
        sweep.run(sweep.plan(), executor=pool)
    sweep.store.derive("cluster", "2 * sum")
    with pytest.raises(InvalidInputError, match="'cluster' is not a manual column"):
        add_clusters(sweep.store, 2)
    assert sweep.store.columns()["cluster"] == [2 * each for each in sweep.store.columns()["sum"]]


def test_another_unit_and_group_of_a_parameter_are_shown(tmp_path: Path) -> None:
    """Those of the first run stayed."""
    text = text_of_sweep(tmp_path, budget=4)
    ran(tmp_path, text)
    _, report = ran(tmp_path, text.replace('name = "a"', 'name = "a"\nunit = "W"\ngroup = "light"'))
    assert (report.computed, report.reused) == (0, 4)
    with Store.open(tmp_path / "out") as store:
        shown = store.project.space["a"]
        assert (shown.unit, shown.group, store.project.units) == ("W", "light", {"a": "W"})


def test_a_list_of_points_has_no_budget(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A budget had no effect, and the plan told of points in the folder that was not there."""
    text = text_of_sweep(tmp_path, kind="list")
    (tmp_path / "sweep.toml").write_text(text)
    assert main(["sweep", str(tmp_path / "sweep.toml"), "--plan"]) == 1
    assert "lists no point" in capsys.readouterr().err
    points = "points = [{a = 0.5, b = 0.5}, {a = 0.25, b = 0.5}]"
    (tmp_path / "sweep.toml").write_text(text.replace("budget = 40", points))
    assert main(["sweep", str(tmp_path / "sweep.toml"), "--out", str(tmp_path / "out"), "--budget", "1"]) == 1
    assert "a budget has no effect" in capsys.readouterr().err
    assert main(["sweep", str(tmp_path / "sweep.toml"), "--out", str(tmp_path / "out")]) == 0


def test_shares_that_start_after_others_were_collected_compute_the_rest(tmp_path: Path) -> None:
    """A share counted the points that were missing at its start, so that collecting in between left points out."""
    path, folder = sweep_file(tmp_path, budget=9), str(tmp_path / "out")
    assert main(["sweep", str(path), "--out", folder, "--shell", "3"]) == 0
    for share in ("1/3", "2/3", "3/3"):
        assert main(["sweep", str(path), "--out", folder, "--share", share]) == 0
        assert main(["sweep", str(path), "--out", folder, "--collect"]) == 0
    with Store.open(tmp_path / "out") as store:
        assert {row.state for row in store.ledger.rows()} == {"done"} and len(store.ledger.rows()) == 9


def test_values_that_are_not_finite_are_named_after_the_run(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Their cells were empty without a word."""
    text = text_of_sweep(tmp_path, function="ratio", budget=6) + '[columns]\nroot = "sqrt(sum - 1)"\nhalf = "sum / 2"\n'
    sweep, report = ran(tmp_path, text)
    points = [row.parameters for row in sweep.store.ledger.rows()]
    infinite = sum(float(point["b"]) <= 0.5 for point in points)
    imaginary = sum(float(point["a"]) + float(point["b"]) < 1 for point in points)
    assert 0 < infinite < 6 and 0 < imaginary < 6
    assert report.not_finite == {"ratio": infinite, "root": imaginary}
    sweep.store.close()
    assert main(["sweep", str(tmp_path / "sweep.toml"), "--out", str(tmp_path / "out")]) == 0
    assert f"'ratio' has no finite value at {infinite} of 6 points" in capsys.readouterr().err
    words = ["explore", str(tmp_path / "out"), "--derive", "inverse", "1 / (b - b)", "--derive", "fine", "b + 1"]
    assert main([*words, "--no-thumbnails"]) == 0
    error = capsys.readouterr().err
    assert "'inverse' has no finite value at 6 of 6 points" in error and "'fine'" not in error

# SPDX-License-Identifier: GPL-3.0-or-later
"""Plans write nothing, added points are computed alone, distances are weighted norms, remote workers send files."""

from __future__ import annotations

import json
import pickle
import socket
from concurrent.futures import Executor, Future
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks.explore.checks.cinema import problems
from spectral_core.cli import main
from spectral_core.errors import InvalidInputError
from spectral_core.explore.analysis.steps import add_distance
from spectral_core.explore.features.picture_files import read_linear
from spectral_core.explore.sweep.store import Store
from spectral_core.explore.sweep.task import StoreAddress
from tests.explore.sweep.test_sweep import opened, sweep_file


def listing(folder: Path) -> dict[str, bytes]:
    return {
        str(p.relative_to(folder)): p.read_bytes() for p in folder.rglob("*") if p.is_file() and "sqlite" not in p.name
    }


def test_a_plan_writes_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    path = sweep_file(tmp_path, budget=9)
    assert main(["sweep", str(path), "--plan", "--json"]) == 0
    said = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert (said["points"], said["new"], said["reused"], said["folder"]) == (9, 9, 0, "sweep.cdb")
    assert [p.name for p in tmp_path.iterdir()] == ["sweep.toml"]
    assert main(["sweep", str(path)]) == 0
    before, rows = listing(tmp_path / "sweep.cdb"), Store.open(tmp_path / "sweep").ledger.rows()
    assert main(["sweep", str(path), "--plan", "--budget", "20", "--json"]) == 0
    said = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert (said["points"], said["new"], said["reused"]) == (20, 11, 9)
    assert listing(tmp_path / "sweep.cdb") == before and Store.open(tmp_path / "sweep").ledger.rows() == rows
    (tmp_path / "full.cdb").mkdir()
    (tmp_path / "full.cdb" / "mine").touch()
    assert main(["sweep", str(path), "--plan", "--out", "full"]) == 1
    assert "no empty folder" in capsys.readouterr().err


def test_points_that_a_page_added_are_computed_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    path = sweep_file(tmp_path, budget=5)
    assert main(["sweep", str(path)]) == 0
    with Store.open(tmp_path / "sweep") as store:
        store.enter([{"a": 0.125, "b": 0.25}])
    assert main(["sweep", str(path), "--pending"]) == 0
    with Store.open(tmp_path / "sweep") as store:
        rows = store.ledger.rows()
    assert len(rows) == 6 and rows[-1].outcome == {"sum": 0.375, "product": 0.03125}


@pytest.mark.parametrize("p", [1.0, 2.0, np.inf])
def test_distances_are_weighted_norms_over_columns_and_pictures(tmp_path: Path, p: float) -> None:
    sweep = opened(tmp_path, function="picture", budget=7)
    sweep.run(sweep.plan(), executor=_Far(reachable=True))
    columns = sweep.store.columns()
    key, weights = columns["key"][3], {"a": 2.0, "mean": 0.5, "pictures": 1.5}
    assert add_distance(sweep.store, key, weights, p) == 7
    found = np.array(sweep.store.columns()["distance"], float)
    a, mean = np.array(columns["a"]), np.array(columns["mean"])
    parts = [2.0 * (a - a[3]) / np.ptp(a), 0.5 * (mean - mean[3]) / np.ptp(mean)]
    without = np.linalg.norm(parts, p, axis=0)
    assert found[3] == 0 and (found >= without - 1e-12).all() and (found <= without + 1.5 + 1e-12).all()
    add_distance(sweep.store, key, {"a": 2.0, "mean": 0.5}, p, "plain")
    assert np.allclose(sweep.store.columns()["plain"], without, atol=1e-12)
    for wrong in ({}, {"a": -1}, {"a": "x"}, {"nothing": 1}, {"a": 0}, {"a": True}):
        with pytest.raises(InvalidInputError):
            add_distance(sweep.store, key, wrong, p)  # type: ignore[arg-type]
    with pytest.raises(InvalidInputError, match="no row has the key"):
        add_distance(sweep.store, "none", {"a": 1})


class _Far(Executor):
    """Computes as on another machine: with a pickled copy, and optionally without the folder."""

    def __init__(self, *, reachable: bool) -> None:
        self.reachable = reachable

    def submit(self, work: Any, /, *arguments: Any, **_options: Any) -> Future[Any]:
        future: Future[Any] = Future()
        work, arguments = pickle.loads(pickle.dumps((work, arguments)))
        if not self.reachable:
            address = arguments[-1]
            arguments = (*arguments[:-1], StoreAddress("/nowhere/else.cdb", address.store_id, address.linear))
        future.set_result(pickle.loads(pickle.dumps(work(*arguments))))
        return future


def test_workers_without_access_to_the_folder_send_their_files(tmp_path: Path) -> None:
    contents = []
    for reachable in (True, False):
        place = tmp_path / str(reachable)
        place.mkdir()
        sweep = opened(place, function="picture", budget=5)
        sweep.run(sweep.plan(), executor=_Far(reachable=reachable))
        assert problems(sweep.store.folder) == []
        rows = sweep.store.ledger.rows("done")
        assert len(rows) == 5 and not list((sweep.store.folder / "outcome").iterdir())
        contents.append(
            [(r.key, r.outcome, read_linear(sweep.store.folder / r.files["FILE_linear"]).tolist()) for r in rows]
        )
    assert contents[0] == contents[1]


def test_a_printed_region_is_pasted_into_the_sweep_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """It was JSON, which no sweep file holds."""
    monkeypatch.chdir(tmp_path)
    path = sweep_file(tmp_path, budget=12)
    assert main(["sweep", str(path)]) == 0
    with Store.open(tmp_path / "sweep") as store:
        small = {row.key for row in store.ledger.rows() if float(row.parameters["a"]) < 0.6}
        store.label("mark", dict.fromkeys(small, 'a "good" one'))
    capsys.readouterr()
    assert main(["explore", "sweep", "--no-thumbnails", "--region", "mark", 'a "good" one']) == 0
    printed = "\n".join(capsys.readouterr().out.splitlines()[:-1])  # the last line names the page
    path.write_text(path.read_text().replace("budget = 12", f"budget = {len(small)}") + printed)
    assert main(["sweep", str(path), "--plan", "--json"]) == 0
    said = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert (said["points"], said["new"], said["reused"]) == (len(small), 0, len(small))


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (["--port", "99999999"], "--port is 99999999; expected"),
        (["--port", "-1"], "--port is -1; expected"),
        (["--port", "TAKEN"], "cannot be used: Address already in use; choose another port"),
        (["--workers", "0"], "--workers is 0; expected"),
    ],
)
def test_a_page_that_cannot_be_served_says_why(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], options: list[str], told: str
) -> None:
    """A wrong or taken port ended in a traceback."""
    assert main(["sweep", str(sweep_file(tmp_path, budget=3)), "--out", str(tmp_path / "out")]) == 0
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = str(taken.getsockname()[1])
        words = [port if word == "TAKEN" else word for word in options]
        assert main(["explore", str(tmp_path / "out"), "--serve", *words]) == 1
    assert told in capsys.readouterr().err

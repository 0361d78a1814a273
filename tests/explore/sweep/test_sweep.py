# SPDX-License-Identifier: GPL-3.0-or-later
"""The store and the runner: exactly the requested points, each computed once, however a run ends."""

from __future__ import annotations

import csv
import json
import signal
import subprocess
import sys
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import pytest

from spectral_core.errors import FileFormatError, InvalidInputError
from spectral_core.explore.sweep.cinema import check_folder, csv_text, read_csv
from spectral_core.explore.sweep.compute.function import FunctionNode
from spectral_core.explore.sweep.document import read_sweep
from spectral_core.explore.sweep.pool.executor import WorkerDied, WorkerPool
from spectral_core.explore.sweep.runner import run_sweep
from spectral_core.explore.sweep.store import Store
from spectral_core.explore.sweep.sweep import Sweep

HERE = Path(__file__).parents[1]


def sweep_file(
    folder: Path, function: str = "plane", *, budget: int = 40, extra: str = "", kind: str = "lattice"
) -> Path:
    path = folder / "sweep.toml"
    path.write_text(
        f"""
[compute]
kind = "function"
function = {json.dumps(str(HERE / "functions.py") + ":" + function)}
{extra}
[design]
kind = "{kind}"
budget = {budget}
[[parameters]]
name = "a"
low = 0.0
high = 1.0
[[parameters]]
name = "b"
low = 0.0
high = 1.0
"""
    )
    return path


def opened(folder: Path, **options: object) -> Sweep:
    return Sweep(read_sweep(sweep_file(folder, **options)), folder / "out")  # type: ignore[arg-type]


def test_rows_are_what_the_function_returns_and_a_second_run_computes_nothing(tmp_path: Path) -> None:
    sweep = opened(tmp_path)
    with ThreadPoolExecutor(2) as threads:
        report = sweep.run(sweep.plan(), executor=threads)
        again = sweep.run(sweep.plan(), executor=threads)
    assert (report.computed, again.computed, again.reused) == (40, 0, 40)
    with (tmp_path / "out.cdb" / "data.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 40
    for row in rows:
        assert float(row["sum"]) == float(row["a"]) + float(row["b"])
    assert check_folder(tmp_path / "out.cdb") == []


def test_twice_the_budget_computes_the_new_points_only(tmp_path: Path) -> None:
    sweep = opened(tmp_path)
    before = set(sweep.plan().keys)
    with ThreadPoolExecutor(2) as threads:
        sweep.run(sweep.plan(), executor=threads)
        wider = sweep.plan(80)
        report = sweep.run(wider, executor=threads)
    assert before < set(wider.keys) and len(set(wider.keys)) == 80
    assert (report.computed, report.reused) == (40, 40)


@pytest.mark.parametrize("kind", ["lattice", "sobol", "latin_hypercube"])
def test_a_smaller_region_reuses_every_point_inside(tmp_path: Path, kind: str) -> None:
    sweep = opened(tmp_path, kind=kind)
    with ThreadPoolExecutor(2) as threads:
        sweep.run(sweep.plan(), executor=threads)
        region = replace(sweep.store.project.region, ranges={"a": (0.2, 0.7)}, constraints=("a + b <= 1.1",))
        sweep.store.project.region = region
        inside = [p for p in sweep.store.known_points() if 0.2 <= p["a"] <= 0.7 and p["a"] + p["b"] <= 1.1]
        report = sweep.run(sweep.plan(30), executor=threads)
    assert 0 < len(inside) < 30
    assert (report.reused, report.computed) == (len(inside), 30 - len(inside))


def test_a_failing_point_is_tried_twice_then_listed_and_the_rest_is_complete(tmp_path: Path) -> None:
    log = tmp_path / "log"
    sweep = opened(tmp_path, function="sometimes", budget=24, extra=f"fixed = {{log = {json.dumps(str(log))}}}")
    report = sweep.run(sweep.plan(), workers=2)
    bad = [p for p in sweep.store.known_points() if p["a"] > 0.8 or p["b"] > 0.9]
    assert bad == []  # failed points are not finished points
    rows = sweep.store.ledger.rows()
    failed = [row for row in rows if row.state == "failed"]
    assert len(failed) == len(report.failures) > 3
    assert all(row.parameters["a"] > 0.8 or row.parameters["b"] > 0.9 for row in failed)
    assert all(row.state == "done" for row in rows if row not in failed)
    calls = Counter(log.read_text().splitlines())
    assert {calls[f"{row.parameters['a']!r} {row.parameters['b']!r}"] for row in failed} == {2}
    assert {calls[f"{row.parameters['a']!r} {row.parameters['b']!r}"] for row in rows if row.state == "done"} == {1}
    assert any("a is too large" in (row.reason or "") for row in failed)
    assert any("signal 11" in (row.reason or "") for row in failed)


def test_a_killed_worker_loses_only_its_point(tmp_path: Path) -> None:
    import os

    mark = tmp_path / "number of the process"  # either worker may take the point
    code = f"import os, pathlib, time; pathlib.Path({str(mark)!r}).write_text(str(os.getpid())); time.sleep(600)"
    with WorkerPool(2) as pool:
        slow, quick = pool.submit(exec, code), pool.submit(time.sleep, 0.0)
        quick.result(timeout=60)
        while not (mark.exists() and mark.read_text()):
            time.sleep(0.02)
        os.kill(int(mark.read_text()), signal.SIGKILL)
        with pytest.raises(WorkerDied, match="signal 9"):
            slow.result(timeout=60)
        assert pool.submit(pow, 2, 10).result(timeout=60) == 1024


def test_outcomes_of_a_killed_driver_are_recovered_and_not_computed_again(tmp_path: Path) -> None:
    log = tmp_path / "log"
    extra = f"fixed = {{log = {json.dumps(str(log))}, pause = 0.3}}"
    path = sweep_file(tmp_path, "counted", budget=8, extra=extra)
    command = [
        sys.executable,
        "-m",
        "spectral_core.cli",
        "sweep",
        str(path),
        "--out",
        str(tmp_path / "out"),
        "--workers",
        "2",
    ]
    driver = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    while not log.exists() or log.read_text().count("start") < 3:
        time.sleep(0.02)
    driver.kill()
    driver.wait()
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert "set aside" not in done.stdout
    lines = Counter(log.read_text().splitlines())
    assert len(lines) == 16 and set(lines.values()) == {1}  # workers finished the points that they had begun
    assert len(Store.open(tmp_path / "out").ledger.rows("done")) == 8


def test_a_store_is_not_mixed_with_another_sweep(tmp_path: Path) -> None:
    opened(tmp_path).store.close()
    with pytest.raises(InvalidInputError, match="another sweep: the computation differs"):
        opened(tmp_path, function="picture")
    full = tmp_path / "full.cdb"
    full.mkdir()
    (full / "mine.txt").write_text("precious")
    with pytest.raises(InvalidInputError, match="no empty folder"):
        Sweep(read_sweep(tmp_path / "sweep.toml"), full)


def test_two_drivers_do_not_run_one_sweep(tmp_path: Path) -> None:
    from spectral_core.explore.sweep.files import only_holder

    sweep = opened(tmp_path)
    plan = sweep.plan()
    with only_holder(sweep.store.folder / "driver.lock", "x"), pytest.raises(InvalidInputError, match="in use"):
        sweep.run(plan, workers=1)


def test_pictures_are_stored_and_the_folder_moves(tmp_path: Path) -> None:
    import shutil

    sweep = opened(tmp_path, function="picture", budget=6)
    with ThreadPoolExecutor(1) as threads:
        sweep.run(sweep.plan(), executor=threads)
    moved = tmp_path / "elsewhere" / "copy.cdb"
    shutil.copytree(sweep.store.folder, moved)
    assert check_folder(moved) == []
    columns, rows = read_csv(moved / "data.csv")
    assert columns[-2:] == ["FILE_linear", "FILE"] and len(rows) == 6
    other = Store.open(moved)
    assert [row.key for row in other.ledger.rows("done")] == [row.key for row in sweep.store.ledger.rows("done")]


def test_a_shell_job_computes_shares_and_collects(tmp_path: Path) -> None:
    path = sweep_file(tmp_path, budget=9)
    own = [sys.executable, "-m", "spectral_core.cli", "sweep", str(path), "--out", str(tmp_path / "out")]
    printed = subprocess.run([*own, "--shell", "2"], capture_output=True, text=True, check=True).stdout
    import shlex

    commands = [shlex.split(line) for line in printed.splitlines() if " --share " in line or " --collect" in line]
    assert len(commands) == 3
    for command in commands:
        subprocess.run(command, capture_output=True, check=True)
    assert len(Store.open(tmp_path / "out").ledger.rows("done")) == 9


@pytest.mark.parametrize("text", ["=1+1", "+1", "-2+3", "@SUM(A1)", "\t=1", "=cmd|' /C calc'!A0"])
def test_a_cell_is_never_a_formula(text: str) -> None:
    assert list(csv.reader(csv_text(["note"], [{"note": text}]).splitlines(keepends=True)))[1] == [f"'{text}"]


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ("a,b\n", "at least one row"),
        ("a,a\n1,2\n", "occurs twice"),
        ("FILE,a\nx.png,2\n", "after a FILE column"),
        ("a,FILE\n1,../../etc/passwd\n", "leads out"),
        ("a,FILE\n1,/etc/passwd\n", "not a plain path"),
        ("a,b\n1\n", "cells"),
    ],
)
def test_an_invalid_table_of_another_program_is_refused(tmp_path: Path, table: str, said: str) -> None:
    (tmp_path / "data.csv").write_text(table)
    assert any(said in problem for problem in check_folder(tmp_path))
    with pytest.raises(FileFormatError):
        read_csv(tmp_path / "data.csv")


def test_a_node_that_changed_is_refused(tmp_path: Path) -> None:
    sweep = opened(tmp_path)
    sweep.plan()
    other = FunctionNode.of(str(HERE / "functions.py") + ":picture")
    with pytest.raises(InvalidInputError, match="has changed"):
        run_sweep(sweep.store, other)


def test_a_point_whose_workers_were_killed_is_computed_by_the_next_run(tmp_path: Path) -> None:
    sweep = opened(tmp_path, budget=3)
    ledger = sweep.store.ledger
    plan = sweep.plan()
    for how, key in zip(("killed", "failed"), plan.keys, strict=False):
        ledger.begin(key, "pool")
        ledger.end_attempt(key, how, "over")
        ledger.set_aside(key, "over")
    with ThreadPoolExecutor(1) as threads:
        report = sweep.run(plan, executor=threads)
    assert report.computed == 2 and list(report.failures) == [plan.keys[1]]

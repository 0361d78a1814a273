# SPDX-License-Identifier: GPL-3.0-or-later
"""Full disks, damaged records, points that failed before, references that cannot be computed, changed ranges."""

from __future__ import annotations

import hashlib
import json
import sqlite3
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from spectral_core.cli import main
from spectral_core.errors import FileWriteError, InvalidInputError, MissingDependencyError
from spectral_core.explore.sweep import task
from spectral_core.explore.sweep.compute.command import CommandNode
from spectral_core.explore.sweep.compute.volume import VolumeNode
from spectral_core.explore.sweep.document import read_sweep, register_compute
from spectral_core.explore.sweep.files import json_text
from spectral_core.explore.sweep.outcome import Outcome
from spectral_core.explore.sweep.parameters import Parameter, Space
from spectral_core.explore.sweep.runner import run_sweep
from spectral_core.explore.sweep.store import Store
from spectral_core.explore.sweep.sweep import Sweep
from tests.explore.sweep.test_sweep import opened, sweep_file


def test_a_full_disk_ends_the_run_and_the_next_one_continues(tmp_path: Path, monkeypatch: Any) -> None:
    sweep = opened(tmp_path, budget=6)
    plan = sweep.plan()
    written: list[str] = []
    write = task.write_whole

    def full(path: Path, content: Any, **options: Any) -> None:
        if path.parent.name == "outcome":
            written.append(path.stem)
            if len(written) > 2:
                raise FileWriteError(f"{path} could not be written: No space left on device")
        write(path, content, **options)

    monkeypatch.setattr(task, "write_whole", full)
    with ThreadPoolExecutor(1) as pool, pytest.raises(FileWriteError, match="No space left .* run the sweep again"):
        run_sweep(sweep.store, sweep.node, keys=plan.keys, executor=pool, in_flight=1)
    states = sweep.store.ledger.states()
    assert sorted(states.values()) == ["done"] * 2 + ["pending"] * 4 and len(written) == 3
    monkeypatch.setattr(task, "write_whole", write)
    report = sweep.run(sweep.plan())
    assert (report.computed, report.reused, report.failures) == (4, 2, {})


def test_a_missing_package_ends_the_run_and_the_next_one_continues(tmp_path: Path) -> None:
    """All points were set aside, and running again after the installation computed none of them."""
    sweep = opened(tmp_path, function="needs_package", budget=6, extra=f"fixed = {{installed = '{tmp_path}/here'}}")
    with pytest.raises(MissingDependencyError, match="needs the Python package 'mitsuba'"):
        sweep.run(sweep.plan())
    assert set(sweep.store.ledger.states().values()) == {"pending"}
    (tmp_path / "here").touch()
    report = sweep.run(sweep.plan())
    assert (report.computed, report.failures) == (6, {})


def test_points_that_lack_a_package_beside_others_are_set_aside(tmp_path: Path) -> None:
    sweep = opened(tmp_path, function="needs_package_later", budget=6, extra=f"fixed = {{log = '{tmp_path}/log'}}")
    report = sweep.run(sweep.plan())
    assert report.computed + len(report.failures) == 6 and report.failures
    assert "mitsuba" in next(iter(report.failures.values()))


def test_a_ledger_on_a_full_disk_reports_it(tmp_path: Path) -> None:
    store = opened(tmp_path, budget=4).store
    database = store.ledger._connection
    pages = database.execute("PRAGMA page_count").fetchone()[0]
    database.execute(f"PRAGMA max_page_count={pages}")
    points = [{"a": 0.5, "b": number / 4096} for number in range(2000)]
    with pytest.raises(FileWriteError, match=r"ledger.sqlite could not be written: database or disk is full"):
        store.enter(points)
    database.execute("PRAGMA max_page_count=100000")
    assert store.enter(points) == 2000


BEGIN_WITHIN = """
import resource, sys
from spectral_core.cli import main
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[1]), resource.RLIM_INFINITY))
sys.exit(main(["sweep", "sweep.toml"]))
"""


@pytest.mark.skipif(sys.platform == "win32", reason="no limit on the size of files")
@pytest.mark.parametrize("most", [0, 4096, 9000, 30000])
def test_a_sweep_that_began_on_a_full_disk_runs_later(tmp_path: Path, monkeypatch: Any, most: int) -> None:
    """The rest of the first run was taken for a sweep that begins at present, in every later run."""
    sweep_file(tmp_path, budget=3)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PYTHONDONTWRITEBYTECODE", "1")  # Python 3.11 would keep truncated modules
    began = subprocess.run([sys.executable, "-c", BEGIN_WITHIN, str(most)], capture_output=True, text=True, check=False)
    assert began.returncode == 1 and "Traceback" not in began.stderr
    assert "sweep.cdb" in began.stderr
    assert main(["sweep", "sweep.toml"]) == 0
    assert len((tmp_path / "sweep.cdb" / "data.csv").read_text().splitlines()) == 4


def test_a_ledger_that_cannot_be_opened_is_not_called_foreign(tmp_path: Path, monkeypatch: Any) -> None:
    store = opened(tmp_path, budget=4).store
    store.close()

    def refused(*_: Any, **__: Any) -> None:
        raise sqlite3.OperationalError("disk I/O error")

    monkeypatch.setattr(sqlite3, "connect", refused)
    with pytest.raises(FileWriteError, match="cannot be opened: disk I/O error"):
        Store.open(store.folder)


@pytest.mark.parametrize("left", ["", "{", "[]", '{"values": {}}'])
def test_a_damaged_record_is_computed_again(tmp_path: Path, left: str) -> None:
    """A power failure may leave a file without its content."""
    sweep = opened(tmp_path, budget=3)
    plan = sweep.plan()
    (sweep.store.folder / "outcome" / f"{plan.keys[1]}.json").write_text(left)
    assert sweep.store.recover() == 0
    (sweep.store.folder / "outcome" / f"{plan.keys[2]}.json").write_text(left)
    with ThreadPoolExecutor(1) as pool:
        report = sweep.run(plan, executor=pool)
    assert (report.computed, report.failures) == (3, {})


def test_the_plan_counts_points_that_were_set_aside_apart(tmp_path: Path, capsys: Any, monkeypatch: Any) -> None:
    monkeypatch.chdir(tmp_path)
    log = tmp_path / "log"
    path = sweep_file(tmp_path, "sometimes", budget=8, extra=f"fixed = {{log = {json.dumps(str(log))}}}")
    assert main(["sweep", str(path), "--json"]) == 1
    failed = json.loads(capsys.readouterr().out.splitlines()[-1])["failed"]
    assert failed > 0
    for options in ([], ["--plan"], ["--pending"]):
        main(["sweep", str(path), *options])
        said = capsys.readouterr().out
        assert "0 to compute" in said and f"{failed} were set aside by an earlier run and are left out; --retry" in said
    main(["sweep", str(path), "--plan", "--json"])
    assert json.loads(capsys.readouterr().out.splitlines()[-1])["new"] == 0


@pytest.mark.parametrize(
    ("function", "reason"),
    [
        ("plane", "the points have no picture to compare; remove [reference] from the sweep file"),
        ("sometimes", "ValueError: a is too large"),
    ],
)
def test_points_stay_if_the_reference_fails(
    tmp_path: Path, capsys: Any, monkeypatch: Any, function: str, reason: str
) -> None:
    monkeypatch.chdir(tmp_path)
    fixed = f"fixed = {{log = {json.dumps(str(tmp_path / 'log'))}}}" if function == "sometimes" else ""
    path = sweep_file(tmp_path, function, budget=3, extra=fixed)
    path.write_text(path.read_text().replace("high = 1.0", "high = 0.7") + "[reference]\na = 0.9\nb = 0.5\n")
    assert main(["sweep", str(path), "--json"]) == 1
    said = capsys.readouterr()
    report = json.loads(said.out.splitlines()[-1])
    assert (report["computed"], report["not_compared"]) == (3, reason)
    assert f"the points are not compared with the reference: {reason}" in said.err


def test_a_refinement_that_fails_does_not_double_the_budget(tmp_path: Path, monkeypatch: Any) -> None:
    from spectral_core.explore.page.live import LiveSweep
    from spectral_core.explore.sweep import designs

    store = opened(tmp_path, budget=4).store
    live, points = LiveSweep(store), designs.design_points

    def refused(*_: Any, **__: Any) -> None:
        raise InvalidInputError("the region holds too few points")

    monkeypatch.setattr(designs, "design_points", refused)
    with pytest.raises(InvalidInputError, match="too few"):
        live.refine({})
    monkeypatch.setattr(designs, "design_points", points)
    assert live.refine({})["new"] == 8 and store.project.design.budget == 8


class Started:
    """A node whose fingerprint depends on the start of the ranges, as that of a .blend file does."""

    def __init__(self, space: Any) -> None:
        self.fingerprint = f"starts at {[parameter.low for parameter in space.parameters]}"

    def __call__(self, parameters: Any, seed: int) -> Outcome:
        return Outcome({"sum": sum(parameters.values())})


def test_another_range_keeps_the_points_inside_whatever_the_node(tmp_path: Path) -> None:
    register_compute("started", lambda table, space, folder: Started(space))
    path = sweep_file(tmp_path, budget=6)
    path.write_text(path.read_text().replace('kind = "function"', 'kind = "started"').replace("function = ", "#"))
    with ThreadPoolExecutor(1) as pool:
        first = Sweep(read_sweep(path), tmp_path / "out")
        first.run(first.plan(), executor=pool)
        rows = first.store.ledger.rows("done")
        path.write_text(path.read_text().replace("low = 0.0", "low = 0.25", 1))
        second = Sweep(read_sweep(path), tmp_path / "out")
        report = second.run(second.plan(), executor=pool)
    assert report.reused == sum(row.parameters["a"] >= 0.25 for row in rows) > 0
    assert report.computed > 0 and not report.failures


def test_a_column_without_a_number_is_drawn(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    from spectral_core.explore.page.static import draw_error_against_time

    columns = {"error": [None, None], "seconds": [1.0, 20.0]}
    assert draw_error_against_time(tmp_path / "a.png", columns, "seconds", ["error"]).is_file()


def test_a_computed_column_that_takes_the_name_of_a_value_is_refused_until_it_is_renamed(tmp_path: Path) -> None:
    """The expression replaced the value in the table without a word."""
    path = sweep_file(tmp_path, budget=4)
    path.write_text(path.read_text() + '\n[columns]\nproduct = "2 * product"\n')
    with ThreadPoolExecutor(1) as pool:
        first = Sweep(read_sweep(path), tmp_path / "out")
        refused = first.run(first.plan(), executor=pool).not_computed
    assert "'product', which the outcome has" in refused["product"]
    assert first.store.columns()["product"] == [row.outcome["product"] for row in first.store.ledger.rows("done")]
    path.write_text(path.read_text().replace("\nproduct = ", "\ndoubled = "))
    with ThreadPoolExecutor(1) as pool:
        second = Sweep(read_sweep(path), tmp_path / "out")
        report = second.run(second.plan(), executor=pool)
    assert (report.computed, report.reused) == (0, 4)
    columns = second.store.columns()
    assert columns["doubled"] == [2 * value for value in columns["product"]]


@pytest.mark.parametrize("place", ["middle", "text", "cut"])
def test_a_damaged_ledger_is_named(tmp_path: Path, capsys: Any, place: str) -> None:
    """A ledger whose beginning is whole, but not its rows, ended every command in a traceback of SQLite or JSON."""
    sweep = opened(tmp_path, budget=40)
    keys = sweep.plan().keys
    for key in keys:
        sweep.store.ledger.commit(key, {"sum": 1.0, "label": "x" * 200}, {}, 0.1)
    sweep.store.ledger.set_manual("note", {keys[0]: "kept"})
    folder, path = sweep.store.folder, sweep.store.ledger.path
    sweep.store.ledger._connection.execute("PRAGMA wal_checkpoint(TRUNCATE)")
    sweep.store.close()
    content = bytearray(path.read_bytes())
    if place == "middle":
        content[8192:-4096] = b"\xff" * (len(content) - 12288)
    elif place == "text":
        content = bytearray(bytes(content).replace(b'"sum":', b"'sum':"))
    else:
        del content[len(content) // 2 :]
    path.write_bytes(content)
    for words in (["explore", str(folder)], ["sweep", str(sweep_file(tmp_path)), "--out", str(folder), "--plan"]):
        assert main(words) == 1
        said = capsys.readouterr().err
        assert said.count("ledger.sqlite is damaged: ") == 1 and "Restore the folder from a backup" in said


def test_a_program_may_be_given_code_and_options_that_name_files(tmp_path: Path) -> None:
    """Code of more than 255 bytes was "File name too long"; a file of --config=FILE could change between the points."""
    space = Space((Parameter("a"),))
    code = "import sys; print(float(sys.argv[1]) ** 2)  # " + 300 * "x"
    assert CommandNode.of([sys.executable, "-c", code, "{a}"], space, tmp_path)({"a": 3.0}, 0).values["result"] == 9.0
    prints = []
    for text in ("1", "2"):
        (tmp_path / "my.conf").write_text(text)
        prints.append(CommandNode.of(["program", "--config=my.conf", "{a}"], space, tmp_path).fingerprint)
    assert prints[0] != prints[1]


def test_a_sweep_of_a_volume_goes_on_after_its_folder_was_moved(tmp_path: Path) -> None:
    """It was another sweep there."""
    prints = []
    for name, value in (("here", 1.0), ("there", 1.0), ("other", 2.0)):
        (tmp_path / name).mkdir()
        np.save(tmp_path / name / "v.npy", np.full((4, 4, 4), value, np.float32) * np.arange(4))
        node = VolumeNode.of("v.npy", "wide", Space((Parameter("zoom", 1, 2),)), tmp_path / name)
        prints.append(node.fingerprint)
    assert prints[0] == prints[1] != prints[2]


def test_the_files_among_which_a_command_chooses_are_part_of_the_computation(tmp_path: Path) -> None:
    """The rows of two versions of a file were mixed, if a parameter and not the command named it."""
    space = Space((Parameter("sky", kind="choice", choices=("a.hdr", "b.hdr", "none")), Parameter("n", 0, 1)))
    prints = []
    for text in ("first", "second"):
        (tmp_path / "b.hdr").write_text(text)
        words = ["program", "--sky={sky}", "{n}"]
        prints.append(CommandNode.of(words, space, tmp_path).fingerprint)
        prints.append(CommandNode.of(["program", "{sky}", "{n}"], space, tmp_path).fingerprint)
    assert len(set(prints)) == 4
    (tmp_path / "b.hdr").unlink()
    words = ["program", "{sky}", "{n}"]
    plain = hashlib.sha256(json_text([words, {}]).encode()).hexdigest()  # of earlier versions, if there is no file
    assert CommandNode.of(words, space, tmp_path).fingerprint == plain

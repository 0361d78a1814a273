# SPDX-License-Identifier: GPL-3.0-or-later
"""Ledgers that are gone, that another user's sweep still writes, and that a display counts."""

from __future__ import annotations

import os
import re
import shutil
import sqlite3
import subprocess
import sys
import textwrap
import time
from pathlib import Path
from typing import Any

import pytest

from spectral_core.cli import main
from spectral_core.errors import FileFormatError
from spectral_core.explore.sweep.ledger import DoneCount, Ledger
from spectral_core.explore.sweep.ledger.copied import copied
from spectral_core.explore.sweep.store import Store
from tests.explore.sweep.test_sweep import sweep_file


@pytest.fixture(scope="module")
def computed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a sweep file and its finished sweep of five points."""
    folder = tmp_path_factory.mktemp("computed")
    assert main(["sweep", str(sweep_file(folder, budget=5)), "--out", str(folder / "sweep")]) == 0
    return folder


@pytest.fixture
def finished(computed: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder of a copy of it, which a test may damage."""
    monkeypatch.chdir(tmp_path)
    shutil.copytree(computed, tmp_path, dirs_exist_ok=True)
    return tmp_path / "sweep.cdb"


def lose(ledger: Path, how: str) -> None:
    if how == "deleted":
        ledger.unlink()
    elif how == "emptied":
        ledger.write_bytes(b"")
    elif how == "new":
        ledger.unlink()
        Ledger(ledger).close()
    else:
        with sqlite3.connect(ledger) as database:
            database.execute("DELETE FROM points")
        database.close()


@pytest.mark.parametrize("how", ["deleted", "emptied", "new", "rows"])
@pytest.mark.parametrize("command", [["sweep", "sweep.toml"], ["sweep", "sweep.toml", "--plan"], ["explore", "sweep"]])
def test_a_lost_ledger_does_not_start_the_sweep_anew(
    finished: Path, capsys: pytest.CaptureFixture[str], how: str, command: list[str]
) -> None:
    """All points were computed again, and data.csv was written over, without a word."""
    lose(finished / "ledger.sqlite", how)
    table = (finished / "data.csv").read_bytes()
    capsys.readouterr()
    assert main(command) == 1
    told = capsys.readouterr().err
    assert "ledger.sqlite" in told
    assert "Restore it from a backup" in told
    assert (finished / "data.csv").read_bytes() == table
    if how in ("deleted", "emptied"):
        assert not (finished / "ledger.sqlite").exists() or not (finished / "ledger.sqlite").stat().st_size


def test_a_sweep_without_finished_points_is_continued(finished: Path) -> None:
    """A run that was ended between its folder and its first point has an empty ledger, and nothing is lost."""
    lose(finished / "ledger.sqlite", "rows")
    for each in (*(finished / "image").iterdir(), finished / "data.csv"):
        each.unlink()
    assert main(["sweep", "sweep.toml", "--json"]) == 0
    with Store.open(finished) as store:
        assert len(store.ledger.rows("done")) == 5


ONE = "WHERE key = (SELECT key FROM points WHERE ordinal = 3)"


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (f"UPDATE points SET outcome = '{{oops' {ONE}", "outcome of point"),
        (f"UPDATE points SET outcome = '[1, 2]' {ONE}", "is a list; expected an object"),
        (f"UPDATE points SET outcome = '{{\"sum\": [1, 2]}}' {ONE}", r"has sum = \[1, 2\]"),
        (f"UPDATE points SET parameters = '7' {ONE}", "parameters of point"),
        (f"UPDATE points SET parameters = '{{\"a\": null}}' {ONE}", "has a = None"),
        (f"UPDATE points SET files = '{{\"FILE\": 3}}' {ONE}", "has FILE = 3"),
        (f"UPDATE points SET seconds = 'long' {ONE}", "took 'long' seconds"),
        (f"UPDATE points SET ordinal = 'first' {ONE}", "the ordinal 'first'"),
        (f"UPDATE points SET key = '../../other' {ONE}", "the key '../../other'"),
        ("INSERT INTO manual SELECT key, 'mark', 'oops' FROM points", "mark of point"),
        ("INSERT INTO manual SELECT key, 'mark', '[3]' FROM points", r"has mark = \[3\]"),
    ],
)
def test_a_ledger_that_was_edited_by_hand_is_refused(
    finished: Path, capsys: pytest.CaptureFixture[str], change: str, told: str
) -> None:
    """Some edits ended in a traceback, others in a table of wrong rows."""
    with sqlite3.connect(finished / "ledger.sqlite") as database:
        database.execute(change)
    database.close()
    for command in (["explore", "sweep"], ["sweep", "sweep.toml"]):
        capsys.readouterr()
        assert main(command) == 1
        said = capsys.readouterr().err
        assert "ledger.sqlite is damaged: " in said and re.search(told, said), said


WRITER = """
    import sqlite3, sys, time
    database = sqlite3.connect(sys.argv[1], isolation_level=None, timeout=60)
    database.execute("PRAGMA journal_mode=WAL")
    database.execute("PRAGMA wal_autocheckpoint=2")
    print("ready", flush=True)
    number = 0
    while True:
        database.execute("BEGIN IMMEDIATE")
        for part in range(4):
            database.execute(
                "INSERT INTO points (key, ordinal, parameters, state, outcome) VALUES (?, ?, '{}', 'done', ?)",
                (f"n{number}.{part}", 100 + 4 * number + part, '{"v": 1}' + " " * 3000),
            )
        database.execute("COMMIT")
        number += 1
        if sys.argv[2] == "closing":
            database.close()
            database = sqlite3.connect(sys.argv[1], isolation_level=None, timeout=60)
            time.sleep(0.05)
"""


@pytest.mark.parametrize("how", ["open", "closing"])
def test_a_private_copy_is_consistent_while_another_process_writes(finished: Path, tmp_path: Path, how: str) -> None:
    """The ledger and its log were copied one after the other: points between the two were missing, or half of them."""
    ledger = finished / "ledger.sqlite"
    command = [sys.executable, "-c", textwrap.dedent(WRITER), str(ledger), how]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as writer:
        assert writer.stdout is not None
        writer.stdout.readline()
        counts: list[int] = []
        try:
            for number in range(40):
                folder = tmp_path / f"copy{number}"
                folder.mkdir()
                before = _committed(ledger)
                with sqlite3.connect(copied(ledger, folder)) as copy:
                    assert copy.execute("PRAGMA integrity_check").fetchone() == ("ok",)
                    counts.append(copy.execute("SELECT COUNT(*) FROM points").fetchone()[0])
                copy.close()
                assert (counts[-1] - 5) % 4 == 0
                assert counts[-1] >= before
            assert writer.poll() is None
        finally:
            writer.kill()
    assert counts[-1] > counts[0]


def _committed(ledger: Path) -> int:
    database = sqlite3.connect(ledger, timeout=60)
    try:
        return int(database.execute("SELECT COUNT(*) FROM points").fetchone()[0])
    finally:
        database.close()


def test_a_read_only_ledger_shows_points_that_are_committed_later(
    finished: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    truly = os.access

    def access(path: Any, mode: int) -> bool:
        return truly(path, mode) and not (mode == os.W_OK and Path(path).resolve().is_relative_to(finished))

    writer = Store.open(finished)
    monkeypatch.setattr(os, "access", access)
    with Store.open(finished) as reader:
        assert reader.ledger.is_read_only
        assert len(reader.ledger.rows()) == 5
        writer.enter([{"a": 0.25, "b": 0.125}])
        assert len(reader.ledger.rows()) == 6
    writer.close()


def test_a_lost_copy_of_a_read_only_ledger_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(FileFormatError, match="cannot be read|faster"):
        copied(tmp_path, tmp_path)  # a folder


def test_the_count_of_a_display_reads_no_rows(tmp_path: Path) -> None:
    """The panel decoded all rows every half second: a second and more at 20,000 rows."""
    path = tmp_path / "ledger.sqlite"
    count = DoneCount(path)
    assert count.read() == 0  # no ledger yet
    ledger = Ledger(path)
    assert count.read() == 0
    outcome = {f"feature_{number}": number / 7 for number in range(40)}
    ledger.add((f"k{number}", {"a": number}) for number in range(20_000))
    with ledger.transaction() as database:
        database.execute("UPDATE points SET state = 'done', outcome = ?", (repr(outcome).replace("'", '"'),))
    assert count.read() == 20_000
    ledger.add([("last", {"a": 0.5})])
    ledger.commit("last", outcome, {}, 0.1)
    took = []
    for _ in range(9):
        start = time.thread_time()  # not of other programs
        assert count.read() == 20_001
        took.append(time.thread_time() - start)
    start = time.thread_time()
    assert len(ledger.rows("done")) == 20_001
    assert max(took) < (time.thread_time() - start) / 20
    query = "EXPLAIN QUERY PLAN SELECT COUNT(*) FROM points WHERE state = 'done'"
    assert "COVERING INDEX" in ledger._connection.execute(query).fetchone()[-1]
    with ledger.transaction():
        assert count.read() == 20_001  # it does not wait for a process that writes
    ledger.set_aside("last", "no light")
    count.close()
    assert count.read() == 20_000
    ledger.close()

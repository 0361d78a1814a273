# SPDX-License-Identifier: GPL-3.0-or-later
"""A sweep on a read-only share is shown and planned with, and not changed."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import pytest

from spectral_core.cli import main
from spectral_core.errors import FileWriteError
from spectral_core.explore.sweep.store import Store
from tests.explore.sweep.test_sweep import sweep_file
from tests.explore.test_plan_and_distance import listing


@pytest.fixture
def closed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A finished sweep of five points whose folder this user may not write; the last change is still in SQLite's log.

    The rights are those that Python states, because the tests may run as root, who may write everywhere.
    """
    monkeypatch.chdir(tmp_path)
    assert main(["sweep", str(sweep_file(tmp_path, budget=5))]) == 0
    folder = tmp_path / "sweep.cdb"
    with Store.open(folder) as store:
        store.label("mood", {store.ledger.rows()[0].key: "calm"})
        log = (folder / "ledger.sqlite-wal").read_bytes()
        ledger = (folder / "ledger.sqlite").read_bytes()
    (folder / "ledger.sqlite-wal").write_bytes(log)
    (folder / "ledger.sqlite").write_bytes(ledger)
    truly = os.access

    def access(path: Any, mode: int) -> bool:
        return truly(path, mode) and not (mode == os.W_OK and Path(path).resolve().is_relative_to(folder))

    monkeypatch.setattr(os, "access", access)
    return folder


def test_a_read_only_sweep_is_shown(closed: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """It ended with "is the disk full or the folder closed?"."""
    assert main(["explore", str(closed)]) == 1
    assert "elsewhere with --out" in capsys.readouterr().err
    before = {path.name: path.read_bytes() for path in closed.rglob("*") if path.is_file()}
    assert main(["explore", str(closed), "--out", str(tmp_path / "page.html"), "--json"]) == 0
    assert json.loads(capsys.readouterr().out.splitlines()[-1])["points"] == 5
    assert "calm" in (tmp_path / "page.html").read_text("utf-8")
    assert {path.name: path.read_bytes() for path in closed.rglob("*") if path.is_file()} == before


def test_a_read_only_sweep_is_planned_with(
    closed: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    before = listing(closed)
    closed.chmod(0o555)
    (closed / "project.json").chmod(0o444)
    modes: list[int] = []
    monkeypatch.setattr(Store, "recover", lambda store: modes.append(store.folder.stat().st_mode & 0o200))
    assert main(["sweep", str(tmp_path / "sweep.toml"), "--plan", "--budget", "9", "--json"]) == 0
    said = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert (said["new"], said["reused"]) == (4, 5)
    assert listing(closed) == before
    assert modes == [0o200]


def test_a_read_only_sweep_is_not_changed(closed: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with Store.open(closed) as store, pytest.raises(FileWriteError, match="can be shown, but not changed"):
        store.label("mood", {store.ledger.rows()[0].key: "wild"})
    assert main(["explore", str(closed), "--clusters", "2"]) == 1
    assert "can be shown, but not changed" in capsys.readouterr().err

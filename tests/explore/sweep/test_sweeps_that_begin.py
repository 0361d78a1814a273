# SPDX-License-Identifier: GPL-3.0-or-later
"""A sweep whose process was killed while it made its folder, and two that begin in one folder at once."""

from __future__ import annotations

from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from spectral_core.errors import InvalidInputError
from spectral_core.explore.sweep.document import read_sweep
from spectral_core.explore.sweep.ledger import Ledger
from spectral_core.explore.sweep.store import Store
from spectral_core.explore.sweep.sweep import planned_apart
from tests.explore.sweep.test_sweep import opened, sweep_file

LEFT_BEHIND = {
    "no folder": (), "a folder": ("image",), "all folders": ("image", "outcome", "lease"),
    "a ledger": ("image", "outcome", "lease", "driver.lock", "ledger.sqlite"),
    "a part of the project": ("image", "outcome", "lease", "ledger.sqlite", ".spectral-unfinished-0f.json"),
}  # fmt: skip
"""What a process leaves that is killed while it makes a store, step after step."""


@pytest.mark.parametrize("names", LEFT_BEHIND.values(), ids=LEFT_BEHIND)
def test_a_sweep_that_was_killed_while_it_began_is_begun_again(tmp_path: Path, names: tuple[str, ...]) -> None:
    """Its folder was refused until someone deleted it: as foreign, or as that of a sweep that begins at present."""
    begun = tmp_path / "out.cdb"
    begun.mkdir()
    for name in names:
        if "." not in name:
            (begun / name).mkdir()
        elif name == "ledger.sqlite":
            Ledger(begun / name).close()
        else:
            (begun / name).touch()
    with planned_apart(read_sweep(sweep_file(tmp_path, budget=3)), begun) as apart:
        assert apart.plan().new == 3
    assert sorted(each.name for each in begun.iterdir()) == sorted(names)
    assert opened(tmp_path, budget=3).plan().new == 3


def test_a_ledger_without_its_project_is_kept(tmp_path: Path) -> None:
    sweep = opened(tmp_path, budget=3)
    sweep.plan()
    sweep.close()
    (sweep.store.folder / "project.json").unlink()
    with pytest.raises(InvalidInputError, match=r"has a ledger with points and no project.json; restore that file"):
        opened(tmp_path, budget=3)
    with closing(Ledger(sweep.store.folder / "ledger.sqlite")) as ledger:
        assert len(ledger.rows()) == 3


def test_two_processes_that_begin_at_once_make_one_store(tmp_path: Path, monkeypatch: Any) -> None:
    first = opened(tmp_path, budget=3)
    monkeypatch.setattr("spectral_core.explore.sweep.store.require_free", lambda folder: None)  # before the first one
    with pytest.raises(InvalidInputError, match="another process has just begun a sweep"):
        Store.create(first.store.folder, first.document.project(first.node.fingerprint))
    assert Store.project_of(first.store.folder).store_id == first.store.project.store_id

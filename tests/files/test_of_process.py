# SPDX-License-Identifier: GPL-3.0-or-later
"""Temporary folders of processes: those of ended processes are deleted, and those of others stay."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from spectral_core.files.of_process import temporary_folder

PREFIX = "spectral-test-"
MAKER = f"""
import os, sys
from spectral_core.files.of_process import temporary_folder
made = temporary_folder("{PREFIX}")
(made / "grids.vdb").write_bytes(b"grids")
print(made, flush=True)
sys.stdin.readline()
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder of temporary files, here and in processes that a test starts."""
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).parents[2]))
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    return tmp_path


def test_the_folder_of_a_killed_process_is_deleted_by_the_next_one(folder: Path) -> None:
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    with subprocess.Popen([sys.executable, "-c", MAKER], text=True, **pipes) as process:
        assert process.stdout is not None
        left = Path(process.stdout.readline().strip())
        assert left.parent == folder
        first = temporary_folder(PREFIX)
        assert (left / "grids.vdb").exists(), "its process still runs"
        process.kill()
        process.wait()
        second = temporary_folder(PREFIX)
    assert {first, second} == set(folder.iterdir()), "the folder of the killed process is gone, both of this one stay"
    assert str(os.getpid()) in first.name


def test_a_link_in_place_of_a_left_folder_deletes_nothing_behind_it(folder: Path, tmp_path: Path) -> None:
    with subprocess.Popen([sys.executable, "-c", ""]) as ended:
        ended.wait()
    mine = tmp_path / "mine"
    mine.mkdir()
    (mine / "kept.txt").write_text("kept")
    made = temporary_folder(PREFIX)
    (folder / made.name.replace(str(os.getpid()), str(ended.pid), 1)).symlink_to(mine)
    temporary_folder(PREFIX)
    assert (mine / "kept.txt").exists()

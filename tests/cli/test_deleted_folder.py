# SPDX-License-Identifier: GPL-3.0-or-later
"""Commands that are started in a folder that has been deleted, as a terminal may still stand in one."""

from __future__ import annotations

import os
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from benchmarks import ROOT
from spectral_core.child import trusted_path

pytestmark = pytest.mark.skipif(os.name != "posix", reason="Windows keeps the current folder of a process")


def in_deleted_folder(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    gone = folder / "gone"
    gone.mkdir()
    line = f"cd {shlex.quote(str(gone))} && rmdir ../gone && exec {shlex.join([sys.executable, *words])}"
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    return subprocess.run(["sh", "-c", line], capture_output=True, text=True, env=environment)


@pytest.mark.parametrize("module", ["spectral_core.cli", "blender_addon"])
def test_a_command_that_needs_no_current_folder_works(module: str, tmp_path: Path) -> None:
    """It ended in a traceback of ``os.path.realpath``."""
    done = in_deleted_folder(tmp_path, "-P", "-m", module, "lattice", "--points", "3", "--out", str(tmp_path / "p.csv"))

    assert (done.returncode, done.stderr) == (0, "")
    assert (tmp_path / "p.csv").is_file()


def test_a_file_in_it_is_refused_with_the_reason(tmp_path: Path) -> None:
    done = in_deleted_folder(tmp_path, "-P", "-m", "spectral_core.cli", "mix", "blue:1", "--out", "mixture.csv")

    assert done.returncode == 1
    assert done.stderr == "spectral-scene mix: the current folder is deleted; change to another one\n"


def test_other_processes_have_a_module_path_there_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    gone = tmp_path / "gone"
    gone.mkdir()
    monkeypatch.chdir(gone)
    gone.rmdir()
    assert str(ROOT) in trusted_path()
    monkeypatch.chdir(tmp_path)

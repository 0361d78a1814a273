# SPDX-License-Identifier: GPL-3.0-or-later
"""No child process imports modules from the current folder or from a user's site-packages."""

from __future__ import annotations

import os
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from spectral_core import child

PLANTED = ("json", "mitsuba", "numpy", "drjit", "queue", "struct", "pickle", "typing", "spectral_core")


@pytest.fixture
def trap(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The current folder has modules that write a file when they are imported."""
    for name in PLANTED:
        (tmp_path / f"{name}.py").write_text(f"open({str(tmp_path / 'executed')!r}, 'a').write('{name} ')\n")
    monkeypatch.chdir(tmp_path)
    return tmp_path / "executed"


def run(trap: Path, *command: str, **environment: str) -> subprocess.CompletedProcess[str]:
    done = subprocess.run(
        command, capture_output=True, text=True, cwd=trap.parent, env={**os.environ, **environment}, errors="replace"
    )
    assert not trap.exists(), trap.read_text()
    return done


def test_the_render_process_imports_nothing_from_the_current_folder(trap: Path) -> None:
    pytest.importorskip("mitsuba")
    from spectral_core.render.process.renderer import RenderProcess

    with RenderProcess() as process:
        assert process._running().alive
    assert not trap.exists(), trap.read_text()


def test_empty_and_relative_entries_of_the_path_are_removed(trap: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "path", ["", ".", str(trap.parent), *sys.path])
    assert str(trap.parent) not in child.trusted_path()
    assert all(Path(entry).is_absolute() for entry in child.trusted_path())
    line = child.command(sys.executable, "spectral_core.cli.shared.trial", "nothing")
    done = subprocess.run(line, capture_output=True, text=True, cwd=trap.parent, env=child.environment())
    assert "KeyError: 'nothing'" in done.stderr
    assert not trap.exists(), trap.read_text()


def test_doctor_imports_nothing_from_the_current_folder(trap: Path) -> None:
    script = Path(sys.executable).with_name("spectral-scene")
    done = run(trap, str(script), "doctor", PYTHONPATH="", PYTHONDONTWRITEBYTECODE="1")
    assert "numpy" in done.stdout


def test_nothing_is_imported_from_a_user_site(tmp_path: Path) -> None:
    site = tmp_path / "lib" / f"python{sys.version_info.major}.{sys.version_info.minor}" / "site-packages"
    site.mkdir(parents=True)
    mark = tmp_path / "executed"
    (site / "usercustomize.py").write_text(f"open({str(mark)!r}, 'w')\n")
    line = child.command(sys.executable, "spectral_core.cli.shared.trial", "nothing")
    subprocess.run(line, capture_output=True, env={**child.environment(), "PYTHONUSERBASE": str(tmp_path)})
    assert not mark.exists()


def test_the_workers_of_a_sweep_import_nothing_from_the_current_folder(trap: Path) -> None:
    from spectral_core.explore.sweep.pool.executor import WorkerPool

    with WorkerPool(1) as pool:
        assert pool.submit(len, "four").result(timeout=200) == 4
    assert not trap.exists(), trap.read_text()


def test_commands_for_a_scheduler_import_nothing_from_the_current_folder(
    trap: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from argparse import Namespace

    from spectral_core.cli.sweep import _print_shell

    program = [sys.executable, "-P", "-m", "spectral_core.cli"]
    _print_shell(Namespace(shell=1, sweep=Path("s.toml"), program=program), Path("out"))
    first = shlex.split(capsys.readouterr().out.splitlines()[0])
    assert "there is no file" in run(trap, *first).stderr

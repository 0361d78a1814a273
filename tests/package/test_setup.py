# SPDX-License-Identifier: GPL-3.0-or-later
"""Set-up detects a .venv that is unfinished, broken or of another Python; the lock file is complete."""

from __future__ import annotations

import importlib.util
import re
import shutil
import subprocess
import sys
import venv
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def template(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An environment with pip, to be copied: making one takes seconds."""
    place = tmp_path_factory.mktemp("template") / "venv"
    venv.create(place, with_pip=True)
    return place


@pytest.fixture
def setup(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, template: Path) -> ModuleType:
    """The set-up script, for another .venv."""

    def copy(place: Path, with_pip: bool) -> None:
        assert with_pip
        shutil.copytree(template, place, symlinks=True, dirs_exist_ok=True)
        settings = place / "pyvenv.cfg"
        settings.write_text(settings.read_text("utf-8").replace(str(template), str(place)), "utf-8")

    spec = importlib.util.spec_from_file_location("set_up", ROOT / "scripts" / "setup.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    place = tmp_path / ".venv"
    for name, value in (("VENV", place), ("PYTHON", place / "bin" / "python"), ("STAMP", place / ".set-up")):
        monkeypatch.setattr(module, name, value)
    monkeypatch.setattr(module, "UNFINISHED", place / ".unfinished")
    monkeypatch.setattr(module.venv, "create", copy)
    return module


@pytest.fixture
def made(setup: ModuleType) -> ModuleType:
    """A correct .venv without packages."""
    setup.venv.create(setup.VENV, with_pip=True)
    assert setup.whats_wrong() == ""
    return setup


def test_no_venv_is_no_error(setup: ModuleType) -> None:
    assert setup.whats_wrong() == ""


def test_an_interrupted_setup_is_detected(made: ModuleType) -> None:
    made.UNFINISHED.touch()
    assert made.whats_wrong() == "its set-up was interrupted"
    made.UNFINISHED.unlink()
    shutil.rmtree(next(made.VENV.glob("lib/*/site-packages/pip")))
    assert "No module named" in made.whats_wrong()
    made.PYTHON.unlink()
    assert "does not start" in made.whats_wrong()


def test_a_venv_of_another_python_is_detected(made: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(made.sys, "version", "3.12.1 (main)")
    assert "this is 3.12.1" in made.whats_wrong()


def test_a_copied_venv_is_detected(setup: ModuleType, tmp_path: Path) -> None:
    setup.venv.create(tmp_path / "other", with_pip=True)
    setup.VENV.mkdir()
    (setup.VENV / "bin").symlink_to(tmp_path / "other" / "bin")
    assert "it belongs to" in setup.whats_wrong()


def test_the_venv_of_a_moved_checkout_is_detected(made: ModuleType) -> None:
    """Its programs start the Python of the earlier folder: `make test` ended with "not found" at import rules."""
    settings = made.VENV / "pyvenv.cfg"
    settings.write_text(settings.read_text("utf-8").replace(str(made.VENV), "/home/me/ü x/.venv"), "utf-8")
    assert made.whats_wrong() == "it was made as /home/me/ü x/.venv"


def test_the_missing_package_of_pip_is_that_of_the_running_python(
    setup: ModuleType, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """On Ubuntu 24.04 python3-venv is that of 3.12, which a Python 3.11 beside it does not use."""

    def fail(*_given: object, **_options: object) -> None:
        raise subprocess.CalledProcessError(1, "ensurepip")

    monkeypatch.setattr(setup.venv, "create", fail)
    with pytest.raises(SystemExit):
        setup.packages()
    assert f"apt install python3.{sys.version_info.minor}-venv" in capsys.readouterr().out


@pytest.mark.parametrize(("name", "works"), [("a b", True), ("ü 100%", True), ("a$x", False), ("%a% b", False)])
def test_a_folder_that_blender_takes_for_a_variable_is_refused(
    setup: ModuleType, capsys: pytest.CaptureFixture[str], name: str, works: bool
) -> None:
    """The demo ran through, and its pictures were too dark: 46 of 255 levels in place of 118 for a gray of 0.18."""
    if works:
        setup.require_folder(f"/home/{name}")
    else:
        with pytest.raises(SystemExit):
            setup.require_folder(f"/home/{name}")
        assert "move this checkout" in capsys.readouterr().out


def test_make_takes_a_python_that_starts(tmp_path: Path) -> None:
    """The python3.11 of pyenv ends with an error where another version is chosen; a folder may have blanks."""
    folder = tmp_path / "my programs"
    folder.mkdir()
    for name, line in (("python3.11", "exit 127"), ("python3", f'exec "{sys.executable}" "$@"')):
        (folder / name).write_text(f"#!/bin/sh\n{line}\n", "utf-8")
        (folder / name).chmod(0o755)
    path = f"{folder}:/usr/bin:/bin"
    done = subprocess.run(["make", "-n", "setup"], cwd=ROOT, env={"PATH": path}, capture_output=True, text=True)
    assert f'"{folder / "python3"}" scripts/setup.py' in done.stdout


def test_a_wrong_venv_is_created_again_and_other_files_are_kept(
    made: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    ran: list[tuple[str, ...]] = []
    monkeypatch.setattr(made, "install", lambda *command: ran.append(command))
    (made.VENV / "mark").touch()
    made.UNFINISHED.touch()
    made.packages()
    assert len(ran) == 2 and "--require-hashes" in ran[0] and "--no-build-isolation" in ran[1]
    assert not (made.VENV / "mark").exists() and made.STAMP.exists() and not made.UNFINISHED.exists()
    made.packages()
    assert len(ran) == 2
    (made.VENV / "mark").touch()
    made.STAMP.write_text("of another lock file")
    made.packages()
    assert len(ran) == 4 and (made.VENV / "mark").exists()


def test_an_interruption_while_installing_starts_over(made: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    def stop(*_command: str) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(made, "install", stop)
    with pytest.raises(KeyboardInterrupt):
        made.packages()
    assert made.whats_wrong() == "its set-up was interrupted"


def test_an_interrupted_removal_starts_over(made: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    remove, ran = shutil.rmtree, []

    def half(place: Path, **_ignored: bool) -> None:
        if place.exists():
            (place / ".unfinished").unlink()
            raise KeyboardInterrupt

    made.UNFINISHED.touch()
    monkeypatch.setattr(made.shutil, "rmtree", half)
    with pytest.raises(KeyboardInterrupt):
        made.packages()
    monkeypatch.setattr(made.shutil, "rmtree", remove)
    monkeypatch.setattr(made, "install", lambda *command: ran.append(command))
    assert not made.VENV.exists()
    made.packages()
    assert made.STAMP.exists()
    assert sorted(path.name for path in made.VENV.parent.glob(".venv*")) == [".venv"]


@pytest.mark.parametrize(
    ("offered", "found"),
    [("libllvm14\nlibllvm15\nlibllvm15-dbg\n", ""), ("libllvm17t64\nlibllvm18\nlibllvm99\n", "libllvm18"),
     ("libllvm15\nlibllvm19\n", "libllvm19"), ("", "")],
)  # fmt: skip
def test_set_up_continues_without_llvm_where_a_distribution_has_none(
    setup: ModuleType, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], offered: str, found: str
) -> None:
    """On Ubuntu 22.04, whose newest LLVM is 15, it asked apt-get for libllvm19, and ended."""
    ran: list[list[str]] = []

    def run(command: list[str], **_options: object) -> subprocess.CompletedProcess[str]:
        ran.append(command)
        return subprocess.CompletedProcess(command, 0, offered if command[0] == "apt-cache" else "", "")

    monkeypatch.setattr(setup.subprocess, "run", run)
    monkeypatch.setattr(setup, "loads", lambda _library: True)
    monkeypatch.setattr(setup, "has_llvm", lambda: False)
    monkeypatch.setattr(setup, "privileged", list)
    monkeypatch.setattr(setup.shutil, "which", lambda program: f"/usr/bin/{program}")
    setup.system_libraries()
    asked = [command[-1] for command in ran if "install" in command]
    assert asked == ([found] if found else [])
    assert ("offers no LLVM from 17 to 20" in capsys.readouterr().out) == (not found)


def test_every_pinned_package_is_locked_with_hashes() -> None:
    lock = (ROOT / "requirements.lock").read_text().replace("\\\n", " ")
    locked = {line.split("==")[0]: line for line in lock.splitlines() if "==" in line}
    pins = re.findall(r"^([\w.-]+)==(\S+)", (ROOT / "constraints.txt").read_text(), re.MULTILINE)
    assert pins
    for name, version in pins:
        line = locked.get(re.sub(r"[-_.]+", "-", name).lower())
        if line is not None:
            assert line.startswith(f"{re.sub(r'[-_.]+', '-', name).lower()}=={version} ")
    assert all("--hash=sha256:" in line for line in locked.values())
    assert {"numpy", "mitsuba", "bpy", "hatchling", "editables", "pytest"} <= set(locked)


def test_the_requested_python_is_installed() -> None:
    done = subprocess.run([sys.executable, "-I", "-c", "import sys; print(sys.prefix)"], capture_output=True, text=True)
    assert Path(done.stdout.strip()) == Path(sys.prefix)

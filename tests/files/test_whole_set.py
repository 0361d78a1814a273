# SPDX-License-Identifier: GPL-3.0-or-later
"""Files that belong together replace those of an earlier run all at once, or stay as they were."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from spectral_core.errors import FileWriteError, InvalidInputError
from spectral_core.files.whole import write_text
from spectral_core.files.whole_set import whole_files

NAMES = ("lights.csv", "texture.exr", "report.json")
WRITER = """
import sys, time
from pathlib import Path
from spectral_core.files.whole_set import whole_files
with whole_files(sys.argv[1]) as folder:
    (folder / "lights.csv").write_text("new")
    print("half", flush=True)
    time.sleep(60)
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with the files of an earlier run, and one of the artist."""
    for name in (*NAMES, "mine.txt"):
        (tmp_path / name).write_text("old")
    return tmp_path


def contents(folder: Path) -> dict[str, str]:
    return {each.name: each.read_text() for each in folder.iterdir()}


def test_all_files_move_and_others_stay(folder: Path) -> None:
    (folder / "lights.csv").chmod(0o640)
    with whole_files(folder) as unfinished:
        for name in NAMES:
            write_text(unfinished / name, "new")
        assert set(contents_of_files(folder).values()) == {"old"}
    assert contents(folder) == dict.fromkeys(NAMES, "new") | {"mine.txt": "old"}
    assert (folder / "lights.csv").stat().st_mode & 0o777 == 0o640


def contents_of_files(folder: Path) -> dict[str, str]:
    return {each.name: each.read_text() for each in folder.iterdir() if each.is_file()}


def test_an_error_between_two_files_keeps_the_earlier_ones(folder: Path) -> None:
    before = contents(folder)
    with pytest.raises(ValueError, match="between"), whole_files(folder) as unfinished:
        write_text(unfinished / "lights.csv", "new")
        raise ValueError("between")
    assert contents(folder) == before


def test_a_file_that_cannot_be_replaced_keeps_all(folder: Path) -> None:
    (folder / "report.json").unlink()
    (folder / "report.json").mkdir()
    with pytest.raises(InvalidInputError, match=r"report\.json is a folder"), whole_files(folder) as unfinished:
        for name in NAMES:
            write_text(unfinished / name, "new")
    assert (folder / "lights.csv").read_text() == (folder / "texture.exr").read_text() == "old"


@pytest.mark.parametrize("with_links", [True, False])
def test_a_file_that_the_system_keeps_brings_back_the_others(folder: Path, monkeypatch, with_links: bool) -> None:
    """The files before the one that could not be replaced stayed new beside old ones."""
    (folder / "lights.csv").chmod(0o640)
    (folder / "report.json").unlink()
    (folder / "picture.png").symlink_to("nowhere")
    before, replace = contents_of_files(folder), Path.replace

    def kept(self: Path, target: Path) -> Path:
        if self.name == "texture.exr":
            raise PermissionError(1, "Operation not permitted")
        return replace(self, target)

    if not with_links:
        monkeypatch.setattr(os, "link", lambda *_given, **_options: (_ for _ in ()).throw(PermissionError(1, "none")))
    monkeypatch.setattr(Path, "replace", kept)
    with pytest.raises(FileWriteError, match=r"texture\.exr could not be written: Operation not permitted"):  # noqa: SIM117
        with whole_files(folder) as unfinished:
            for name in (*NAMES, "picture.png"):
                (unfinished / name).write_text("new")
    assert contents_of_files(folder) == before
    assert (folder / "picture.png").is_symlink() and not os.path.lexists(folder / "report.json")
    assert (folder / "lights.csv").stat().st_mode & 0o777 == 0o640
    assert not list(folder.glob(".spectral*"))


def test_an_error_names_the_file_and_not_a_hidden_folder(folder: Path) -> None:
    with pytest.raises(FileWriteError) as caught, whole_files(folder) as unfinished:
        write_text(unfinished / "deeper" / "lights.csv", "new")
    assert ".spectral" not in str(caught.value) and str(folder / "deeper") in str(caught.value)


@pytest.mark.parametrize("end", [signal.SIGTERM, signal.SIGKILL])
def test_a_process_that_is_ended_between_two_files_keeps_the_earlier_ones(folder: Path, end: int) -> None:
    """The next process deletes what it left."""
    before = contents(folder)
    root = Path(__file__).resolve().parents[2]
    command = [sys.executable, "-c", WRITER, str(folder)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, env={**os.environ, "PYTHONPATH": str(root)}) as process:
        assert process.stdout is not None and process.stdout.readline() == b"half\n"
        process.send_signal(end)
        process.wait(timeout=20)
    assert contents_of_files(folder) == before
    with whole_files(folder) as unfinished:
        write_text(unfinished / "lights.csv", "new")
    assert contents(folder) == before | {"lights.csv": "new"}


@pytest.mark.slow
def test_a_texture_that_is_stopped_while_it_writes_keeps_the_earlier_one(tmp_path: Path) -> None:
    """Cancel in Blender ends the process at any moment; a new texture under the earlier lights shows no picture."""
    from spectral_core.spectra.pictures import png_bytes

    across = np.linspace(0, 255, 256, dtype=np.uint8)
    pictures = (np.dstack([a, b, c]) for a, b, c in (
        (across[None].repeat(256, 0), across[:, None].repeat(256, 1), np.full((256, 256), 90, np.uint8)),
        (across[:, None].repeat(256, 1), np.full((256, 256), 90, np.uint8), across[None].repeat(256, 0)),
    ))  # fmt: skip
    for name, picture in zip("ab", pictures, strict=True):
        (tmp_path / f"{name}.png").write_bytes(png_bytes(picture))
    root, out = Path(__file__).resolve().parents[2], tmp_path / "out"
    command = [sys.executable, "-m", "spectral_core.cli", "texture", "a.png", "b.png", "--out", "out", "--progress"]
    command += ["--light", "D65", "--light", "HP1"]
    env = {**os.environ, "PYTHONPATH": str(root)}
    before = dict.fromkeys(("texture.exr", "lights.csv", "shown_1.png", "report.json"), b"of an earlier run")
    out.mkdir()
    for name, content in before.items():
        (out / name).write_bytes(content)
    with subprocess.Popen(command, cwd=tmp_path, env=env, stdout=subprocess.PIPE) as process:
        assert process.stdout is not None
        while not process.stdout.readline().endswith(b"writing\n"):
            assert process.poll() is None
        while process.poll() is None and not list(out.rglob(".spectral-set-*/texture.exr")):
            time.sleep(0.002)
        process.kill()
    assert {each.name: each.read_bytes() for each in out.iterdir() if each.is_file()} == before

# SPDX-License-Identifier: GPL-3.0-or-later
"""The files of shared pixels: none is left, whatever ends the process that made it, and only such files are deleted."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("mitsuba")

from spectral_core.errors import RenderError
from spectral_core.files import of_process
from spectral_core.render.live import area as area_module
from spectral_core.render.live.area import PREFIX, PixelArea, clean, delete_left

PIXELS = np.ones((2, 2, 4), np.float32)
MAKER = """
import json, os, sys
sys.path[:] = json.loads(os.environ["SPECTRAL_TEST_PATH"])
from spectral_core.render.live.area import PixelArea
made = PixelArea.make(100)
print(made.path, flush=True)
sys.stdin.readline()
"""


@contextmanager
def maker() -> Iterator[tuple[subprocess.Popen[str], Path]]:
    """A process that has made an area, and ends after a line; the file of its area."""
    environment = {**os.environ, "SPECTRAL_TEST_PATH": json.dumps([str(Path(__file__).parents[2]), *sys.path])}
    command = [sys.executable, "-c", MAKER]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=environment
    ) as process:
        assert process.stdout is not None
        path = Path(process.stdout.readline().strip())
        assert path.name.startswith(f"{PREFIX}{process.pid}-")
        assert path.exists()
        try:
            yield process, path
        finally:
            process.kill()
            path.unlink(missing_ok=True)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder of all areas of a test."""
    monkeypatch.setattr(area_module, "_folders", lambda: [str(tmp_path)])
    return tmp_path


def test_a_process_that_ends_deletes_its_files() -> None:
    with maker() as (process, path):
        process.communicate("end\n")
        assert process.returncode == 0
        assert not path.exists()


def test_the_files_of_a_process_that_was_killed_are_deleted_by_a_later_one() -> None:
    """They stayed in /dev/shm, some hundred megabytes each, until the computer was restarted."""
    with maker() as (process, path):
        clean()
        assert path.exists(), "its process still runs"
        process.kill()
        process.wait()
        assert path.exists()
        clean()
        assert not path.exists()


def test_only_files_of_ended_processes_of_this_system_are_deleted(folder: Path) -> None:
    with subprocess.Popen([sys.executable, "-c", ""]) as ended:
        ended.wait()
    here = of_process._system()
    left = folder / f"{PREFIX}{ended.pid}-{here}-abcd_123"
    kept = [
        f"{PREFIX}{ended.pid}-{int(here, 16) ^ 1:08x}-abcd_123",  # of another computer or container
        f"{PREFIX}{os.getpid()}-{here}-abcd_123",
        f"{PREFIX}{os.getppid()}-{here}-abcd_123",
        f"{PREFIX}4294967297-{here}-abcd_123",  # no number of a process
        f"{PREFIX}abcd_123",  # of an earlier version, which wrote no number
        f"{PREFIX}{ended.pid}-{here}-abcd_123.txt",
        f"another-{PREFIX}{ended.pid}-{here}-abcd_123",
    ]
    for path in (left, *map(folder.joinpath, kept)):
        path.touch()
    clean()
    assert sorted(path.name for path in folder.iterdir()) == sorted(kept)


def test_a_file_whose_deletion_the_system_refuses_is_deleted_later(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Windows refuses it while a process has the file mapped: the session itself, or the renderer."""
    made, unlink, mapped = PixelArea.make(4), Path.unlink, [True]

    def refusing(path: Path, missing_ok: bool = False) -> None:
        if mapped[0] or not made._map.closed:
            raise PermissionError(13, "a process has mapped it", str(path))
        unlink(path, missing_ok)

    monkeypatch.setattr(Path, "unlink", refusing)
    made.remove()
    assert list(folder.iterdir()) == [Path(made.path)]
    mapped[0] = False
    delete_left()
    assert list(folder.iterdir()) == []
    assert made.path not in area_module._made | area_module._left


@pytest.mark.parametrize("step", ["truncate", "mmap"])
def test_an_area_that_cannot_be_made_leaves_no_file(folder: Path, monkeypatch: pytest.MonkeyPatch, step: str) -> None:
    def failing(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(area_module.os if step == "truncate" else area_module.mmap, step, failing)
    with pytest.raises(OSError, match="No space"):
        PixelArea.make(4)
    assert list(folder.iterdir()) == []


@pytest.mark.parametrize("free", [63_000_000, 0, None], ids=["a container's", "full", "not readable"])
def test_an_area_is_a_temporary_file_where_memory_is_short(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, free: int | None
) -> None:
    """A process that writes to a file in memory where none is left ends with a bus error."""
    memory, temporary = tmp_path / "memory", tmp_path / "temporary"
    memory.mkdir()
    temporary.mkdir()
    usage = area_module.shutil.disk_usage(tmp_path)

    def disk_usage(folder: str) -> object:
        if free is None:
            raise PermissionError(13, "Permission denied")
        return usage._replace(free=free if folder == str(memory) else 1 << 40)

    monkeypatch.setattr(area_module, "_folders", lambda: [str(memory), str(temporary)])
    monkeypatch.setattr(area_module.shutil, "disk_usage", disk_usage)
    made = PixelArea.make(3840 * 2160)
    small = PixelArea.make(4)
    try:
        assert Path(made.path).parent == temporary
        assert Path(small.path).parent == (memory if free else temporary)
    finally:
        made.remove()
        small.remove()


@pytest.mark.parametrize(("free", "fits"), [(0, False), (4 * 10**6, False), (10**9, True)])
def test_a_full_disk_of_temporary_files_is_told_with_its_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, free: int, fits: bool
) -> None:
    """The file was made with holes, and the renderer's process ended with a bus error when it wrote there."""
    usage = shutil.disk_usage(tmp_path)
    monkeypatch.setattr(area_module, "_folders", lambda: [str(tmp_path)])
    monkeypatch.setattr(shutil, "disk_usage", lambda _folder: usage._replace(free=free))
    if fits:
        PixelArea.make(640 * 360).remove()
    else:
        with pytest.raises(RenderError, match=f"{tmp_path}, has {free / 1e6:.1f} MB left.* TMPDIR"):
            PixelArea.make(640 * 360)
    assert list(tmp_path.iterdir()) == []


def test_an_area_that_is_closed_while_it_is_read_gives_no_picture(folder: Path) -> None:
    made = PixelArea.make(4)
    place = made.write(PIXELS)
    shown = made.read(place)
    np.testing.assert_array_equal(shown, PIXELS)
    head, _body = made._parts(place.slot, 4)  # a reader at work
    made.remove()
    assert head[0] == place.number
    assert list(folder.iterdir()) == []
    del head, _body
    made.close()
    assert made.read(place) is None


def test_a_place_in_an_area_fits_no_picture_of_the_area_that_replaces_it(folder: Path) -> None:
    smaller, larger = PixelArea.make(4), PixelArea.make(8)
    place, other = smaller.write(PIXELS), larger.write(2 * PIXELS)
    assert place.slot == other.slot
    assert larger.read(place) is None
    np.testing.assert_array_equal(larger.read(other), 2 * PIXELS)
    smaller.remove()
    larger.remove()

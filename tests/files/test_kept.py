# SPDX-License-Identifier: GPL-3.0-or-later
"""Results of long work that cannot be written where they belong."""

from __future__ import annotations

import re
import tempfile
from pathlib import Path
from typing import Any

import pytest

from spectral_core.errors import FileWriteError, InvalidInputError
from spectral_core.files.kept import written_or_kept
from spectral_core.files.whole import write_text


def write(path: Path) -> str:
    write_text(path, "an hour of work")
    return path.name


def test_a_file_that_can_be_written_is_where_it_belongs(tmp_path: Path, monkeypatch: Any) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "none"))
    assert written_or_kept(tmp_path / "a.txt", write) == "a.txt"
    assert (tmp_path / "a.txt").read_text() == "an hour of work"


@pytest.mark.parametrize("target", ["gone/a.txt", "folder"])
def test_any_other_result_is_kept_and_its_folder_named(tmp_path: Path, monkeypatch: Any, target: str) -> None:
    """The recording or picture of hours was lost, with the name of the full disk."""
    (tmp_path / "temporary").mkdir()
    (tmp_path / "folder").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "temporary"))
    with pytest.raises(FileWriteError, match=re.escape(str(tmp_path / target))) as raised:
        written_or_kept(tmp_path / target, write)
    (kept,) = (tmp_path / "temporary").rglob("*/*")
    assert kept.name == Path(target).name and kept.read_text() == "an hour of work"
    assert str(kept.parent) in str(raised.value)


def test_with_both_disks_full_the_first_error_is_told(tmp_path: Path, monkeypatch: Any) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "none"))
    with pytest.raises(FileWriteError, match=r"gone does not exist; create it first$"):
        written_or_kept(tmp_path / "gone" / "a.txt", write)


def test_an_error_of_the_input_is_not_written_elsewhere(tmp_path: Path, monkeypatch: Any) -> None:
    def refuse(_: Path) -> None:
        raise InvalidInputError("two layers have one name")

    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    with pytest.raises(InvalidInputError, match="^two layers have one name$"):
        written_or_kept(tmp_path / "a.txt", refuse)
    assert list(tmp_path.iterdir()) == []

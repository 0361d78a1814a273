# SPDX-License-Identifier: GPL-3.0-or-later
"""Volumes whose names hold letters beyond ASCII, line ends or bytes that are no text are written and read."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.files import read_volume, write_volume

DATA = np.arange(24.0).reshape(2, 3, 4)


@pytest.mark.parametrize(
    ("name", "read"),
    [("head", "head"), ("k:=v #1", "k:=v #1"), ("a\r\nb", "a b"), ("Schädel", "file"), ("頭", "file"),
     ("\udce4", "file"), (" ", "file"), ("a\0b", "file")],
)  # fmt: skip
def test_names_of_nrrd_files(tmp_path: Path, name: str, read: str) -> None:
    """A name beyond ASCII ended the program with an error of the codec; such a volume has the name of its file."""
    pytest.importorskip("nrrd")
    volume = read_volume(write_volume(ScalarVolume(name, DATA), tmp_path / "file.nrrd"))
    assert volume.name == read
    assert np.array_equal(volume.data, DATA)


@pytest.mark.parametrize(("name", "read"), [("Schädel 頭", "Schädel 頭"), ("a\nb", "a\nb"), ("x\udce4", "x?")])
def test_names_of_openvdb_files(tmp_path: Path, name: str, read: str) -> None:
    """A name of a file that is not UTF-8 ended the program with an error of OpenVDB."""
    volume = read_volume(write_volume(ScalarVolume(name, DATA), tmp_path / "file.vdb"))
    assert volume.name == read
    assert np.array_equal(volume.data, DATA)

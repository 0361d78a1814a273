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


HEADERS = {
    "nhdr": (
        "NRRD0004\ntype: short\ndimension: 3\nsizes: 2 3 4\nencoding: raw\nendian: little\ncontent: Schädel\n"
        'spacings: 1 1 1\nunits: "µm" "µm" "mm"\ndata file: Schädel µ.raw\n'
    ),
    "mhd": (
        "ObjectType = Image\nNDims = 3\nDimSize = 2 3 4\nElementType = MET_SHORT\nElementByteOrderMSB = False\n"
        "ElementDataFile = Schädel µ.raw\n"
    ),
    "dat": "ObjectFileName: Schädel µ.raw\nResolution: 2 3 4\nFormat: SHORT\n",
}


@pytest.mark.parametrize("encoding", ["utf-8", "cp1252"])
@pytest.mark.parametrize("ending", HEADERS)
def test_headers_with_letters_beyond_ascii(tmp_path: Path, ending: str, encoding: str) -> None:
    """Of NRRD headers they were dropped: the data file was not found, and the µm of an axis beside mm were meters."""
    if ending == "nhdr":
        pytest.importorskip("nrrd")
    header = tmp_path / f"head.{ending}"
    header.write_bytes(HEADERS[ending].encode(encoding))
    (tmp_path / "Schädel µ.raw").write_bytes(DATA.astype("<i2").tobytes("F"))
    volume = read_volume(header)
    assert np.array_equal(volume.data, DATA)
    if ending == "nhdr":
        assert volume.name == "Schädel" and volume.voxel_size == pytest.approx([1, 1, 1000])


@pytest.mark.parametrize("encoding", ["utf-8", "cp1252"])
def test_listed_files_with_letters_beyond_ascii(tmp_path: Path, encoding: str) -> None:
    pytest.importorskip("nrrd")
    fields = "NRRD0004\ntype: short\ndimension: 3\nsizes: 2 3 4\nencoding: raw\nendian: little\ndata file: LIST\n"
    names = [f"Schicht {k} µ.raw" for k in range(4)]
    (tmp_path / "head.nhdr").write_bytes((fields + "\n".join(names)).encode(encoding))
    for name, plane in zip(names, np.moveaxis(DATA, 2, 0), strict=True):
        (tmp_path / name).write_bytes(plane.astype("<i2").tobytes("F"))
    assert np.array_equal(read_volume(tmp_path / "head.nhdr").data, DATA)

# SPDX-License-Identifier: GPL-3.0-or-later
"""The choice of a reader, writing, and refused files."""

from __future__ import annotations

import gzip
import os
from pathlib import Path

import numpy as np
import pytest

from spectral_core.errors import FileFormatError, InvalidInputError, MissingDependencyError
from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.files import detect_format, known_formats, read_volume, write_volume
from tests.volume_files.volume_fixtures import (
    DATA,
    DIRECTIONS,
    check,
    fixture_values,
    world,
)

# Choosing the reader, and writing


def test_contents_have_precedence_over_the_name(tmp_path):
    (tmp_path / "renamed.raw").write_bytes((DATA / "itk.nrrd").read_bytes())
    (tmp_path / "noending").write_bytes((DATA / "points_binary.vtk").read_bytes())
    assert detect_format(tmp_path / "renamed.raw").name == "nrrd"
    assert detect_format(tmp_path / "noending").name == "vtk"
    check(read_volume(tmp_path / "renamed.raw"), fixture_values("int16"), world(DIRECTIONS))


@pytest.mark.parametrize("name", ["itk.nrrd", "image.mha", "points_ascii.vtk", "image_ascii.vti"])
def test_a_file_inside_gzip_is_named_as_such(tmp_path, name):
    (tmp_path / f"{name}.gz").write_bytes(gzip.compress((DATA / name).read_bytes()))
    with pytest.raises(FileFormatError, match="inside gzip, which is read of NIfTI alone; unpack it with gunzip"):
        read_volume(tmp_path / f"{name}.gz")


def test_unknown_and_misnamed_files_are_reported(tmp_path):
    (tmp_path / "a.nrrd").write_bytes(b"\x89PNG\r\n")
    (tmp_path / "b.xyz").write_bytes(b"hello")
    (tmp_path / "c.vdb").write_bytes(b"")
    with pytest.raises(FileFormatError, match=r"is named as NRRD but does not begin as one does, but with b'\\x89PNG"):
        read_volume(tmp_path / "a.nrrd")
    with pytest.raises(FileFormatError, match=r"no volume format known here; expected one of .*\.nrrd"):
        read_volume(tmp_path / "b.xyz")
    with pytest.raises(FileFormatError, match="is named as OpenVDB but is empty"):
        read_volume(tmp_path / "c.vdb")
    with pytest.raises(InvalidInputError, match="there is no file"):
        read_volume(tmp_path / "missing.nrrd")
    with pytest.raises(FileFormatError, match=r"holds no \.tif"):
        read_volume(tmp_path)


def test_other_vtk_datasets_are_refused(tmp_path):
    text = (DATA / "points_ascii.vtk").read_text()
    (tmp_path / "a.vtk").write_text(text.replace("STRUCTURED_POINTS", "POLYDATA"))
    with pytest.raises(FileFormatError, match="holds a POLYDATA dataset; expected STRUCTURED_POINTS"):
        read_volume(tmp_path / "a.vtk")
    text = (DATA / "image_ascii.vti").read_text()
    (tmp_path / "a.vti").write_text(text.replace('type="ImageData"', 'type="PolyData"'))
    with pytest.raises(FileFormatError, match="holds PolyData; expected ImageData"):
        read_volume(tmp_path / "a.vti")


def test_invalid_voxels_are_reported_with_the_file(tmp_path):
    values = fixture_values("float32")
    values[1, 2, 3] = np.inf
    np.save(tmp_path / "inf.npy", values)
    with pytest.raises(FileFormatError, match=r"inf.npy: volume 'inf' holds 1 value\(s\).*inf at index \(1, 2, 3\)"):
        read_volume(tmp_path / "inf.npy")


def test_write_refuses_other_endings_and_missing_folders(tmp_path):
    volume = ScalarVolume("v", np.ones((2, 2, 2)))
    with pytest.raises(InvalidInputError, match=r"expected an ending \.nrrd or \.vdb"):
        write_volume(volume, tmp_path / "a.tif")
    with pytest.raises(InvalidInputError, match="does not exist; create it"):
        write_volume(volume, tmp_path / "no" / "a.nrrd")


@pytest.mark.parametrize(("module", "path"), [("nrrd", "itk.nrrd"), ("lz4", "image_appended_raw_lz4.vti")])
def test_missing_libraries_name_the_package_to_install(monkeypatch, module, path):
    monkeypatch.setitem(__import__("sys").modules, module, None)
    with pytest.raises(MissingDependencyError, match="pip install"):
        read_volume(DATA / path)


def test_every_format_has_a_reader():
    import importlib

    for entry in known_formats():
        module = importlib.import_module(f"spectral_core.volume.files.formats.{entry.name}_format")
        assert callable(module.read)
        assert hasattr(module, "write") == entry.writes


def shared_volumes() -> Path:
    return Path(os.environ.get("SPECTRAL_SHARED_DATA", Path(__file__).parents[3] / "shared" / "data")) / "volumes"


@pytest.mark.skipif(not shared_volumes().is_dir(), reason="the real volumes are not here")
def test_measured_volumes_are_read():
    head = read_volume(shared_volumes() / "headsq.nrrd")
    assert (head.shape, head.data.dtype) == ((64, 64, 93), np.uint16)
    assert head.voxel_size == pytest.approx([3.2, 3.2, 1.5])
    assert read_volume(shared_volumes() / "hipip.nrrd").shape == (68, 68, 68)

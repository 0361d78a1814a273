# SPDX-License-Identifier: GPL-3.0-or-later
"""Truncated and damaged files: a reader reports the problem or returns the right volume, and nothing else."""

from __future__ import annotations

import gzip
import warnings
from pathlib import Path

import nibabel
import nrrd
import numpy as np
import pytest
import tifffile

from spectral_core.errors import SpectralError
from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.files import read_volume, write_volume
from tests.volume_files.volume_fixtures import DATA, fixture_values

VALUES = np.random.default_rng(7).integers(0, 1000, (9, 8, 7)).astype(np.int16)
"""Noise, so that no decompressor can replace a missing end."""


def write_all(folder: Path) -> list[Path]:
    """The same volume in every format and encoding; the files that carry the data."""
    for encoding in ("raw", "gzip", "bzip2", "ascii"):
        nrrd.write(str(folder / f"{encoding}.nrrd"), VALUES, {"encoding": encoding})
    nrrd.write(str(folder / "detached.nhdr"), VALUES, {"encoding": "gzip"}, detached_header=True)
    nibabel.save(nibabel.Nifti1Image(VALUES, np.eye(4)), folder / "one.nii")
    nibabel.save(nibabel.Nifti1Image(VALUES, np.eye(4)), folder / "packed.nii.gz")
    np.save(folder / "plain.npy", VALUES)
    np.savez_compressed(folder / "packed.npz", data=VALUES)
    pages = VALUES.transpose(2, 1, 0)
    tifffile.imwrite(folder / "plain.tif", pages, photometric="minisblack")
    tifffile.imwrite(folder / "packed.tif", pages, photometric="minisblack", compression="deflate")
    with tifffile.TiffWriter(folder / "pages.tif") as writer:  # separate pages, as in files of most programs
        for page in pages:
            writer.write(page, photometric="minisblack", metadata=None)
    head = "NDims = 3\nDimSize = 9 8 7\nElementType = MET_SHORT\nElementDataFile = LOCAL\n"
    (folder / "plain.mha").write_bytes(head.encode() + VALUES.tobytes(order="F"))
    (folder / "numbers_9x8x7_int16.raw").write_bytes(VALUES.tobytes(order="F"))
    return sorted(path for path in folder.iterdir() if path.suffix != ".nhdr")


def entry_of(path: Path) -> Path:
    """The file that a user opens: the header, if the data are in another file."""
    return path.with_name("detached.nhdr") if path.name.startswith("detached") else path


def result_of(path: Path):
    """The volume, or None for an error of this project; any other exception fails the test."""
    with warnings.catch_warnings():
        warnings.simplefilter(
            "ignore"
        )  # the readers' libraries warn about invalid headers; the test checks results only
        try:
            return read_volume(entry_of(path))
        except SpectralError:
            return None


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    return write_all(tmp_path_factory.mktemp("written"))


def test_every_file_is_read_back(written):
    assert len(written) == 14
    for path in written:
        assert np.array_equal(read_volume(entry_of(path)).data, VALUES), path


def test_truncated_files_are_refused(written):
    """Truncation at any byte gives an error, or all data if only the last bytes of the container are missing."""
    accepted = []
    for path in written:
        whole = path.read_bytes()
        for length in sorted({*range(0, len(whole), max(len(whole) // 16, 1)), len(whole) - 1, len(whole) - 9}):
            path.write_bytes(whole[:length])
            volume = result_of(path)
            if volume is not None:
                different = np.flatnonzero((volume.data != VALUES).ravel(order="F")).tolist()
                # the absence of a text's last digit cannot be detected
                assert different == [] or (path.name == "ascii.nrrd" and different == [VALUES.size - 1]), length
                accepted.append((path.name, len(whole) - length))
        path.write_bytes(whole)
    # Only the last digits of a text and the end mark behind the last page of a TIFF may be missing.
    assert all(
        (name == "ascii.nrrd" and lost < 4) or (name == "plain.tif" and lost <= 12) for name, lost in accepted
    ), accepted


@pytest.mark.parametrize(
    "name", sorted(path.name for path in DATA.iterdir() if path.suffix in (".vtk", ".vti", ".mha"))
)
def test_truncated_files_of_vtk_and_itk_are_refused(tmp_path, name):
    whole, path = (DATA / name).read_bytes(), tmp_path / name
    needed = whole.rstrip() if b"AppendedData" not in whole else whole[: whole.rindex(b"</AppendedData>")].rstrip()
    for length in range(0, len(needed) - 1, 19):
        path.write_bytes(whole[:length])
        volume = result_of(path)
        if volume is not None:
            # In a legacy file the first array precedes the second; a text's missing last digit cannot be detected.
            assert name.endswith(".vtk")
            different = volume.data != fixture_values("int16")
            assert np.flatnonzero(different.ravel(order="F")).tolist() in ([], [59])


@pytest.mark.parametrize("own", [True, False])
def test_truncated_vdb_files_are_refused(tmp_path, monkeypatch, own):
    from spectral_core.volume.files.formats import openvdb_format

    if own:
        monkeypatch.setattr(openvdb_format, "find_openvdb", lambda: None)
    elif openvdb_format.find_openvdb() is None:
        pytest.skip("no OpenVDB module here")
    path = write_volume(ScalarVolume("v", VALUES), tmp_path / "a.vdb")
    whole = path.read_bytes()
    for length in [*range(0, len(whole), len(whole) // 20), *range(len(whole) - 20, len(whole))]:
        path.write_bytes(whole[:length])
        assert result_of(path) is None, length


def test_flipped_bytes_raise_only_errors_of_this_project(written):
    """Twenty random changes per file give an error of this project or a finite volume, never another exception."""
    rng = np.random.default_rng(11)
    for path in [*written]:
        whole = path.read_bytes()
        for _ in range(20):
            damaged = bytearray(whole)
            # Mostly in the header, which has the structure.
            for place in (rng.random(3) ** 3 * len(whole)).astype(int):
                damaged[place] = rng.integers(256)
            path.write_bytes(damaged)
            volume = result_of(path)
            assert volume is None or np.isfinite(volume.data.astype(float)).all()
        path.write_bytes(whole)


@pytest.mark.parametrize(
    "name", sorted(path.name for path in DATA.iterdir() if path.suffix in (".vtk", ".vti", ".mha", ".nrrd"))
)
def test_flipped_bytes_in_files_of_vtk_and_itk(tmp_path, name):
    rng = np.random.default_rng(13)
    whole = (DATA / name).read_bytes()
    for _ in range(15):
        damaged = bytearray(whole)
        for place in (rng.random(2) ** 2 * len(whole)).astype(int):
            damaged[place] = rng.integers(256)
        (tmp_path / name).write_bytes(damaged)
        result_of(tmp_path / name)


def test_flipped_bytes_in_written_vdb_files(tmp_path, monkeypatch):
    from spectral_core.volume.files.formats import openvdb_format

    monkeypatch.setattr(openvdb_format, "find_openvdb", lambda: None)
    path = write_volume(ScalarVolume("v", VALUES), tmp_path / "a.vdb")
    whole, rng = path.read_bytes(), np.random.default_rng(17)
    for _ in range(60):
        damaged = bytearray(whole)
        for place in (rng.random(2) ** 3 * len(whole)).astype(int):
            damaged[place] = rng.integers(256)
        path.write_bytes(damaged)
        result_of(path)


def test_gzipped_noise_is_refused(tmp_path):
    (tmp_path / "a.nii.gz").write_bytes(gzip.compress(b"nothing of value" * 50))
    (tmp_path / "b.nii.gz").write_bytes(b"\x1f\x8b\x08rubbish")
    for name in ("a.nii.gz", "b.nii.gz"):
        with pytest.raises(SpectralError, match=r"does not begin as one does|gzipped but truncated"):
            read_volume(tmp_path / name)

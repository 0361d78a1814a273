# SPDX-License-Identifier: GPL-3.0-or-later
"""Units of single axes, positions and kinds of NRRD headers, and the voxel sizes of TIFF slices in a folder."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from spectral_core.errors import FileFormatError, MissingDependencyError
from spectral_core.volume.files import read_volume
from tests.volume_files.test_header_fields import VALUES, nrrd_of, stored

DATA = stored(VALUES, "<i2")
SLICES = VALUES.transpose(2, 1, 0).astype(np.uint16)


def matrix_of(tmp_path: Path, **fields: str) -> np.ndarray:
    volume = read_volume(nrrd_of(tmp_path / "a.nrrd", DATA, **fields))
    assert np.array_equal(volume.data, VALUES)
    return volume.world_from_index


def test_nrrd_units_of_each_axis(tmp_path: Path) -> None:
    """A depth in micrometers beside millimeters made the volume a thousand times too deep."""
    apart = {"spacings": "0.5 0.5 2000", "axis_mins": "1 2 3000"}
    expected = [[0.5, 0, 0, 1], [0, 0.5, 0, 2], [0, 0, 2, 3], [0, 0, 0, 1]]
    assert np.allclose(matrix_of(tmp_path, **apart, units='"mm" "mm" "um"'), expected)
    unchanged = matrix_of(tmp_path, **apart, units='"x" "x" "x"')
    assert unchanged[2].tolist() == [0, 0, 2000, 3000]
    turned = {"space_dimension": "3", "space_directions": "(0,0,3000) (2,0,0) (0,1,0)", "space_origin": "(1,2,5000)"}
    expected = [[0, 2, 0, 1], [0, 0, 1, 2], [3, 0, 0, 5], [0, 0, 0, 1]]
    assert np.allclose(matrix_of(tmp_path, **turned, space_units='"mm" "millimeters" "micron"'), expected)
    with pytest.raises(FileFormatError, match="units mm, mm, ell; expected one unit"):
        matrix_of(tmp_path, **apart, units='"mm" "mm" "ell"')


def test_nrrd_other_name_of_centerings(tmp_path: Path) -> None:
    """``centers`` is the same field as ``centerings``; it was not read, and cells had the distance of nodes."""
    bounds = {"axis_mins": "0 0 0", "axis_maxs": "8 6 12"}
    assert np.allclose(matrix_of(tmp_path, **bounds, centers="cell cell node")[:3, 3], [1, 1, 0])
    assert np.allclose(np.diag(matrix_of(tmp_path, **bounds, centers="cell cell node")), [2, 2, 3, 1])


def test_nrrd_origin_beside_spacings(tmp_path: Path) -> None:
    """The origin was read beside directions only."""
    moved = matrix_of(tmp_path, space_dimension="3", spacings="1 2 3", space_origin="(7,8,9)")
    assert np.allclose(moved, [[1, 0, 0, 7], [0, 2, 0, 8], [0, 0, 3, 9], [0, 0, 0, 1]])


@pytest.mark.parametrize("kinds", ["RGB-color domain domain", "space space vector", "2-vector space space"])
def test_nrrd_picture_of_colors_or_vectors_is_no_volume(tmp_path: Path, kinds: str) -> None:
    """The channels of a picture were read as slices."""
    with pytest.raises(FileFormatError, match="of which 2 are space"):
        matrix_of(tmp_path, kinds=kinds)
    matrix_of(tmp_path, kinds="domain domain list")


def write_slices(folder: Path, spacing: dict[str, Any], resolution: Any = (2, 4)) -> Path:
    tifffile = pytest.importorskip("tifffile")
    folder.mkdir()
    for number, page in enumerate(SLICES):
        tifffile.imwrite(
            folder / f"s{number}.tif", page, imagej=True, resolution=resolution, metadata={"unit": "um", **spacing}
        )
    return folder


def test_slices_have_the_voxel_size_of_their_files(tmp_path: Path) -> None:
    """Slices of ImageJ became cubes of size 1."""
    stated = read_volume(write_slices(tmp_path / "a", {"spacing": 3.0}))
    assert np.allclose(np.diag(stated.world_from_index), [0.5, 0.25, 3, 1])
    assert np.array_equal(stated.data, VALUES)
    flat = read_volume(write_slices(tmp_path / "b", {}, (2, 2)))
    assert np.allclose(np.diag(flat.world_from_index), [0.5, 0.5, 0.5, 1])
    other = write_slices(tmp_path / "c", {}, (5, 5)) / "s1.tif"
    other.replace(tmp_path / "b" / "s1.tif")
    with pytest.raises(FileFormatError, match=r"s1.tif .* has voxels of \[0.2, 0.2, 0.2\], s0.tif has"):
        read_volume(tmp_path / "b")


def test_imagej_units_of_each_axis(tmp_path: Path) -> None:
    tifffile = pytest.importorskip("tifffile")
    metadata = {"axes": "ZYX", "spacing": 3000, "unit": "\\u00B5m", "zunit": "nm"}
    tifffile.imwrite(tmp_path / "a.tif", SLICES, imagej=True, resolution=(2, 4), metadata=metadata)
    assert np.allclose(np.diag(read_volume(tmp_path / "a.tif").world_from_index), [0.5, 0.25, 3, 1])


def test_files_that_macos_puts_beside_slices_are_none(tmp_path: Path) -> None:
    """``._s0.tif`` made the whole folder unreadable, with a message of a truncated file."""
    folder = write_slices(tmp_path / "a", {})
    (folder / "._s0.tif").write_bytes(bytes.fromhex("0005160700020000") + b"Mac OS X        ")
    assert np.array_equal(read_volume(folder).data, VALUES)


def test_a_compression_that_needs_a_package_is_named(tmp_path: Path) -> None:
    """The message was that the file is no TIFF, or truncated."""
    image = pytest.importorskip("PIL.Image")
    pytest.importorskip("tifffile")
    pages = [image.fromarray(page.astype(np.uint8)) for page in SLICES]
    pages[0].save(tmp_path / "a.tif", save_all=True, append_images=pages[1:], compression="tiff_lzw")
    try:
        import imagecodecs  # noqa: F401
    except ImportError:
        with pytest.raises(MissingDependencyError, match="compressed as LZW, which needs .* imagecodecs.* Deflate"):
            read_volume(tmp_path / "a.tif")
    else:
        assert read_volume(tmp_path / "a.tif").shape == VALUES.shape

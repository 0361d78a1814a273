# SPDX-License-Identifier: GPL-3.0-or-later
"""Photographs of a turned camera are read upright, whatever else their Exif data hold."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

from spectral_core.errors import FileFormatError
from spectral_core.render.images.pictures import read_picture

UPRIGHT = np.kron(np.random.default_rng(0).integers(0, 256, (2, 3, 3)), np.ones((16, 16, 1))).astype(np.uint8)
AS_STORED = {  # what the camera's sensor saw, by the orientation that it states (Exif 2.3, figure of tag 0x0112)
    1: lambda p: p,
    2: np.fliplr,
    3: lambda p: np.rot90(p, 2),
    4: np.flipud,
    5: lambda p: p.swapaxes(0, 1),
    6: lambda p: np.rot90(p, 1),  # to be turned by 90° clockwise
    7: lambda p: np.rot90(p, 2).swapaxes(0, 1),
    8: lambda p: np.rot90(p, -1),
}


def jpeg(path: Path, pixels: np.ndarray, exif: bytes) -> Path:
    """A JPEG file with one more segment of Exif data."""
    import mitsuba

    if mitsuba.variant() is None:
        mitsuba.set_variant("scalar_rgb")
    mitsuba.Bitmap(np.ascontiguousarray(pixels)).write(str(path), quality=100)
    plain = path.read_bytes()
    path.write_bytes(plain[:2] + b"\xff\xe1" + struct.pack(">H", len(exif) + 2) + exif + plain[2:])
    return path


def stated(orientation: int, order: str) -> bytes:
    mark = b"II" if order == "<" else b"MM"
    maker = struct.pack(f"{order}HHII", 0x010F, 2, 4, 0x41414141)
    entry = struct.pack(f"{order}HHIHH", 0x0112, 3, 1, orientation, 0)
    return b"Exif\0\0" + mark + struct.pack(f"{order}HIH", 42, 8, 2) + maker + entry + bytes(4)


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("orientation", AS_STORED)
def test_photographs_are_turned_upright(orientation: int, order: str, tmp_path: Path) -> None:
    path = jpeg(tmp_path / "photograph.jpg", AS_STORED[orientation](UPRIGHT), stated(orientation, order))
    read = read_picture(path)
    assert read.shape == UPRIGHT.shape
    assert np.abs(read.astype(int) - UPRIGHT).mean() < 20  # JPEG blurs the edges of colors


@pytest.mark.parametrize(
    "exif", [b"", b"Exif\0\0", b"Exif\0\0II", stated(6, "<")[:20], stated(99, "<"), b"Exif\0\0XX" + bytes(40)]
)
def test_damaged_data_leave_the_picture_as_it_is(exif: bytes, tmp_path: Path) -> None:
    assert read_picture(jpeg(tmp_path / "odd.jpg", UPRIGHT, exif)).shape == UPRIGHT.shape


def test_other_formats_are_refused_with_those_that_are_read(tmp_path: Path) -> None:
    (tmp_path / "picture.webp").write_bytes(b"RIFF\x10\0\0\0WEBPVP8 ")
    with pytest.raises(FileFormatError, match="expected PNG, JPEG, EXR, HDR, BMP or TGA"):
        read_picture(tmp_path / "picture.webp")


@pytest.mark.parametrize("count", [5, 256])
@pytest.mark.parametrize("header", [12, 40])
def test_a_bmp_of_indices_has_the_colors_of_its_table(header: int, count: int, tmp_path: Path) -> None:
    rng = np.random.default_rng(count)
    table, indices = rng.integers(0, 256, (count, 3), np.uint8), rng.integers(0, count, (3, 4), np.uint8)
    rows = indices[::-1].tobytes()  # bottom row first; four bytes need no padding
    size = struct.pack("<IHHHH", 12, 4, 3, 1, 8) if header == 12 else struct.pack(
        "<IiiHHIIiiII", 40, 4, 3, 1, 8, 0, len(rows), 2835, 2835, count, 0
    )  # fmt: skip
    entries = b"".join(bytes(color[::-1]) + (b"" if header == 12 else b"\0") for color in table)
    first = 14 + len(size) + len(entries)
    path = tmp_path / "indexed.bmp"
    path.write_bytes(b"BM" + struct.pack("<IHHI", first + len(rows), 0, 0, first) + size + entries + rows)
    try:
        np.testing.assert_array_equal(read_picture(path), table[indices])
    except FileFormatError:
        assert header == 12  # the oldest form may be refused, but not read in gray

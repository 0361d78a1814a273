# SPDX-License-Identifier: GPL-3.0-or-later
"""Small files that state impossible sizes, never end, or unpack to gigabytes are refused with their name."""

from __future__ import annotations

import gzip
import lzma
import os
import struct
import sys
import tracemalloc
import zlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from spectral_core.errors import FileFormatError, InvalidInputError
from spectral_core.volume.files import read_volume

NRRD = b"NRRD0004\ntype: uint8\ndimension: 3\nsizes: 2 2 2\nencoding: raw\n"
META = b"ObjectType = Image\nNDims = 3\nDimSize = 2 2 2\nElementType = MET_UCHAR\n"
BOMB = bytes(64 << 20)


def vti(body: bytes, *, extent: bytes = b"0 1 0 1 0 1", compressor: bytes = b"") -> bytes:
    return (
        b'<VTKFile type="ImageData" byte_order="LittleEndian" header_type="UInt32"' + compressor + b">"
        b'<ImageData WholeExtent="' + extent + b'">' + body + b"</ImageData></VTKFile>"
    )


def piece(extent: bytes, values: bytes) -> bytes:
    array = b'<DataArray type="UInt8" Name="a" format="ascii">' + values + b"</DataArray>"
    return b'<Piece Extent="' + extent + b'"><PointData Scalars="a">' + array + b"</PointData></Piece>"


def packed_vti(pack: Callable[[bytes], bytes], name: bytes) -> bytes:
    """A payload that states 8 bytes and unpacks to 64 MiB."""
    packed = pack(BOMB)
    import base64

    head = base64.b64encode(struct.pack("<4I", 1, 8, 8, len(packed)))
    array = b'<DataArray type="UInt8" Name="a" format="binary">' + head + base64.b64encode(packed) + b"</DataArray>"
    body = b'<Piece Extent="0 1 0 1 0 1"><PointData>' + array + b"</PointData></Piece>"
    return vti(body, compressor=b' compressor="' + name + b'"')


def looping_tiff() -> bytes:
    """A list of pages whose only page refers to itself as the next."""
    entries = [(256, 3, 1, 1), (257, 3, 1, 1), (258, 3, 1, 8), (262, 3, 1, 1), (273, 4, 1, 100), (279, 4, 1, 1)]
    pages = struct.pack("<H", len(entries)) + b"".join(struct.pack("<HHII", *entry) for entry in entries)
    return (b"II*\0" + struct.pack("<I", 8) + pages + struct.pack("<I", 8)).ljust(200, b"\0")


CASES = {
    "lines.nrrd": NRRD + b"line skip: 1000000000000\n\n" + bytes(8),
    "pattern.nhdr": NRRD + b"data file: x%d 0 1000000000000 1\n\n",
    "width.nhdr": NRRD + b"data file: x%1000000000d 0 1 1\n\n",
    "none.nhdr": NRRD + b"data file: x%d 1 0 1\n\n",
    "type.nhdr": NRRD + b"data file: x%s%s 0 1 1\n\n",
    "empty_list.nhdr": NRRD + b"data file: LIST\n",
    "pattern.mhd": META + b"ElementDataFile = x%d 0 1000000000000 1\n",
    "width.mhd": META + b"ElementDataFile = x%1000000000d 0 1 1\n",
    "none.mhd": META + b"ElementDataFile = LIST\n",
    "skip.mhd": META + b"HeaderSize = -5\nElementDataFile = skip.mhd\n",
    "channels.mha": META + b"ElementNumberOfChannels = 0\nElementDataFile = LOCAL\n" + bytes(8),
    "nan.dat": b"ObjectFileName: nan.dat\nResolution: nan 2 2\nFormat: UCHAR\n",
    "inf.dat": b"ObjectFileName: inf.dat\nResolution: inf 2 2\nFormat: UCHAR\n",
    "components.vtk": b"# vtk DataFile Version 3.0\nt\nBINARY\nDATASET STRUCTURED_POINTS\nDIMENSIONS 2 2 2\n"
    b"POINT_DATA 8\nSCALARS a unsigned_char 0\nLOOKUP_TABLE default\n" + bytes(8),
    "twice.vti": vti(piece(b"0 0 0 1 0 1", b"7 7 7 7") * 2),
    "huge.nrrd": NRRD.replace(b"2 2 2", b"100000 100000 100000") + b"\n" + bytes(8),
    "huge.mha": META.replace(b"2 2 2", b"100000 100000 100000") + b"ElementDataFile = LOCAL\n" + bytes(8),
    "loop.tif": looping_tiff(),
    "long.nrrd": NRRD + b"x" * 3_000_000,
}


@pytest.mark.parametrize("name", CASES)
def test_a_small_file_that_states_an_impossible_size_is_refused(name: str, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(CASES[name])
    with pytest.raises(InvalidInputError, match=name.split(".")[0]):
        read_volume(tmp_path / name)


@pytest.mark.parametrize(
    ("pack", "name"),
    [(zlib.compress, b"vtkZLibDataCompressor"), (lzma.compress, b"vtkLZMADataCompressor")],
    ids=["zlib", "lzma"],
)
def test_a_block_is_not_unpacked_beyond_its_stated_size(
    pack: Callable[[bytes], bytes], name: bytes, tmp_path: Path
) -> None:
    path = tmp_path / "bomb.vti"
    path.write_bytes(packed_vti(pack, name))
    tracemalloc.start()
    try:
        with pytest.raises(FileFormatError, match=r"bomb\.vti does not unpack to the 8 bytes stated"):
            read_volume(path)
        assert tracemalloc.get_traced_memory()[1] < 20e6
    finally:
        tracemalloc.stop()


def test_a_tiff_strip_is_not_unpacked_beyond_the_size_of_its_page(tmp_path: Path) -> None:
    tifffile = pytest.importorskip("tifffile")
    path = tmp_path / "bomb.tif"
    tifffile.imwrite(path, np.zeros((2, 8, 8), np.uint8), compression="zlib", metadata=None)
    with tifffile.TiffFile(path) as file:
        tags = file.pages[0].tags
        place, count = tags["StripOffsets"].valueoffset, tags["StripByteCounts"].valueoffset
        form = {"SHORT": "<H", "LONG": "<I", "LONG8": "<Q"}
        forms = [form[tags[name].dtype.name] for name in ("StripOffsets", "StripByteCounts")]
    data = bytearray(path.read_bytes())
    bomb = zlib.compress(BOMB, 9)
    for at, layout, value in ((place, forms[0], len(data)), (count, forms[1], len(bomb))):
        if value >= 1 << 8 * struct.calcsize(layout):
            pytest.skip("this tifffile writes a tag that is too short for the bomb")
        struct.pack_into(layout, data, at, value)
    path.write_bytes(bytes(data) + bomb)
    with pytest.raises(FileFormatError, match="unpacks to over"):
        read_volume(path)


def test_a_gzipped_file_that_states_less_is_not_unpacked(tmp_path: Path) -> None:
    (tmp_path / "bomb.nrrd").write_bytes(NRRD.replace(b"raw", b"gzip") + b"\n" + gzip.compress(BOMB))
    with pytest.raises(FileFormatError, match="holds more than the 8 numbers"):
        read_volume(tmp_path / "bomb.nrrd")


@pytest.mark.skipif(os.name != "posix", reason="pipes and devices as Unix has them")
@pytest.mark.parametrize("target", ["/dev/zero", "pipe", "/dev/stdin"])
def test_pipes_and_devices_are_refused_without_waiting(target: str, tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    header = NRRD + b"data file: " + target.encode() + b"\n\n"
    (tmp_path / "a.nhdr").write_bytes(header)
    for path in (tmp_path / "a.nhdr", tmp_path / "pipe", Path("/dev/zero")):
        with pytest.raises(InvalidInputError):
            read_volume(path)


def test_a_vdb_that_states_endless_children_never_reaches_openvdb(tmp_path: Path) -> None:
    from spectral_core.volume.field import ScalarVolume
    from spectral_core.volume.files import write_volume
    from spectral_core.volume.files.vdb.read import descriptors
    from spectral_core.volume.files.vdb.walk import sound_metadata

    path = write_volume(
        ScalarVolume("v", np.random.default_rng(1).random((9, 9, 9)).astype(np.float32)), tmp_path / "v.vdb"
    )
    sound_metadata(path, "density")
    data = bytearray(path.read_bytes())
    with path.open("rb") as stream:
        ((_, _, start, _),) = descriptors(stream, path)
    refused = 0
    for at in range(start, len(data) - 4, 97):
        path.write_bytes(data[:at] + struct.pack("<I", 0x7FFFFFFF) + data[at + 4 :])
        try:
            sound_metadata(path, "density")
        except FileFormatError:
            refused += 1
    assert refused > 3


@pytest.mark.parametrize("damaged", [b"key of a note", b"text of a note"])
def test_metadata_of_a_vdb_that_is_not_utf_8_does_not_end_the_process(damaged: bytes, tmp_path: Path) -> None:
    """OpenVDB's Python module calls abort() for such a text, and Blender would close."""
    from spectral_core.volume.files.vdb.write import write_grid

    values = np.random.default_rng(1).random((9, 9, 9)).astype(np.float32)
    path = tmp_path / "v.vdb"
    write_grid(path, values, np.eye(4), "density", {"key of a note": "text of a note", "spectral_name": "cloud"})
    data = path.read_bytes()
    assert data.count(damaged) == 1
    path.write_bytes(data.replace(damaged, b"\xff\xfe\x80" + damaged[3:]))
    assert read_volume(path).name == "cloud"


def test_a_vdb_whose_grid_has_a_name_that_is_not_utf_8_is_refused_or_read(tmp_path: Path) -> None:
    from spectral_core.volume.files.vdb.write import write_grid

    path = tmp_path / "v.vdb"
    write_grid(path, np.ones((9, 9, 9), np.float32), np.eye(4), "density", {})
    data = path.read_bytes()
    path.write_bytes(data.replace(b"density", b"dens\xff\xfe\x80"))
    with pytest.raises(FileFormatError, match="not an OpenVDB file that can be read"):
        read_volume(path)


def test_a_tiff_with_fewer_strips_than_its_size_needs_is_refused_at_once(tmp_path: Path) -> None:
    tifffile = pytest.importorskip("tifffile")
    path = tmp_path / "wide.tif"
    tifffile.imwrite(path, np.zeros((8, 5), np.uint8), compression="zlib", rowsperstrip=4, metadata=None)
    with tifffile.TiffFile(path) as file:
        tag = file.pages[0].tags["ImageLength"]
        place, layout = tag.valueoffset, {"SHORT": "<H", "LONG": "<I"}[tag.dtype.name]
    data = bytearray(path.read_bytes())
    struct.pack_into(layout, data, place, 60_000)
    path.write_bytes(data)
    with pytest.raises(FileFormatError, match="60000×5 needs 15000 strips, the file states 2"):
        read_volume(path)


def test_a_vdb_of_two_million_tiles_is_read_with_array_operations(tmp_path: Path) -> None:
    from spectral_core.volume.files.vdb.grid import PlainGrid, Tiles

    count = 2_000_000
    corners = np.zeros((count, 3), np.int64)
    corners[:, 0] = 10_000 + 8 * np.arange(count)
    tiles = Tiles(corners, np.full(count, 8), np.ones(count, np.float32), np.ones(count, bool))
    empty = np.empty((0, 8, 8, 8), np.float32)
    grid = PlainGrid("g", {}, np.eye(4), 0.0, empty, np.empty((0, 3), np.int64), empty.astype(bool), tiles)
    assert grid.active_box() == ((10_000, 0, 0), (10_000 + 8 * count - 1, 7, 7))
    array = np.empty((16, 8, 8), np.float32)
    grid.fill(array, (9_992, 0, 0))
    assert array[:8].max() == 0 and array[8:].min() == 1
    assert sys.getsizeof(tiles) < 1000

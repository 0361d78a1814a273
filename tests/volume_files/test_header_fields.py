# SPDX-License-Identifier: GPL-3.0-or-later
"""Every field of MetaImage and NRRD headers, written by hand: what it means, and which values are refused."""

from __future__ import annotations

import zlib
from pathlib import Path

import numpy as np
import pytest

from spectral_core.errors import FileFormatError, InvalidInputError
from spectral_core.volume.files import read_volume
from spectral_core.volume.files.formats.nrrd_format import MOST_LINES_SKIPPED
from tests.volume_files.volume_fixtures import ORIGIN, SPACING, check, fixture_values, world

META = {"NDims": "3", "DimSize": "4 3 5", "ElementType": "MET_SHORT"}
NRRD = {"type": "short", "dimension": "3", "sizes": "4 3 5", "endian": "little", "encoding": "raw"}


def meta_of(path: Path, data: bytes = b"", named: str = "LOCAL", **fields: str) -> Path:
    """A MetaImage; a field of None is left out."""
    given = {key: value for key, value in {**META, **fields}.items() if value is not None}
    text = "".join(f"{key} = {value}\n" for key, value in given.items()) + f"ElementDataFile = {named}\n"
    path.write_bytes(text.encode() + data)
    return path


def nrrd_of(path: Path, data: bytes = b"", **fields: str) -> Path:
    """A NRRD file; underscores in names are blanks, and a field of None is left out."""
    given = {key.replace("_", " "): value for key, value in {**NRRD, **fields}.items() if value is not None}
    path.write_bytes(("NRRD0004\n" + "".join(f"{key}: {v}\n" for key, v in given.items()) + "\n").encode() + data)
    return path


def stored(values: np.ndarray, dtype: str) -> bytes:
    return values.astype(dtype).tobytes(order="F")


VALUES = fixture_values("int16")

# MetaImage

META_TYPES = {
    "CHAR": "i1", "UCHAR": "u1", "SHORT": "i2", "USHORT": "u2", "INT": "i4", "UINT": "u4", "LONG": "i4", "ULONG": "u4",
    "LONG_LONG": "i8", "ULONG_LONG": "u8", "FLOAT": "f4", "DOUBLE": "f8",
}  # fmt: skip


@pytest.mark.parametrize(("kind", "dtype"), META_TYPES.items())
def test_metaimage_types(tmp_path: Path, kind: str, dtype: str) -> None:
    values = fixture_values("uint8" if dtype[0] == "u" else "int8").astype(dtype)
    volume = read_volume(meta_of(tmp_path / "a.mha", stored(values, "<" + dtype), ElementType=f"MET_{kind}"))
    assert volume.data.dtype == np.dtype(dtype)
    np.testing.assert_array_equal(volume.data, values)


@pytest.mark.parametrize("key", ["BinaryDataByteOrderMSB", "ElementByteOrderMSB"])
@pytest.mark.parametrize(("word", "order"), [("True", ">"), ("1", ">"), ("T", ">"), ("YES", ">"), ("False", "<"),
                                             ("0", "<"), ("no", "<")])  # fmt: skip
def test_metaimage_byte_order(tmp_path: Path, key: str, word: str, order: str) -> None:
    check(read_volume(meta_of(tmp_path / "a.mha", stored(VALUES, order + "i2"), **{key: word})), VALUES, np.eye(4))


def test_metaimage_compressed_and_as_text(tmp_path: Path) -> None:
    packed = zlib.compress(stored(VALUES, "<i2"))
    check(read_volume(meta_of(tmp_path / "a.mha", packed, CompressedData="True")), VALUES, np.eye(4))
    (tmp_path / "a.zraw").write_bytes(packed)
    named = meta_of(tmp_path / "b.mhd", named="a.zraw", CompressedData="True")
    check(read_volume(named), VALUES, np.eye(4))
    text = " ".join(map(str, VALUES.ravel(order="F"))).encode()
    check(read_volume(meta_of(tmp_path / "c.mha", text, BinaryData="False")), VALUES, np.eye(4))
    with pytest.raises(FileFormatError, match="truncated or damaged"):
        read_volume(meta_of(tmp_path / "d.mha", packed[:-9], CompressedData="True"))


@pytest.mark.parametrize("size", ["ElementSpacing", "ElementSize"])
@pytest.mark.parametrize("place", ["Offset", "Position", "Origin"])
@pytest.mark.parametrize("frame", ["TransformMatrix", "Rotation", "Orientation"])
def test_metaimage_geometry_under_all_names(tmp_path: Path, size: str, place: str, frame: str) -> None:
    words = {size: "0.5 1.25 2", place: "10 -20 3.5", frame: "0 1 0 0 0 1 1 0 0"}
    # Row a is the direction of axis a: x goes along y, y along z, z along x.
    expected = np.eye(4)
    expected[:3, :3] = np.array([[0, 0, 2], [0.5, 0, 0], [0, 1.25, 0]])
    expected[:3, 3] = 10, -20, 3.5
    check(read_volume(meta_of(tmp_path / "a.mha", stored(VALUES, "<i2"), **words)), VALUES, expected)


def test_metaimage_of_four_axes_and_of_channels(tmp_path: Path) -> None:
    frames = np.stack([VALUES, VALUES + 100], axis=3)
    words = {"NDims": "4", "DimSize": "4 3 5 2", "ElementSpacing": "0.5 1.25 2 7", "Offset": "10 -20 3.5 9"}
    path = meta_of(tmp_path / "t.mha", stored(frames, "<i2"), **words)
    check(read_volume(path, component=1), frames[..., 1], world())
    with pytest.raises(InvalidInputError, match="2 entries along a fourth axis"):
        read_volume(path)
    rows = " ".join(map(str, np.diag([1.0, -1.0, 1.0, 1.0]).ravel()))
    turned = read_volume(meta_of(tmp_path / "u.mha", stored(frames, "<i2"), TransformMatrix=rows, **words), component=0)
    assert turned.world_from_index[1, 1] == -1.25 and turned.world_from_index[2, 3] == 3.5
    channels = np.stack([VALUES, VALUES + 100])
    path = meta_of(tmp_path / "c.mha", stored(channels, "<i2"), ElementNumberOfChannels="2")
    check(read_volume(path, component=1), channels[1], np.eye(4))
    with pytest.raises(InvalidInputError, match="2 channels per voxel"):
        read_volume(path)


@pytest.mark.parametrize(
    ("fields", "message"),
    [({"NDims": "2"}, "2 axes"), ({"NDims": "5"}, "5 axes"), ({"DimSize": "4 0 5"}, "at least 1"),
     ({"DimSize": "4 3"}, "expected 3 finite"), ({"DimSize": "4 x 5"}, "expected numbers"),
     ({"ElementType": "MET_STRING"}, "ElementType MET_STRING"), ({"ElementType": None}, "lacks ElementType"),
     ({"ElementNumberOfChannels": "0"}, "0 channels"), ({"ElementSpacing": "1 nan 1"}, "finite"),
     ({"NDims": "3.5"}, "whole numbers"), ({"DimSize": "4 3.5 5"}, "whole numbers"),
     ({"Offset": "1 2 3 4"}, "expected 3 finite"), ({"DimSize": "4 3 6"}, "truncated"),
     ({"DimSize": "4 3 4"}, "holds more than")],
)  # fmt: skip
def test_metaimage_refuses(tmp_path: Path, fields: dict[str, str], message: str) -> None:
    with pytest.raises(FileFormatError, match=message):
        read_volume(meta_of(tmp_path / "a.mha", stored(VALUES, "<i2"), **fields))


def test_metaimage_header_lines(tmp_path: Path) -> None:
    data = stored(VALUES, "<i2")
    head = "NDims=3\n\nDimSize =4 3 5\n  ElementType= MET_SHORT \nElementDataFile = local\n"
    (tmp_path / "a.mha").write_bytes(head.encode() + data)
    check(read_volume(tmp_path / "a.mha"), VALUES, np.eye(4))
    (tmp_path / "b.mha").write_text("NDims = 3\nno field\n")
    with pytest.raises(FileFormatError, match="'no field' of b.mha|is no 'key = value'"):
        read_volume(tmp_path / "b.mha")
    (tmp_path / "c.mha").write_text("NDims = 3\nDimSize = 4 3 5\n")
    with pytest.raises(FileFormatError, match="ends before ElementDataFile"):
        read_volume(tmp_path / "c.mha")


def test_metaimage_header_of_the_data_file(tmp_path: Path) -> None:
    data = stored(VALUES, "<i2")
    (tmp_path / "a.raw").write_bytes(b"123" + data)
    for size in ("3", "-1"):
        check(read_volume(meta_of(tmp_path / "a.mhd", named="a.raw", HeaderSize=size)), VALUES, np.eye(4))
    (tmp_path / "whole.raw").write_bytes(data)
    check(read_volume(meta_of(tmp_path / "w.mhd", named="whole.raw", HeaderSize="-1")), VALUES, np.eye(4))
    (tmp_path / "short.raw").write_bytes(data[:-1])
    for size, message in (("-1", "119 bytes where 120 of data"), ("-2", "HeaderSize of short.raw is -2")):
        with pytest.raises(FileFormatError, match=message):
            read_volume(meta_of(tmp_path / "s.mhd", named="short.raw", HeaderSize=size))


def test_metaimage_of_several_files(tmp_path: Path) -> None:
    for z in range(5):
        (tmp_path / f"s{2 * z + 1}.raw").write_bytes(stored(VALUES[:, :, z], "<i2"))
    for named in ("s%d.raw 1 9 2", "LIST\n" + "\n".join(f"s{2 * z + 1}.raw" for z in range(5))):
        check(read_volume(meta_of(tmp_path / "a.mhd", named=named)), VALUES, np.eye(4))
    with pytest.raises(FileFormatError, match="names 7 data files for sizes"):
        read_volume(meta_of(tmp_path / "b.mhd", named="s%d.raw 1 13 2"))
    one_by_one = "".join(f"t{n}.raw\n" for n in range(4))
    for n in range(4):
        (tmp_path / f"t{n}.raw").write_bytes(stored(VALUES, "<i2")[30 * n : 30 * n + 30])
    check(read_volume(meta_of(tmp_path / "c.mhd", named="LIST\n" + one_by_one)), VALUES, np.eye(4))
    check(read_volume(meta_of(tmp_path / "d.mhd", named="t%d.raw 0 3")), VALUES, np.eye(4))


# NRRD


def test_nrrd_byte_order_matters_for_several_bytes(tmp_path: Path) -> None:
    for word, order in (("little", "<"), ("big", ">"), ("Big", ">")):
        check(read_volume(nrrd_of(tmp_path / "a.nrrd", stored(VALUES, order + "i2"), endian=word)), VALUES, np.eye(4))
    for word in (None, "middle"):
        with pytest.raises(FileFormatError, match="2 bytes without the field endian"):
            read_volume(nrrd_of(tmp_path / "b.nrrd", stored(VALUES, "<i2"), endian=word))
    small = fixture_values("uint8")
    check(read_volume(nrrd_of(tmp_path / "c.nrrd", stored(small, "u1"), type="uchar", endian=None)), small, np.eye(4))
    text = " ".join(map(str, VALUES.ravel(order="F"))).encode()
    for encoding in ("ascii", "text", "txt"):
        path = nrrd_of(tmp_path / "d.nrrd", text, encoding=encoding, endian=None)
        check(read_volume(path), VALUES, np.eye(4))


@pytest.mark.parametrize(
    ("fields", "message"),
    [({"sizes": "4 3"}, "not a NRRD|must agree"), ({"sizes": "4 0 5"}, "must agree"), ({"type": "block"}, "block"),
     ({"encoding": "hex"}, "not supported"), ({"type": "quad"}, "quad"), ({"line_skip": "-1"}, "skips -1 lines"),
     ({"byte_skip": "-2"}, "-2 bytes"), ({"encoding": "gzip", "byte_skip": "1"}, "1 bytes before gzip"),
     ({"line_skip": str(MOST_LINES_SKIPPED + 1)}, "expected at most"), ({"sizes": None}, "lacks sizes"),
     ({"sizes": "4 3 6", "byte_skip": "-1"}, "120 bytes where 144 of data"), ({"sizes": "4 3 6"}, "truncated"),
     ({"dimension": "4", "sizes": "4 3 5 1"}, "of which 4 are")],
)  # fmt: skip
def test_nrrd_refuses(tmp_path: Path, fields: dict[str, str], message: str) -> None:
    with pytest.raises(FileFormatError, match=message):
        read_volume(nrrd_of(tmp_path / "a.nrrd", stored(VALUES, "<i2"), **fields))


def test_nrrd_skips_lines_then_bytes(tmp_path: Path) -> None:
    data = stored(VALUES, "<i2")
    path = nrrd_of(tmp_path / "a.nrrd", b"one\ntwo\nabc" + data, line_skip="2", byte_skip="3")
    check(read_volume(path), VALUES, np.eye(4))
    (tmp_path / "exact.raw").write_bytes(data)
    check(read_volume(nrrd_of(tmp_path / "b.nhdr", byte_skip="-1", data_file="exact.raw")), VALUES, np.eye(4))
    with pytest.raises(FileFormatError, match="truncated"):
        read_volume(nrrd_of(tmp_path / "c.nrrd", data, line_skip=str(MOST_LINES_SKIPPED)))


def test_nrrd_of_several_files(tmp_path: Path) -> None:
    for z in range(5):
        (tmp_path / f"s{z}.raw").write_bytes(stored(VALUES[:, :, z], "<i2"))
    check(read_volume(nrrd_of(tmp_path / "a.nhdr", data_file="s%d.raw 0 4 1")), VALUES, np.eye(4))
    check(read_volume(nrrd_of(tmp_path / "b.nhdr", data_file="s%d.raw 0 4 1 2")), VALUES, np.eye(4))
    down = read_volume(nrrd_of(tmp_path / "c.nhdr", data_file="s%d.raw 4 0 -1"))
    check(down, VALUES[:, :, ::-1], np.eye(4))
    with pytest.raises(FileFormatError, match="60 numbers over 7 files"):
        read_volume(nrrd_of(tmp_path / "d.nhdr", data_file="s%d.raw 0 6 1"))


def test_nrrd_geometry(tmp_path: Path) -> None:
    data = stored(VALUES, "<i2")
    sheared = {"space_dimension": "3", "space_directions": "(0.5,0,0) (0.1,1.25,0) (0,0,2)"}
    expected = np.array([[0.5, 0.1, 0, 0], [0, 1.25, 0, 0], [0, 0, 2, 0], [0, 0, 0, 1]])
    check(read_volume(nrrd_of(tmp_path / "a.nrrd", data, **sheared)), VALUES, expected)
    expected[:3, 3] = 1, -2, 3
    path = nrrd_of(tmp_path / "b.nrrd", data, **sheared, space_origin="(1,-2,3)")
    check(read_volume(path), VALUES, expected)
    path = nrrd_of(tmp_path / "c.nrrd", data, spacings="0.5 nan 2", axis_mins="10 nan 3.5")
    check(read_volume(path), VALUES, world(spacing=(0.5, 1.0, 2.0), origin=(10.0, 0.0, 3.5)))
    path = nrrd_of(tmp_path / "d.nrrd", data, spacings="0.5 1.25 2", centerings="cell node cell")
    check(read_volume(path), VALUES, np.diag([*SPACING, 1]))  # centers shift no volume without minima
    path = nrrd_of(
        tmp_path / "e.nrrd", data, spacings="0.5 1.25 2", centerings="cell node cell", axis_mins="10 -20 3.5"
    )
    check(read_volume(path), VALUES, world(origin=np.add(ORIGIN, (0.25, 0, 1))))


def test_nrrd_vectors_at_any_axis(tmp_path: Path) -> None:
    middle = np.stack([VALUES, VALUES + 100], axis=1)
    fields = {"dimension": "4", "sizes": "4 2 3 5"}
    by_directions = {"space_dimension": "3", "space_directions": "(1,0,0) none (0,1,0) (0,0,1)"}
    by_kinds = {"kinds": "domain vector space domain"}
    for words in (by_directions, by_kinds):
        path = nrrd_of(tmp_path / "a.nrrd", stored(middle, "<i2"), **fields, **words)
        check(read_volume(path, component=1), middle[:, 1], np.eye(4))
        with pytest.raises(InvalidInputError, match="2 components"):
            read_volume(path)


@pytest.mark.parametrize(("centering", "origin"), [("node", (-3.0, 1.0, 2.0)), ("cell", (-2.0, 3.0, 5.0))])
def test_nrrd_voxels_between_the_ends_of_its_axes(tmp_path: Path, centering: str, origin: tuple[float, ...]) -> None:
    values = np.arange(24, dtype=np.uint8).reshape(2, 3, 4, order="F")
    steps = np.array([2.0, 4.0, 6.0])
    low = np.array([-3.0, 1.0, 2.0])
    high = low + steps * (np.array(values.shape) - (centering == "node"))
    fields = {"axis mins": low, "axis maxs": high, "centerings": [centering] * 3}
    head = "".join(f"{key}: {' '.join(map(str, given))}\n" for key, given in fields.items())
    text = f"NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 3 4\nencoding: raw\n{head}\n"
    (tmp_path / "a.nrrd").write_bytes(text.encode() + values.tobytes("F"))
    matrix = np.diag([*steps, 1.0])
    matrix[:3, 3] = origin
    assert np.allclose(read_volume(tmp_path / "a.nrrd").world_from_index, matrix)


def test_nrrd_list_of_slices_with_their_dimension(tmp_path: Path) -> None:
    for number in (1, 2):
        (tmp_path / f"s{number}.raw").write_bytes(bytes([number] * 4))
    head = "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 2 2\nencoding: raw\ndata file: LIST 2\ns1.raw\ns2.raw\n"
    (tmp_path / "l.nhdr").write_text(head)
    assert read_volume(tmp_path / "l.nhdr").data[0, 0].tolist() == [1, 2]

# SPDX-License-Identifier: GPL-3.0-or-later
"""Raw numbers and the headers beside them."""

from __future__ import annotations

import numpy as np
import pytest

from spectral_core.errors import FileFormatError, InvalidInputError
from spectral_core.volume.files import RawLayout, read_volume
from tests.volume_files.volume_fixtures import (
    ORIGIN,
    SHAPE,
    SPACING,
    check,
    fixture_values,
    world,
)

# Raw and its headers


def test_raw_layouts_are_read(tmp_path):
    values = fixture_values("uint16")
    (tmp_path / "foot_4x3x5_uint16.raw").write_bytes(values.tobytes(order="F"))
    (tmp_path / "foot_4x3x5_uint16_be.raw").write_bytes(values.astype(">u2").tobytes(order="F"))
    (tmp_path / "plain.bytes").write_bytes(b"header!" + values.tobytes(order="F"))
    check(read_volume(tmp_path / "foot_4x3x5_uint16.raw"), values, np.eye(4))
    check(read_volume(tmp_path / "foot_4x3x5_uint16_be.raw"), values, np.eye(4))
    for offset in (7, -1):
        layout = RawLayout(SHAPE, "uint16", offset=offset, spacing=SPACING, origin=ORIGIN)
        check(read_volume(tmp_path / "plain.bytes", raw=layout), values, world())


def test_raw_of_another_length_is_refused(tmp_path):
    (tmp_path / "a.raw").write_bytes(bytes(100))
    with pytest.raises(
        FileFormatError, match=r"a.raw has 100 bytes; 4×3×5 numbers of type uint16 after 0 bytes .* 120 bytes"
    ):
        read_volume(tmp_path / "a.raw", raw=RawLayout(SHAPE, "uint16"))
    with pytest.raises(InvalidInputError, match=r"does not spell a layout.*raw=RawLayout"):
        read_volume(tmp_path / "a.raw")
    (tmp_path / "a.mhd").write_text("NDims = 3")
    with pytest.raises(InvalidInputError, match=r"a.mhd lies beside it: open that"):
        read_volume(tmp_path / "a.raw")


def test_raw_data_are_in_memory_once(tmp_path):
    import tracemalloc

    (tmp_path / "a_200x100x100_uint8.raw").write_bytes(bytes(2_000_000))
    tracemalloc.start()
    volume = read_volume(tmp_path / "a_200x100x100_uint8.raw")
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert volume.data.flags.f_contiguous
    assert peak < 2_300_000


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (((4, 3), "uint8"), "expected three counts"),
        (((4, 3, 0), "uint8"), "each at least 1"),
        (((4, 3, 5), "uint9"), "expected a NumPy type"),
        (((4, 3, 5), "complex64"), "expected an integer or float type"),
        (((4, 3, 5), "uint8", "middle"), "expected 'little' or 'big'"),
        (((4, 3, 5), ">u2"), "type '>u2' beside byte_order 'little', which differ"),
        (((4, 3, 5), "uint8", "little", -2), "or -1 for the file's end"),
        (((4, 3, 5), "uint8", "little", 0, (1, np.nan, 1)), "spacing of the raw layout holds 1 value"),
    ],
)
def test_invalid_raw_layouts_are_refused(arguments, message):
    with pytest.raises(InvalidInputError, match=message):
        RawLayout(*arguments)


def test_dat_headers(tmp_path):
    values = fixture_values("uint16")
    (tmp_path / "e.raw").write_bytes(b"1234" + values.astype(">u2").tobytes(order="F"))
    volvis = (
        "ObjectFileName: e.raw\nTaggedFileName: ---\nResolution: 4 3 5\nSliceThickness: 0.5 1.25 2\nFormat: USHORT_12\n"
    )
    inviwo = "RawFile: e.raw\nResolution: 4 3 5\nSpacing: 0.5 1.25 2\nFormat: UINT16\n"
    for text in (volvis, inviwo):
        (tmp_path / "e.dat").write_text(text + "ByteOffset: 4\nEndianness: BigEndian\nOrigin: 10 -20 3.5\n")
        check(read_volume(tmp_path / "e.dat"), values, world())
    (tmp_path / "e.dat").write_text(volvis.replace("e.raw", "f.raw"))
    with pytest.raises(FileFormatError, match=r"names the data file 'f.raw', which is not in"):
        read_volume(tmp_path / "e.dat")


def test_metaimage_variants(tmp_path):
    values = fixture_values("int16")
    head = "ObjectType = Image\nNDims = 3\nDimSize = 4 3 5\nElementType = MET_SHORT\n"
    head += "ElementSize = 0.5 1.25 2\nPosition = 10 -20 3.5\n"
    big = values.astype(">i2").tobytes(order="F")
    (tmp_path / "a.raw").write_bytes(b"skipped" + big)
    (tmp_path / "a.mhd").write_text(head + "ElementByteOrderMSB = True\nHeaderSize = -1\nElementDataFile = a.raw\n")
    check(read_volume(tmp_path / "a.mhd"), values, world())
    numbers = " ".join(str(n) for n in values.ravel(order="F"))
    (tmp_path / "b.mha").write_text(head + "BinaryData = False\nElementDataFile = LOCAL\n" + numbers)
    check(read_volume(tmp_path / "b.mha"), values, world())
    for z in range(5):
        (tmp_path / f"s{z}.raw").write_bytes(values[:, :, z].tobytes(order="F"))
    (tmp_path / "p.mhd").write_text(head + "ElementDataFile = s%d.raw 0 4 1\n")
    (tmp_path / "l.mhd").write_text(head + "ElementDataFile = LIST\n" + "\n".join(f"s{z}.raw" for z in range(5)))
    check(read_volume(tmp_path / "p.mhd"), values, world())
    check(read_volume(tmp_path / "l.mhd"), values, world())


@pytest.mark.parametrize(
    ("end", "order"),
    [("", "little"), ("_be", "big"), ("-BIG", "big"), ("_le", "little"), ("_before", "little"), ("_beta2", "little")],
)
def test_the_byte_order_in_a_name_is_a_word_of_its_own(end, order):
    assert RawLayout.from_name(f"scan_4x5x6_uint16{end}.raw").byte_order == order

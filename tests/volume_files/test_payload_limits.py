# SPDX-License-Identifier: GPL-3.0-or-later
"""Numbers of files at the limits of their counts and types, in every encoding."""

from __future__ import annotations

import bz2
import gzip
import io
import zlib
from pathlib import Path

import numpy as np
import pytest

from spectral_core.errors import FileFormatError, InvalidInputError
from spectral_core.files.guarded import MOST_NAMES
from spectral_core.volume.files import payload
from spectral_core.volume.files.payload import (
    affine,
    listed_files,
    make_volume,
    numbered_files,
    parse_text,
    parse_words,
    pick_component,
    read_numbers,
    x_first,
)

SOURCE = Path("file.raw")
PACKED = {
    "raw": lambda data: data, "gzip": gzip.compress, "bzip2": bz2.compress, "zlib": zlib.compress,
    "ascii": lambda data: b" ".join(str(int(v)).encode() for v in np.frombuffer(data, ">i2")),
}  # fmt: skip


@pytest.mark.parametrize("encoding", list(PACKED))
@pytest.mark.parametrize("count", [1, 7, 300_000])
def test_numbers_are_read_from_every_encoding(encoding: str, count: int) -> None:
    values = (np.arange(count) % 251 - 100).astype(">i2")
    stream = io.BytesIO(b"head" + PACKED[encoding](values.tobytes()))
    stream.seek(4)
    found = read_numbers(stream, np.dtype(">i2"), count, SOURCE, encoding=encoding)
    np.testing.assert_array_equal(found, values)
    assert found.dtype.isnative and not found.flags.writeable


@pytest.mark.parametrize("encoding", list(PACKED))
def test_one_number_more_or_less_is_refused(encoding: str) -> None:
    values = np.arange(10, dtype=">i2")
    packed = PACKED[encoding](values.tobytes())
    for count in (9, 11):
        with pytest.raises(FileFormatError, match=r"more than|truncated|lists"):
            read_numbers(io.BytesIO(packed), np.dtype(">i2"), count, SOURCE, encoding=encoding)
    if encoding != "ascii":  # numbers may be followed by other data where the caller says so
        kept = read_numbers(io.BytesIO(packed), np.dtype(">i2"), 9, SOURCE, encoding=encoding, exact=False)
        np.testing.assert_array_equal(kept, values[:9])
        with pytest.raises(FileFormatError, match="truncated"):
            read_numbers(io.BytesIO(packed), np.dtype(">i2"), 11, SOURCE, encoding=encoding, exact=False)
    for cut in (1, 3):
        if encoding != "raw" or cut % 2:
            with pytest.raises(FileFormatError):
                read_numbers(io.BytesIO(packed[:-cut]), np.dtype(">i2"), 10, SOURCE, encoding=encoding)


def test_a_gzip_stream_is_read_as_zlib_too() -> None:
    values = np.arange(5, dtype="<f4")
    found = read_numbers(io.BytesIO(gzip.compress(values.tobytes())), np.dtype("<f4"), 5, SOURCE, encoding="zlib")
    np.testing.assert_array_equal(found, values)


def test_what_is_left_counts_from_the_position() -> None:
    stream = io.BytesIO(b"12345678")
    stream.seek(3)
    assert payload._bytes_left(stream) == 5 and stream.tell() == 3
    payload._require_length(stream, 5, SOURCE)
    with pytest.raises(FileFormatError, match="have 5 bytes where its header states 6"):
        payload._require_length(stream, 6, SOURCE)


@pytest.mark.parametrize(("dtype", "low", "high"), [("i1", -128, 127), ("u1", 0, 255), ("i2", -32768, 32767),
                                                    ("u4", 0, 2**32 - 1),
                                                    ("u8", 0, 2**64 - 1), ("i8", -(2**63), 2**63 - 1)])  # fmt: skip
def test_text_numbers_fill_the_range_of_their_type(dtype: str, low: int, high: int) -> None:
    words = [str(low).encode(), str(high).encode()]
    np.testing.assert_array_equal(parse_words(words, np.dtype(dtype), SOURCE), np.array([low, high], dtype))
    for beyond in (low - 1, high + 1):
        with pytest.raises(FileFormatError, match="range of its type"):
            parse_words([str(beyond).encode()], np.dtype(dtype), SOURCE)
    assert parse_words([b"1.5", b"-2e3"], np.dtype(">f4"), SOURCE).tolist() == [1.5, -2000.0]


def test_texts_longer_than_a_chunk_keep_all_numbers(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(payload, "_CHUNK", 5)
    text = b" ".join(str(n).encode() for n in range(100)) + b"\n"
    np.testing.assert_array_equal(parse_text(text, np.dtype("i4"), 100, SOURCE), np.arange(100))
    with pytest.raises(FileFormatError, match="lists 100 numbers where 101 are stated"):
        parse_text(text, np.dtype("i4"), 101, SOURCE)
    with pytest.raises(FileFormatError, match=r"lists more than \d+ numbers where 3 are stated"):
        parse_text(text, np.dtype("i4"), 3, SOURCE)
    assert parse_text(b" \n", np.dtype("i4"), 0, SOURCE).size == 0


@pytest.mark.parametrize(
    ("pattern", "numbers", "expected"),
    [("x%d.raw", range(9, 12), ["x9.raw", "x10.raw", "x11.raw"]),
     ("x%03d.raw", range(8, 11), ["x008.raw", "x009.raw", "x010.raw"]),
     ("%3u", range(5, 6), ["  5"]), ("s%02d_a", range(4, 0, -2), ["s04_a", "s02_a"])],
)  # fmt: skip
def test_numbered_files_are_those_of_printf(pattern: str, numbers: range, expected: list[str]) -> None:
    found = numbered_files(pattern, numbers, Path("/data"), SOURCE)
    assert found == [Path("/data") / name for name in expected]


def test_a_header_names_at_least_one_file_and_not_too_many() -> None:
    for pattern in ("x.raw", "%d%d", "%s", "%123d", "x%f"):
        with pytest.raises(FileFormatError, match="expected one number"):
            numbered_files(pattern, range(3), Path(), SOURCE)
    with pytest.raises(FileFormatError, match="names no data file"):
        numbered_files("x%d", range(0), Path(), SOURCE)
    assert len(numbered_files("x%d", range(MOST_NAMES), Path(), SOURCE)) == MOST_NAMES
    for many in (range(MOST_NAMES + 1), range(2**70)):
        with pytest.raises(FileFormatError, match=f"more than {MOST_NAMES:,} data files"):
            numbered_files("x%d", many, Path(), SOURCE)
    listed = listed_files(io.BytesIO(b"a.raw\n\n b.raw \n"), Path("/d"), SOURCE)
    assert listed == [Path("/d/a.raw"), Path("/d/b.raw")]
    with pytest.raises(FileFormatError, match="names no data file"):
        listed_files(io.BytesIO(b"\n\n"), Path("/d"), SOURCE)


def test_components_are_picked_by_number() -> None:
    array = np.arange(24).reshape(2, 3, 4)
    np.testing.assert_array_equal(pick_component(array, 1, 2, SOURCE), array[:, 2])
    np.testing.assert_array_equal(pick_component(array[:, :1], 1, None, SOURCE), array[:, 0])
    for wrong in (3, -1):
        with pytest.raises(InvalidInputError, match="it has components 0 to 2"):
            pick_component(array, 1, wrong, SOURCE)
    with pytest.raises(InvalidInputError, match="component=0 to 2"):
        pick_component(array, 1, None, SOURCE)


def test_arrays_become_volumes() -> None:
    numbers = np.arange(24)
    array = x_first(numbers, (2, 3, 4))
    assert array.shape == (2, 3, 4) and array[1, 2, 3] == 1 + 2 * (2 + 3 * 3)
    matrix = affine(np.diag([2.0, 3.0, 4.0]) + np.eye(3, k=1), np.array([5.0, 6.0, 7.0]))
    np.testing.assert_array_equal(matrix, [[2, 1, 0, 5], [0, 3, 1, 6], [0, 0, 4, 7], [0, 0, 0, 1]])
    volume = make_volume("m", np.ones((2, 2, 2), bool), np.eye(4), SOURCE)
    assert volume.data.dtype == np.uint8 and volume.value_range == (1.0, 1.0)
    with pytest.raises(FileFormatError, match=r"file\.raw: .*not invertible"):
        make_volume("m", np.ones((2, 2, 2), np.uint8), np.diag([1.0, 0, 1, 1]), SOURCE)
